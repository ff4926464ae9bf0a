// The sampler of each decision and its knobs. Which combinations mean something is the program's list.

import { make, show } from "./controls.js";

const KNOBS = ["points", "order", "random", "scope"];

/** `halton:joint:digits@each` in its parts; a preset that is no combination, such as `ld:sheet`, has an order of that name. */
export function parse(text) {
  const [points, order = "", rest = ""] = text.split(":");
  const [random = "", scope = ""] = rest.split("@");
  return { points, order, random, scope };
}

export class Samplers {
  constructor(link, { presets, legal, decisions }) {
    this.link = link;
    this.presets = presets;
    this.legal = legal.map((text) => ({ text, ...parse(text) }));
    this.decisions = decisions;
    this.rows = new Map();
    this.build(document.querySelector("#sampler-panel"));
  }

  build(panel) {
    const head = ["Decision", "Sampler", "Points", "Order", "Random", "Scope"];
    panel.append(make("div", { className: "knobs head", ariaHidden: "true" }, ...head.map((text) => make("span", { textContent: text }))));
    for (const { key, name } of [{ key: "all", name: "All" }, ...this.decisions]) panel.append(this.row(key, name));
    this.seed = make("input", { type: "text", inputMode: "numeric", pattern: "[0-9]+", id: "seed" });
    // As text: a seed has 64 bits, a number here 53.
    this.seed.onchange = () => /^[0-9]+$/.test(this.seed.value) && this.link.ask("set", { sets: [`seed=${this.seed.value}`] });
    const again = make("button", { type: "button", textContent: "Another seed" });
    again.onclick = () => this.link.ask("set", { sets: [`seed=${BigInt(this.state.seed) + 1n & 0xffffffffffffffffn}`] });
    panel.append(
      make("div", { className: "row" }, make("label", { htmlFor: "seed", textContent: "Seed" }), make("div", { className: "pair" }, this.seed, again)),
      (this.layout = make("p", { className: "hint" })),
    );
  }

  row(key, name) {
    const label = make("span", { textContent: name });
    const preset = make("select", { ariaLabel: `${name}: sampler` });
    preset.append(make("option", { value: "", textContent: "by its knobs" }));
    for (const [word, text] of Object.entries(this.presets)) preset.append(make("option", { value: text, textContent: word }));
    if (key === "pixel" || key === "lens") preset.append(make("option", { value: "center", textContent: "center" }));
    preset.onchange = () => preset.value && this.choose(key, preset.value);
    const knobs = KNOBS.map((knob) => {
      const select = make("select", { ariaLabel: `${name}: ${knob}` });
      select.onchange = () => this.turn(key, knob, select.value);
      return select;
    });
    this.rows.set(key, { label, preset, knobs, name });
    return make("div", { className: "knobs" }, label, preset, ...knobs);
  }

  /** The nearest legal sampler with the knob so: of those, the one that keeps most of the others. */
  turn(key, knob, value) {
    const now = parse(this.of(key));
    const fitting = this.legal.filter((spec) => spec[knob] === value);
    const kept = (spec) => KNOBS.reduce((n, k, i) => n + (spec[k] === now[k] ? 8 >> i : 0), 0);
    fitting.sort((a, b) => kept(b) - kept(a));
    if (fitting.length > 0) this.choose(key, fitting[0].text);
  }

  of(key) {
    return this.state.samplers[key === "all" ? "pixel" : key];
  }

  choose(key, text) {
    const samplers = { ...this.state.samplers };
    for (const decision of Object.keys(samplers)) if (key === "all" || key === decision) samplers[decision] = text;
    this.state.samplers = samplers;
    const set = Object.entries(samplers).map(([decision, sampler]) => `${decision}=${sampler}`).join(" ");
    this.link.set({ sampler: set });
  }

  update(state) {
    this.state = state;
    show(this.seed, state.seed);
    if (state.layout) this.layout.textContent = `Decisions of this scene: ${state.layout}.`;
    const same = new Set(Object.values(state.samplers)).size === 1;
    for (const [key, { label, preset, knobs, name }] of this.rows) {
      const text = this.of(key);
      const isMade = key === "all" || state.made.includes(key);
      label.textContent = isMade ? name : `${name} (none)`;
      label.title = isMade ? "" : "This scene makes no such decision";
      label.parentElement.classList.toggle("idle", !isMade);
      preset.value = key === "all" && !same ? "" : [...preset.options].some((o) => o.value === text) ? text : "";
      const now = parse(text);
      knobs.forEach((select, i) => this.fill(select, i, now, key === "all" && !same, key));
    }
  }

  /** A knob's values: those that some legal sampler has with the knobs before it. */
  fill(select, i, now, mixed, key) {
    const fits = (spec) => KNOBS.slice(0, i).every((k) => spec[k] === now[k]);
    const central = key === "pixel" || key === "lens";
    const values = [...new Set(this.legal.filter((spec) => fits(spec) && (central || spec.points !== "center")).map((spec) => spec[KNOBS[i]]))];
    const options = mixed ? ["", ...values] : values;
    select.replaceChildren(...options.map((value) => make("option", { value, textContent: value || "–" })));
    select.value = mixed ? "" : now[KNOBS[i]];
    select.disabled = values.length < 2 && !mixed;
  }
}
