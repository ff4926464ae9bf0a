// The flip viewer: pictures of one scene, in place of one another. Numbers about them come from the page; nothing is measured here
// but the difference of two pictures that are shown.

/** An element with attributes and children. */
function element(name, attributes = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value === true) made.setAttribute(key, "");
    else if (value !== false) made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

/** A number of radiance with four digits. */
function radiance(x) {
  if (x === 0) return "0";
  const size = Math.abs(x);
  const text = size >= 1e-3 && size < 1e5 ? String(Number(x.toPrecision(4))) : x.toExponential(3);
  return text.replace("-", "−");
}

const LAYOUTS = [["one", "One"], ["beside", "Side by side"], ["slider", "Slider"]];
const MAPS = [["picture", "Picture"], ["difference", "Difference"], ["flip", "FLIP map"]];
const SETS = [["samples", "Equal samples"], ["time", "Equal time"]];

/** Keys, and what they do: the table under the viewer and the help of its stage. */
const KEYS = [
  ["1 … 9, 0", "picture of that number"],
  ["← →", "picture before, picture after"],
  ["Shift, held", "the reference"],
  ["V", "one picture, two side by side, two with a slider"],
  [", .", "slider to the left, to the right"],
  ["P X F", "picture, difference, FLIP map"],
  ["G", "compare with this picture"],
  ["T", "pictures at equal samples, at equal time"],
  ["Q E", "darker, brighter by half a stop; maps: less, more colour"],
  ["+ − Z", "zoom in, out, to fit"],
  ["W A S D", "pan"],
  ["C", "next detail, zoomed in"],
  ["I J K L", "move the pixel whose values are shown"],
  ["O", "outlines of the details"],
];

class Viewer {
  constructor(section) {
    this.section = section;
    const data = section.dataset;
    this.size = [Number(data.width), Number(data.height)];
    this.origin = [Number(data.left), Number(data.top)];
    this.thresholds = data.screen.split(" ").map(Number);
    this.details = [...section.querySelectorAll("script.detail")].map((script) => ({
      x: Number(script.dataset.x),
      y: Number(script.dataset.y),
      width: Number(script.dataset.width),
      height: Number(script.dataset.height),
      colour: script.dataset.colour,
      name: script.dataset.name,
    }));
    this.pictures = [...section.querySelectorAll("script.picture")].map((script) => ({
      ...script.dataset,
      errors: script.dataset.details.split("|"),
      scale: Number(script.dataset.scale),
      script,
    }));
    Object.assign(this, { set: "samples", layout: "one", map: "picture", stops: 0, split: 0.5, outlines: true });
    Object.assign(this, { zoom: 0, centre: [this.size[0] / 2, this.size[1] / 2], pixel: null, detail: -1, held: false });
    this.other = 0;
    this.chosen = Math.min(1, this.shown().length - 1);
    this.build();
    this.load();
  }

  /** Pictures of the comparison that is shown, the reference first. */
  shown() {
    return this.pictures.filter((picture) => picture[this.set] !== "");
  }

  /** What the main pane shows: the chosen picture, or the reference while Shift is held. */
  main() {
    const shown = this.shown();
    return this.held ? shown[0] : shown[Math.min(this.chosen, shown.length - 1)];
  }

  compared() {
    const shown = this.shown();
    return shown[Math.min(this.other, shown.length - 1)];
  }

  /** Unpacks all pictures, the first ones first, and shows what is there. */
  async load() {
    const [width, height] = this.size;
    if (!window.DecompressionStream) {
      this.values.textContent = "This browser is too old to unpack the pictures; the strips below show them.";
      return;
    }
    for (const picture of this.pictures) {
      const [pixels, flips] = picture.script.textContent.trim().split(" ");
      picture.pixels = await halves(pixels, width, height);
      if (flips) picture.flips = await shares(flips, width, height);
      picture.script.textContent = "";
      this.draw();
    }
    this.section.dataset.ready = "yes";
  }

  // What there is to press and to see.

  build() {
    const group = (label, ...children) => element("div", { class: "group", role: "group", "aria-label": label }, ...children);
    const choice = (name, options) =>
      options.map(([value, text]) =>
        element("button", { type: "button", "data-choice": name, "data-value": value, onclick: () => this.put({ [name]: value }) }, text));
    this.names = group("Pictures");
    this.select = element("select", { onchange: () => this.put({ other: this.select.selectedIndex }) });
    this.exposure = element("input", {
      type: "range", min: -8, max: 8, step: 0.5, value: 0, oninput: () => this.put({ stops: Number(this.exposure.value) }),
    });
    this.divider = element("input", {
      type: "range", min: 0, max: 100, step: 1, value: 50, oninput: () => this.put({ split: Number(this.divider.value) / 100 }),
    });
    this.stopsText = element("output");
    this.factor = element("output");
    const zoom = (text, label, act) => element("button", { type: "button", "aria-label": label, onclick: act }, text);
    this.panes = [this.pane(), this.pane()];
    this.stage = element("div", {
      class: "stage", tabindex: 0, role: "application", "aria-label": `Pictures of ${this.section.dataset.scene}: arrows step, Shift shows the reference, more keys below`,
    }, ...this.panes.map((pane) => pane.figure));
    this.values = element("p", { class: "values" });
    this.live = element("p", { class: "hidden", "aria-live": "polite" });
    this.crops = element("div", { class: "crops" });
    const hasTime = this.pictures.some((picture) => picture.time !== "" && picture.label !== "reference");
    const keys = element("table", {}, element("tbody", {}, ...KEYS.map(([key, what]) =>
      element("tr", {}, element("th", { scope: "row" }, element("kbd", {}, key)), element("td", {}, what)))));
    this.section.append(
      element("p", { class: "viewer-title" }, element("strong", {}, `Flip through the pictures of ${this.section.dataset.scene}`)),
      ...(this.section.dataset.note ? [element("p", { class: "note" }, this.section.dataset.note)] : []),
      element("div", { class: "controls" },
        this.names,
        ...(hasTime ? [group("Comparison", ...choice("set", SETS))] : []),
        group("Layout", ...choice("layout", LAYOUTS)),
        group("What is shown of a picture", ...choice("map", MAPS)),
        element("label", {}, "Compare with ", this.select),
        element("label", {}, "Exposure ", this.exposure, " ", this.stopsText),
        group("Zoom",
          zoom("−", "Zoom out", () => this.zoomBy(-1)), zoom("+", "Zoom in", () => this.zoomBy(1)),
          zoom("Fit", "Zoom to fit", () => this.fit()), this.factor),
        element("label", {}, "Slider ", this.divider)),
      this.stage, this.values, this.live, this.crops,
      element("p", { class: "aside" }, `Errors are root mean squares against the reference in ${this.section.dataset.unit}, freed of its noise, with intervals of 95 % ` +
        "by the picture's own tiles of 4 × 4 pixels. Where every pixel sees the same points its errors are not independent, and no interval can be had from one picture."),
      element("details", { class: "keys" }, element("summary", {}, "Keys"),
        element("p", {}, "They work while the viewer is in sight. The wheel zooms once the picture was clicked; dragging pans."), keys));
    this.listen();
    this.rename();
    this.draw();
  }

  pane() {
    const canvas = element("canvas", { role: "img" });
    const label = element("figcaption", { class: "label" });
    const scale = element("div", { class: "scale", hidden: true });
    const box = element("div", { class: "box" }, canvas, label, scale);
    return { canvas, label, scale, figure: element("figure", { class: "pane" }, box), of: null, buffer: null };
  }

  /** Names of the pictures of the comparison, on buttons and in the list of what to compare with. */
  rename() {
    const shown = this.shown();
    const number = (i) => (i === 0 ? "" : i <= 9 ? String(i) : i === 10 ? "0" : "");
    this.names.replaceChildren(...shown.map((picture, i) =>
      element("button", { type: "button", "data-index": i, onclick: () => this.put({ chosen: i }) },
        ...(number(i) ? [element("kbd", { "aria-hidden": "true" }, number(i))] : []), picture.label)));
    this.select.replaceChildren(...shown.map((picture) => element("option", {}, picture.label)));
    this.select.selectedIndex = this.other;
  }

  /** Changes what is shown. */
  put(change) {
    const label = change.set && change.set !== this.set ? this.main().label : null;
    Object.assign(this, change);
    if (label !== null) {
      // The same sampler in the other comparison.
      this.chosen = Math.max(0, this.shown().findIndex((picture) => picture.label === label));
      this.other = 0;
      this.rename();
    }
    this.draw();
  }

  step(by) {
    const count = this.shown().length;
    this.put({ chosen: (this.chosen + by + count) % count });
  }

  // Zoom and place, the same for all panes.

  /** Screen pixels a picture's pixel takes when all of it is seen: a whole number where there is room. */
  fitting() {
    const density = window.devicePixelRatio || 1;
    const across = this.layout === "beside" && this.stage.clientWidth >= 700 ? 2 : 1;
    const room = [(this.stage.clientWidth - 8 * (across - 1)) / across, window.innerHeight * 0.8];
    const factor = Math.min((room[0] * density) / this.size[0], (room[1] * density) / this.size[1]);
    return factor >= 1 ? Math.floor(factor) : Math.max(factor, 1 / 64);
  }

  factorNow() {
    return Math.max(this.fitting(), this.zoom);
  }

  /** Zooms by steps; `at`, in pixels of the picture, stays where it is. */
  zoomBy(steps, at = this.pixel && this.zoom ? [this.pixel[0] + 0.5, this.pixel[1] + 0.5] : this.centre) {
    const before = this.factorNow();
    const next = steps > 0 ? Math.floor(before) + Math.max(1, Math.floor(before / 4)) : Math.ceil(before - Math.max(1, before / 5));
    const zoom = Math.min(64, Math.max(this.fitting(), next));
    const centre = this.centre.map((c, i) => at[i] + ((c - at[i]) * before) / zoom);
    this.put({ zoom: zoom <= this.fitting() ? 0 : zoom, centre });
  }

  fit() {
    this.put({ zoom: 0, centre: [this.size[0] / 2, this.size[1] / 2], detail: -1 });
  }

  pan(right, down) {
    const step = 48 / this.factorNow();
    this.put({ centre: [this.centre[0] + right * step, this.centre[1] + down * step] });
  }

  /** The detail of this number, and what is around it. */
  look(index) {
    const detail = this.details[index];
    if (!detail) return;
    const [width, height] = this.size;
    const zoom = Math.floor(this.fitting() * Math.min(width / (1.4 * detail.width), height / (1.4 * detail.height)));
    this.put({ detail: index, zoom, centre: [detail.x + detail.width / 2, detail.y + detail.height / 2] });
  }

  /** Keeps the picture's ends at the pane's. */
  clamp(view) {
    this.centre = this.centre.map((c, i) => {
      const half = view[i] / 2;
      return this.size[i] <= view[i] ? this.size[i] / 2 : Math.min(this.size[i] - half, Math.max(half, c));
    });
  }

  // Drawing.

  draw() {
    const shown = this.shown();
    const [main, other] = [this.main(), this.compared()];
    const beside = this.layout === "beside";
    this.panes[1].figure.hidden = !beside;
    this.stage.classList.toggle("two", beside && this.stage.clientWidth >= 700);
    this.divider.disabled = this.layout !== "slider";
    this.divider.value = Math.round(this.split * 100);
    this.exposure.value = this.stops;
    const signed = this.stops === 0 ? "0" : `${this.stops < 0 ? "−" : "+"}${Math.abs(this.stops)}`;
    this.stopsText.textContent = `${signed} stops`;
    this.select.selectedIndex = this.other;
    for (const button of this.names.children) {
      button.setAttribute("aria-pressed", shown[Number(button.dataset.index)] === main);
    }
    for (const button of this.section.querySelectorAll("[data-choice]")) {
      button.setAttribute("aria-pressed", this[button.dataset.choice] === button.dataset.value);
    }
    if (!main.pixels) return;
    this.drawPane(this.panes[0], main, this.layout === "slider" ? other : null, false);
    if (beside) this.drawPane(this.panes[1], other, null, true);
    this.factor.textContent = `${Number(this.factorNow().toFixed(2))} ×`;
    this.drawValues();
    this.drawCrops(main);
    const said = this.panes.slice(0, beside ? 2 : 1).map((pane) => pane.label.innerText).join("; ");
    if (this.live.textContent !== said) this.live.textContent = said;
  }

  /** What a pane shows of a picture: another one's place shows a difference as that picture, and the reference has no FLIP map. */
  sort(picture, isOther) {
    if (this.map === "difference") return isOther ? "picture" : "difference";
    return this.map === "flip" && !picture.flips ? "picture" : this.map;
  }

  drawPane(pane, picture, right, isOther) {
    const density = window.devicePixelRatio || 1;
    const [width, height] = this.size;
    const fitting = this.fitting();
    const factor = this.factorNow();
    const room = [Math.round(width * fitting), Math.round(height * fitting)];
    const { canvas } = pane;
    if (canvas.width !== room[0] || canvas.height !== room[1]) [canvas.width, canvas.height] = room;
    canvas.style.width = `${room[0] / density}px`;
    canvas.style.height = `${room[1] / density}px`;
    pane.figure.style.width = canvas.style.width;
    this.clamp([room[0] / factor, room[1] / factor]);
    const left = [0, 1].map((i) => Math.round(room[i] / 2 - this.centre[i] * factor));
    pane.left = left;
    const context = canvas.getContext("2d");
    context.fillStyle = "#000";
    context.fillRect(0, 0, ...room);
    context.imageSmoothingEnabled = factor < 1;
    const image = (of, other) => context.drawImage(this.raster(of, this.sort(of, other)), ...left, width * factor, height * factor);
    image(picture, isOther);
    let label = this.words(picture, this.sort(picture, isOther));
    if (right?.pixels) {
      const at = Math.round(room[0] * this.split);
      context.save();
      context.beginPath();
      context.rect(at, 0, room[0] - at, room[1]);
      context.clip();
      image(right, true);
      context.restore();
      context.fillStyle = "#fff";
      context.fillRect(at - 1, 0, 2, room[1]);
      label = `left: ${label}\nright: ${this.words(right, this.sort(right, true))}`;
    }
    this.drawMarks(context, left, factor, density);
    pane.label.textContent = label;
    canvas.setAttribute("aria-label", label);
    this.drawScale(pane, this.sort(picture, isOther));
  }

  /** Outlines of details and of the pixel whose values are shown: outside their pixels. */
  drawMarks(context, left, factor, density) {
    const outline = (x, y, width, height, colour, line) => {
      context.strokeStyle = colour;
      context.lineWidth = line;
      context.strokeRect(left[0] + x * factor - line / 2, left[1] + y * factor - line / 2, width * factor + line, height * factor + line);
    };
    if (this.outlines) this.details.forEach((d) => outline(d.x, d.y, d.width, d.height, d.colour, 1.5 * density));
    if (this.pixel) {
      outline(...this.pixel, 1, 1, "#000", 3);
      outline(...this.pixel, 1, 1, "#fff", 1);
    }
  }

  /** Who is shown, and how far from the reference it is. */
  words(picture, sort) {
    const parts = [picture.label, picture[this.set]];
    if (picture.error) parts.push(`RMSE ${picture.error}${picture.same ? " (no interval)" : ""} ${this.section.dataset.unit}`);
    if (sort === "difference") parts[0] = `${picture.label} − ${this.compared().label}`;
    if (sort === "flip") {
      parts[0] = `FLIP map of ${picture.label}`;
      parts.push(`FLIP ${picture.flip}, mean, at exposure ${this.section.dataset.exposure}`);
    }
    return parts.filter((part) => part).join(" · ");
  }

  /** What maps show in full colour: luminance of a difference, or FLIP. Exposure changes it as it does the picture's white. */
  fullColour(sort) {
    return sort === "flip" ? Math.min(1, 2 ** -this.stops) : Number(this.section.dataset.difference) * 2 ** -this.stops;
  }

  drawScale(pane, sort) {
    pane.scale.hidden = sort === "picture";
    if (sort === "picture" || pane.scaled === `${sort} ${this.stops}`) return;
    pane.scaled = `${sort} ${this.stops}`;
    const bar = element("canvas", { width: 96, height: 8, "aria-hidden": "true" });
    const context = bar.getContext("2d");
    for (let x = 0; x < 96; x++) {
      const colour = sort === "flip" ? magma(x / 95) : diverging((2 * x) / 95 - 1);
      context.fillStyle = `rgb(${colour.map(Math.round).join(" ")})`;
      context.fillRect(x, 0, 1, 8);
    }
    const full = radiance(this.fullColour(sort));
    const ends = sort === "flip" ? ["0", full] : [`−${full}`, `+${full} luminance`];
    pane.scale.replaceChildren(ends[0], bar, ends[1]);
  }

  /** A picture, its difference from the compared one, or its FLIP map as a raster of its own size. */
  raster(picture, sort) {
    const key = `${sort} ${this.stops} ${sort === "difference" ? this.compared().label : ""} ${this.set}`;
    if (picture.key === key) return picture.raster;
    const [width, height] = this.size;
    const canvas = picture.raster ?? element("canvas", { width, height });
    const context = canvas.getContext("2d");
    const data = context.createImageData(width, height);
    this.fill(data.data, picture, sort);
    context.putImageData(data, 0, 0);
    Object.assign(picture, { key, raster: canvas });
    return canvas;
  }

  fill(bytes, picture, sort) {
    const count = this.size[0] * this.size[1];
    const [red, green, blue] = picture.pixels;
    if (sort === "picture") {
      const table = codes(this.thresholds, picture.scale * Number(this.section.dataset.exposure) * 2 ** this.stops);
      for (let i = 0; i < count; i++) {
        bytes[4 * i] = table[red[i]];
        bytes[4 * i + 1] = table[green[i]];
        bytes[4 * i + 2] = table[blue[i]];
        bytes[4 * i + 3] = 255;
      }
      return;
    }
    const other = this.compared();
    const full = this.fullColour(sort);
    const light = (of, i) => (of.pixels ? of.scale * luminance(...of.pixels.map((channel) => HALF[channel[i]])) : 0);
    const flips = Array.from({ length: 256 }, (_, code) => magma(code / 255 / full));
    for (let i = 0; i < count; i++) {
      const colour = sort === "flip" ? flips[picture.flips[i]] : diverging((light(picture, i) - light(other, i)) / full);
      bytes[4 * i] = colour[0];
      bytes[4 * i + 1] = colour[1];
      bytes[4 * i + 2] = colour[2];
      bytes[4 * i + 3] = 255;
    }
  }

  /** The radiance of a picture at a pixel. */
  at(picture, [x, y]) {
    return picture.pixels.map((channel) => HALF[channel[y * this.size[0] + x]] * picture.scale);
  }

  drawValues() {
    const [main, other] = [this.main(), this.compared()];
    if (!this.pixel || !other.pixels) {
      this.values.textContent = "Point at a pixel, or press I, J, K or L, to read its values.";
      return;
    }
    const place = this.pixel.map((c, i) => c + this.origin[i]);
    const [a, b] = [this.at(main, this.pixel), this.at(other, this.pixel)];
    const row = (name, values) =>
      element("tr", {}, element("th", { scope: "row" }, name), ...values.map((v) => element("td", {}, radiance(v))));
    const flip = main.flips ? ` · FLIP ${(main.flips[this.pixel[1] * this.size[0] + this.pixel[0]] / 255).toFixed(3)}` : "";
    this.values.replaceChildren(
      element("span", { class: "place" }, `Pixel (${place.join(", ")}) · R, G, B in ${this.section.dataset.unit}${flip}`),
      element("table", {}, element("tbody", {},
        row(main.label, a), ...(other === main ? [] : [row(other.label, b), row("difference", a.map((v, i) => v - b[i]))]))));
  }

  /** Details of the picture beside those of the compared one, each with its error. */
  drawCrops(main) {
    const other = this.compared();
    if (this.crops.children.length !== this.details.length) {
      this.crops.replaceChildren(...this.details.map((detail, i) => {
        const canvas = () => element("canvas", { width: 4 * detail.width, height: 4 * detail.height, role: "img" });
        const button = element("button", { type: "button", onclick: () => this.look(i) }, canvas(), canvas());
        button.style.borderColor = detail.colour;
        return element("figure", {}, button, element("figcaption"));
      }));
    }
    [...this.crops.children].forEach((figure, i) => {
      const detail = this.details[i];
      const said = (p) => (p.errors[i] ? `${p.label}: RMSE ${p.errors[i]}${p.same ? " (no interval)" : ""}` : p.label);
      const pair = other === main ? [main] : [main, other];
      [...figure.querySelectorAll("canvas")].forEach((canvas, k) => {
        canvas.hidden = k >= pair.length;
        if (canvas.hidden || !pair[k].pixels) return;
        const context = canvas.getContext("2d");
        context.imageSmoothingEnabled = false;
        context.drawImage(this.raster(pair[k], this.sort(pair[k], k === 1)),
          detail.x, detail.y, detail.width, detail.height, 0, 0, canvas.width, canvas.height);
        canvas.setAttribute("aria-label", `${detail.name}: ${pair[k].label}`);
      });
      figure.querySelector("button").setAttribute("aria-label", `Zoom to ${detail.name}`);
      figure.querySelector("figcaption").textContent = [detail.name, ...pair.map(said)].join("\n");
    });
  }

  // Mouse and keys.

  listen() {
    const position = (pane, event) => {
      const density = window.devicePixelRatio || 1;
      const box = pane.canvas.getBoundingClientRect();
      return [event.clientX - box.x, event.clientY - box.y].map((c) => c * density);
    };
    const inside = (pane, event) => {
      const factor = this.factorNow();
      return position(pane, event).map((c, i) => (c - pane.left[i]) / factor);
    };
    for (const pane of this.panes) {
      let from = null;
      pane.canvas.addEventListener("pointerdown", (event) => {
        if (event.button !== 0 || !pane.left) return;
        from = { at: position(pane, event), centre: this.centre };
        from.divides = this.layout === "slider" && Math.abs(from.at[0] - this.split * pane.canvas.width) < 16;
        pane.canvas.setPointerCapture(event.pointerId);
      });
      pane.canvas.addEventListener("pointermove", (event) => {
        if (!pane.left) return;
        const now = position(pane, event);
        if (from?.divides) return this.put({ split: Math.min(1, Math.max(0, now[0] / pane.canvas.width)) });
        if (from && this.zoom) return this.put({ centre: from.centre.map((c, i) => c - (now[i] - from.at[i]) / this.factorNow()) });
        const pixel = inside(pane, event).map(Math.floor);
        if (pixel.every((c, i) => c >= 0 && c < this.size[i])) this.put({ pixel });
      });
      const release = () => (from = null);
      pane.canvas.addEventListener("pointerup", release);
      pane.canvas.addEventListener("pointercancel", release);
      pane.canvas.addEventListener("wheel", (event) => {
        if (document.activeElement !== this.stage || !pane.left) return;
        event.preventDefault();
        this.zoomBy(event.deltaY < 0 ? 1 : -1, inside(pane, event));
      }, { passive: false });
    }
    new ResizeObserver(() => this.draw()).observe(this.section);
  }

  /** Does what a key asks for; whether it asked for anything. */
  press(event) {
    const key = event.key.toLowerCase();
    const digit = /^(?:Digit|Numpad)([0-9])$/.exec(event.code)?.[1];
    const next = (options, value) => options[(options.findIndex(([name]) => name === value) + 1) % options.length][0];
    const move = (right, down) => {
      const start = this.pixel ?? this.centre.map(Math.floor);
      const pixel = this.pixel ? [start[0] + right, start[1] + down] : start;
      this.put({ pixel: pixel.map((c, i) => Math.min(this.size[i] - 1, Math.max(0, c))) });
    };
    const acts = {
      arrowleft: () => this.step(-1),
      arrowright: () => this.step(1),
      v: () => this.put({ layout: next(LAYOUTS, this.layout) }),
      ",": () => this.put({ split: Math.max(0, this.split - 0.02) }),
      ".": () => this.put({ split: Math.min(1, this.split + 0.02) }),
      p: () => this.put({ map: "picture" }),
      x: () => this.put({ map: "difference" }),
      f: () => this.put({ map: "flip" }),
      g: () => this.put({ other: this.chosen }),
      t: () => this.section.querySelector("[data-choice=set]") && this.put({ set: next(SETS, this.set) }),
      q: () => this.put({ stops: Math.max(-8, this.stops - 0.5) }),
      e: () => this.put({ stops: Math.min(8, this.stops + 0.5) }),
      "+": () => this.zoomBy(1),
      "=": () => this.zoomBy(1),
      "-": () => this.zoomBy(-1),
      z: () => this.fit(),
      w: () => this.pan(0, -1),
      a: () => this.pan(-1, 0),
      s: () => this.pan(0, 1),
      d: () => this.pan(1, 0),
      c: () => this.details.length && this.look((this.detail + 1) % this.details.length),
      i: () => move(0, -1),
      j: () => move(-1, 0),
      k: () => move(0, 1),
      l: () => move(1, 0),
      o: () => this.put({ outlines: !this.outlines }),
    };
    if (digit !== undefined) {
      const index = digit === "0" ? 10 : Number(digit);
      if (index < this.shown().length) this.put({ chosen: index });
      return true;
    }
    if (!Object.hasOwn(acts, key)) return false;
    acts[key]();
    return true;
  }

  hold(held) {
    if (this.held !== held) this.put({ held });
  }
}
