// Shows frames: bytes of RGB on a canvas, and what they are, in words below it.

const VIEWS = { image: "image", reference: "reference", error: "signed error", variance: "variance" };

export class Screen {
  constructor(letter) {
    this.figure = document.querySelector(`.panel-${letter}`);
    this.canvas = document.querySelector(`#screen-${letter}`);
    this.caption = document.querySelector(`#caption-${letter}`);
    this.context = this.canvas.getContext("2d", { alpha: false });
    this.small = document.createElement("canvas");
    this.ring = document.createElement("span");
    this.ring.className = "mark";
    this.ring.hidden = true;
    this.canvas.after(this.ring);
    new ResizeObserver(() => this.place()).observe(this.canvas);
    this.full = [1, 1];
  }

  /** Draws one panel of a frame; a coarse one is stretched to the picture's size. */
  draw(panel, bytes) {
    const { width, height, full } = panel;
    this.full = full;
    if (!this.image || this.image.width !== width || this.image.height !== height) {
      this.image = new ImageData(width, height);
      this.image.data.fill(255);
    }
    const out = this.image.data;
    for (let i = 0, o = 0; i < bytes.length; o += 4) {
      out[o] = bytes[i++];
      out[o + 1] = bytes[i++];
      out[o + 2] = bytes[i++];
    }
    if (this.canvas.width !== full[0] || this.canvas.height !== full[1]) {
      [this.canvas.width, this.canvas.height] = full;
    }
    if (width === full[0] && height === full[1]) {
      this.context.putImageData(this.image, 0, 0);
    } else {
      [this.small.width, this.small.height] = [width, height];
      this.small.getContext("2d", { alpha: false }).putImageData(this.image, 0, 0);
      this.context.imageSmoothingEnabled = true;
      this.context.drawImage(this.small, 0, 0, width * panel.block, height * panel.block);
    }
    // Enlarged, pixels stay squares; reduced, they are averaged.
    this.canvas.classList.toggle("smooth", this.fit().scale < 1);
    this.describe(panel);
    this.place();
  }

  /** Where the picture is in its canvas, in whose middle it is fitted: its top left corner, and the size of a pixel. */
  fit() {
    const box = this.canvas.getBoundingClientRect();
    const [w, h] = this.full;
    const scale = Math.min(box.width / w, box.height / h);
    return { left: box.left + (box.width - scale * w) / 2, top: box.top + (box.height - scale * h) / 2, scale };
  }

  /** Rings a pixel, or none. */
  mark(pixel) {
    this.marked = pixel;
    this.place();
  }

  place() {
    const is = this.marked && this.marked.x < this.full[0] && this.marked.y < this.full[1];
    this.ring.hidden = !is;
    if (!is) return;
    const { left, top, scale } = this.fit();
    const frame = this.figure.getBoundingClientRect();
    this.ring.style.left = `${left - frame.left + (this.marked.x + 0.5) * scale}px`;
    this.ring.style.top = `${top - frame.top + (this.marked.y + 0.5) * scale}px`;
  }

  describe({ view, scale, samples, of, sampler, reference, timing, block }) {
    const words = [VIEWS[view]];
    if (view === "reference") words.push(`2 × ${reference} spp`);
    else if (timing) words.push("timing a few samples");
    else words.push(block > 1 ? `one pixel in ${block * block}` : `${samples} of ${of} spp`);
    if (view === "error") words.push(`against 2 × ${reference} spp`);
    this.caption.textContent = `${sampler} · ${words.join(" · ")}`;
    if (scale == null) return;
    const bar = document.createElement("span");
    bar.className = `scale ${view === "error" ? "diverging" : "heat"}`;
    const [low, high] = view === "error" ? [-scale, scale] : [scale * 1e-4, scale];
    const what = view === "error" ? "luminance" : "variance of the mean, as if samples were independent";
    this.caption.append(" · ", number(low), bar, number(high), ` ${what}`);
  }

  /** The pixel under a mouse event, or null. */
  pixelAt(event) {
    const { left, top, scale } = this.fit();
    const [x, y] = [Math.floor((event.clientX - left) / scale), Math.floor((event.clientY - top) / scale)];
    return x >= 0 && y >= 0 && x < this.full[0] && y < this.full[1] ? { x, y } : null;
  }
}

/** Three digits that matter. */
export function number(x) {
  if (x == null || Number.isNaN(x)) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  return size >= 1e5 || size < 1e-3 ? x.toExponential(2) : String(Number(x.toPrecision(4)));
}

/** 12.3 M and the like. */
export function many(x) {
  for (const [unit, size] of [["G", 1e9], ["M", 1e6], ["k", 1e3]]) {
    if (x >= size) return `${(x / size).toPrecision(3)} ${unit}`;
  }
  return String(Math.round(x));
}
