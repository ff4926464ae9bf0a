// Flying: keys and mouse become positions and directions of the document's camera. All else the program does.

const add = (a, b, s = 1) => a.map((c, i) => c + s * b[i]);
const dot = (a, b) => a.reduce((sum, c, i) => sum + c * b[i], 0);
const cross = ([a, b, c], [x, y, z]) => [b * z - c * y, c * x - a * z, a * y - b * x];
const unit = (v) => v.map((c) => c / Math.sqrt(dot(v, v)));
const rounded = (v) => v.map((c) => Number(c.toPrecision(7)));

/** `v` turned about the unit `axis` (Rodrigues). */
function turned(v, axis, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  return add(add(v.map((x) => x * c), cross(axis, v), s), axis, dot(axis, v) * (1 - c));
}

const MOVES = { KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyD: [1, 0, 0], KeyA: [-1, 0, 0], KeyR: [0, 1, 0], KeyF: [0, -1, 0] };
const TURNS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

export class Flight {
  /** `changed(camera, moving)` gets position, direction and up. */
  constructor(changed) {
    this.changed = changed;
    this.held = new Set();
    this.speed = 1;
    this.camera = null;
    this.turning = [0, 0];
  }

  /** The document's camera; not while one is on the way, when ours is newer. */
  take({ camera, view }, { name, radius, depth }) {
    if (!this.isMoving) this.camera = structuredClone(camera);
    // Where the document leaves it open: in two seconds to what is in the middle of the scene.
    if (view.speed != null) this.speed = view.speed;
    else if (radius && (name !== this.name || this.wasSet)) this.speed = (depth ?? radius) * 0.5;
    [this.name, this.wasSet] = [radius ? name : this.name, view.speed != null];
  }

  get isMoving() {
    return this.held.size > 0 || this.turning.some((t) => t !== 0) || this.isDragging;
  }

  faster(steps) {
    this.speed = Number((this.speed * 1.2 ** steps).toPrecision(3));
    return this.speed;
  }

  /** Whether the key is one of ours. */
  press(code) {
    if (!(code in MOVES || code in TURNS)) return false;
    if (!this.held.has(code)) {
      this.held.add(code);
      this.run();
    }
    return true;
  }

  release(code) {
    this.held.delete(code);
  }

  releaseAll() {
    this.held.clear();
  }

  drag(dx, dy, height) {
    const perPixel = ((this.camera?.fov ?? 70) * Math.PI) / 180 / height;
    this.turning = [this.turning[0] - dx * perPixel, this.turning[1] - dy * perPixel];
    this.run();
  }

  startDrag() {
    this.isDragging = true;
  }

  endDrag() {
    if (!this.isDragging) return;
    this.isDragging = false;
    if (this.camera) this.changed(this.camera, false);
  }

  run() {
    if (this.running) return;
    this.running = true;
    let last = performance.now();
    const step = (now) => {
      const seconds = Math.min((now - last) / 1000, 0.1);
      last = now;
      if (this.camera) this.advance(seconds);
      if (this.held.size > 0) {
        requestAnimationFrame(step);
      } else {
        this.running = false;
        if (this.camera && !this.isDragging) this.changed(this.camera, false);
      }
    };
    requestAnimationFrame(step);
  }

  advance(seconds) {
    let dir = unit(this.camera.dir);
    const right = unit(cross(dir, this.camera.up));
    let up = cross(right, dir);
    let pos = this.camera.pos;
    let [yaw, pitch] = this.turning;
    this.turning = [0, 0];
    for (const code of this.held) {
      if (code in MOVES) {
        const [x, y, z] = MOVES[code];
        const way = this.speed * seconds;
        pos = add(add(add(pos, right, x * way), up, y * way), dir, z * way);
      } else {
        const [x, y] = TURNS[code];
        yaw -= x * seconds;
        pitch -= y * seconds;
      }
    }
    if (yaw !== 0 || pitch !== 0) {
      // About the world's vertical where the horizon is level, so that it stays level; else about the camera's own.
      const axis = Math.abs(right[1]) < 1e-3 ? [0, Math.sign(up[1]) || 1, 0] : up;
      const steepest = (89 * Math.PI) / 180;
      if (axis !== up) {
        const now = Math.asin(Math.max(-1, Math.min(1, dir[1] * axis[1])));
        pitch = Math.max(-steepest - now, Math.min(steepest - now, pitch));
      }
      dir = turned(turned(dir, right, pitch), axis, yaw);
      up = turned(turned(up, right, pitch), axis, yaw);
    }
    const camera = { pos: rounded(pos), dir: rounded(dir), up: rounded(up) };
    Object.assign(this.camera, camera);
    this.changed(this.camera, true);
  }
}
