// Controls of the top bar: each shows a key of the document and, when changed, sets it. The program checks what is set.

let ids = 0;

/** An element with properties and children. */
export function make(tag, properties = {}, ...children) {
  const element = document.createElement(tag);
  Object.assign(element, properties);
  element.append(...children);
  return element;
}

/** A row of a label and its control. */
function row(text, control, of = control) {
  of.id ||= `control-${++ids}`;
  return make("div", { className: "row" }, make("label", { htmlFor: of.id, textContent: text }), control);
}

/** Shows a value unless somebody is typing another. */
export function show(input, value) {
  if (document.activeElement === input && input.type !== "range" && input.type !== "checkbox") return;
  if (input.type === "checkbox") input.checked = value;
  else if (input.value !== String(value)) input.value = value;
}

const at = (config, key) => key.split(".").reduce((value, part) => value?.[part], config);

/** Linear in 0…1 to an sRGB code, and back: for colour pickers only. */
const encode = (c) => Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055));
const decode = (code) => (code / 255 <= 0.04045 ? code / 255 / 12.92 : ((code / 255 + 0.055) / 1.055) ** 2.4);
const toHex = (rgb) => `#${rgb.map((c) => encode(Math.min(1, Math.max(0, c))).toString(16).padStart(2, "0")).join("")}`;
const fromHex = (hex) => [1, 3, 5].map((i) => Number(decode(parseInt(hex.slice(i, i + 2), 16)).toPrecision(4)));

export class Controls {
  constructor(link) {
    this.link = link;
    this.updates = [];
    this.camera(document.querySelector("#camera-panel"));
    this.framebuffer(document.querySelector("#framebuffer-panel"));
    this.estimator(document.querySelector("#estimator-panel"));
  }

  /** Shows a state of the document. */
  update(state) {
    this.state = { ...this.state, ...state };
    this.told = structuredClone(state.config.scene.materials);
    for (const update of this.updates) update(state);
    this.second.forEach((button) => (button.hidden = state.config.view.second === null));
    if (state.materials) {
      this.materials(document.querySelector("#materials-panel"));
      this.lights(document.querySelector("#lights-panel"));
    }
  }

  number(text, key, properties = {}) {
    const input = make("input", { type: "number", step: "any", ...properties });
    input.onchange = () => input.value !== "" && this.link.set({ [key]: Number(input.value) });
    this.updates.push((state) => show(input, at(state.config, key)));
    return row(text, input);
  }

  /** A number with a slider beside it; `toSlider` and back where the slider is not linear. */
  slider(text, key, range, toSlider = (x) => x, toValue = (x) => x) {
    const input = make("input", { type: "number", step: "any" });
    const slide = make("input", { type: "range", ...range, ariaLabel: `${text}, slider` });
    const set = (value, moving) => this.link.set({ [key]: value }, moving);
    input.onchange = () => input.value !== "" && set(Number(input.value), false);
    slide.oninput = () => set(Number(toValue(Number(slide.value)).toPrecision(4)), true);
    slide.onchange = () => set(Number(toValue(Number(slide.value)).toPrecision(4)), false);
    this.updates.push((state) => {
      const value = at(state.config, key);
      show(input, value);
      if (document.activeElement !== slide) slide.value = toSlider(value);
    });
    return row(text, make("div", { className: "pair" }, slide, input), input);
  }

  vector(text, key) {
    const inputs = ["x", "y", "z"].map((axis) => make("input", { type: "number", step: "any", ariaLabel: `${text} ${axis}` }));
    // One by one: what is shown of the others is rounded.
    inputs.forEach((input, i) => (input.onchange = () => input.value !== "" && this.link.set({ [`${key}.${i}`]: Number(input.value) })));
    this.updates.push((state) => inputs.forEach((input, i) => show(input, Number(at(state.config, key)[i].toPrecision(5)))));
    return row(text, make("div", { className: "three" }, ...inputs), inputs[0]);
  }

  check(text, key) {
    const input = make("input", { type: "checkbox" });
    input.onchange = () => this.link.set({ [key]: input.checked });
    this.updates.push((state) => show(input, at(state.config, key)));
    return row(text, input);
  }

  choice(text, key, choices) {
    const input = make("select");
    for (const [value, name] of choices) input.append(make("option", { value, textContent: name }));
    input.onchange = () => this.link.set({ [key]: input.value });
    this.updates.push((state) => show(input, at(state.config, key)));
    return row(text, input);
  }

  camera(panel) {
    const speed = make("output", { id: "speed" });
    const focus = this.number("Focal depth", "camera.focal_depth", { min: 0 });
    const found = make("p", { className: "hint" });
    this.updates.push((state) => {
      focus.querySelector("input").disabled = state.config.auto_focus;
      const lens = state.focal_depth != null;
      found.textContent = lens
        ? `In focus: ${Number(state.focal_depth.toPrecision(5))}${state.config.auto_focus ? ", found by auto focus" : ""}.`
        : "A pinhole: everything is sharp.";
    });
    panel.append(
      this.vector("Position", "camera.pos"),
      this.vector("Direction", "camera.dir"),
      this.vector("Up", "camera.up"),
      this.slider("Field of view, °", "camera.fov", { min: 5, max: 150, step: 0.5 }),
      this.slider("Lens radius", "camera.lens_radius", { min: 0, max: 1, step: 0.002 }, Math.sqrt, (x) => x * x),
      this.check("Auto focus", "auto_focus"),
      focus,
      found,
      make("p", { className: "hint" }, "Speed: ", speed, " units a second (wheel)."),
    );
  }

  framebuffer(panel) {
    const { link } = this;
    const sizes = make("select", { ariaLabel: "Usual sizes" }, make("option", { value: "", textContent: "usual sizes" }));
    for (const size of ["320×180", "640×360", "960×540", "1280×720", "1920×1080"]) sizes.append(make("option", { textContent: size }));
    sizes.onchange = () => {
      const [w, h] = sizes.value.split("×").map(Number);
      if (w) link.set({ "framebuffer.res_w": w, "framebuffer.res_h": h });
      sizes.value = "";
    };
    const save = (what, panel, text) => make("button", { type: "button", textContent: text, onclick: () => link.ask("download", { what, panel }) });
    this.second = [save("png", 1, "PNG of B"), save("exr", 1, "EXR of B")];
    panel.append(
      this.number("Width", "framebuffer.res_w", { min: 1, step: 1 }),
      this.number("Height", "framebuffer.res_h", { min: 1, step: 1 }),
      make("p", { className: "buttons" }, sizes),
      this.number("Samples a pixel", "framebuffer.sppx", { min: 1, step: 1 }),
      this.slider("Exposure", "framebuffer.exposure", { min: -4, max: 8, step: 0.05 }, (x) => Math.log2(Math.max(x, 0.0625)), (x) => 2 ** x),
      make("p", { className: "buttons" }, save("png", 0, "Save PNG"), save("exr", 0, "Save EXR"), ...this.second),
    );
  }

  estimator(panel) {
    panel.append(
      this.choice("Estimator", "estimator", [["unbiased", "unbiased"], ["sheet", "sheet: not divided by the choice's probability"]]),
      this.choice("Shading", "shading", [["direct", "direct light"], ["albedo", "albedo, no lights"]]),
      make("p", { className: "hint", textContent: "The two estimators differ from two lights on. The reference is always unbiased." }),
    );
  }

  /** Shows the document again after a change that was refused. */
  revert() {
    this.state.config.scene.materials = this.told;
    this.update(this.state);
  }

  /** Changes the patch of a material: keys that are null go. */
  patch(name, values, moving = false) {
    const patches = structuredClone(this.state.config.scene.materials);
    let patch = patches.find((p) => p.name === name);
    if (!patch) patches.push((patch = { name }));
    for (const [key, value] of Object.entries(values)) {
      if (value === null) delete patch[key];
      else patch[key] = value;
    }
    // What is asked for next builds on this, also before the program has answered.
    this.state.config.scene.materials = patches;
    this.link.set({ "scene.materials": patches }, moving);
  }

  colour(text, material) {
    const numbers = ["red", "green", "blue"].map((c, i) =>
      make("input", { type: "number", step: "any", min: 0, ariaLabel: `${text} ${c}`, value: material.albedo[i] }));
    numbers.forEach((input) => (input.onchange = () => this.patch(material.name, { albedo_col: numbers.map((n) => Number(n.value)) })));
    const picker = make("input", { type: "color", value: toHex(material.albedo), ariaLabel: `${text}, picker` });
    picker.oninput = () => this.patch(material.name, { albedo_col: fromHex(picker.value) }, true);
    picker.onchange = () => this.patch(material.name, { albedo_col: fromHex(picker.value) });
    return make("div", {}, row(text, make("div", { className: "three" }, ...numbers), numbers[0]), row(`${text}, as sRGB`, picker));
  }

  strength(text, material) {
    const input = make("input", { type: "number", step: "any", min: 0, value: material.strength });
    input.onchange = () => input.value !== "" && this.patch(material.name, { emissive_strength: Number(input.value) });
    return row(text, input);
  }

  /** Builds a panel anew, the focus where it was, unless somebody is in the midst of typing a number or choosing a colour there. */
  rebuild(panel, nodes) {
    const controls = (parts) => parts.flatMap((part) => [...part.querySelectorAll("input, button")]);
    const at = controls([panel]).indexOf(document.activeElement);
    const [active, anew] = [document.activeElement, controls(nodes)[at]];
    if (at >= 0 && anew?.type === active.type && (active.type === "color" || (active.type === "number" && active.value !== anew.value))) return;
    panel.replaceChildren(...nodes);
    if (at >= 0) anew?.focus({ preventScroll: true });
  }

  materials(panel) {
    const parts = this.state.materials.map((material) => {
      const original = () => this.patch(material.name, { albedo_col: null, emissive_strength: null });
      const node = make("fieldset", {}, make("legend", { textContent: material.name || "(default grey)" }),
        this.colour("Albedo", material), this.strength("Emission", material),
        make("p", { className: "buttons" }, make("button", { type: "button", textContent: "As in the MTL file", onclick: original })));
      if (material.textured) node.append(make("p", { className: "hint", textContent: "A texture multiplies the albedo." }));
      return node;
    });
    this.rebuild(panel, parts);
    if (parts.length === 0) panel.replaceChildren(make("p", { textContent: "The scene has no named material." }));
  }

  lights(panel) {
    this.lit ??= new Map();
    const patched = (name) => this.state.config.scene.materials.find((p) => p.name === name)?.emissive_strength !== undefined;
    const emitters = this.state.materials.filter((m) => m.emits || m.own_strength > 0 || patched(m.name));
    const parts = emitters.map((material) => {
      if (material.emits) this.lit.set(material.name, material.strength);
      const off = make("input", { type: "checkbox", checked: !material.emits, ariaLabel: `Off: ${material.name}` });
      const before = this.lit.get(material.name) ?? (material.own_strength || 10);
      off.onchange = () => this.patch(material.name, { emissive_strength: off.checked ? 0 : before });
      const light = this.state.lights.find((l) => l.name === material.name);
      const about = light ? `Area ${Number(light.area.toPrecision(4))}, power ${Number(light.power.toPrecision(4))} (area × luma of the radiance).` : "Off.";
      return make("fieldset", {}, make("legend", { textContent: material.name }),
        this.colour("Colour", material), this.strength("Power (strength)", material), row("Off", off),
        make("p", { className: "hint", textContent: about }));
    });
    this.rebuild(panel, parts);
    if (parts.length === 0) panel.replaceChildren(make("p", { textContent: "The scene has no light. Give a material an emission under Materials." }));
  }
}
