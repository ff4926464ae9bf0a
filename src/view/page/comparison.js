// Two samplers: the second one, what both may take, and how they are shown. All of it is the document's `view`.

import { make, show } from "./controls.js";

export class Comparison {
  /** `arrange` is told at once when pictures are to be shown in another way. */
  constructor(link, { presets, legal }, arrange) {
    const row = (text, input) => make("div", { className: "row" }, make("label", { htmlFor: input.id, textContent: text }), input);
    const choices = (id, list) => make("select", { id }, ...list.map(([value, textContent]) => make("option", { value, textContent })));
    this.on = make("input", { type: "checkbox", id: "compare-on" });
    this.other = make("input", { type: "text", id: "compare-other", value: "uniform" });
    this.other.setAttribute("list", "compare-list");
    const list = make("datalist", { id: "compare-list" });
    for (const text of [...Object.keys(presets), ...legal]) list.append(make("option", { value: text }));
    this.by = choices("compare-by", [["samples", "the same samples a pixel"], ["seconds", "the same seconds of rendering"]]);
    this.seconds = make("input", { type: "number", id: "compare-seconds", min: 0.1, max: 3600, step: "any", value: 3 });
    this.how = choices("compare-how", [["side", "side by side"], ["flip", "flipped with the key X"]]);
    this.on.onchange = () => link.set({ "view.second": this.on.checked ? this.other.value : null });
    // What is typed while there is no second picture waits for one.
    this.other.onchange = () => this.on.checked && link.set({ "view.second": this.other.value });
    this.by.onchange = this.seconds.onchange = () => link.set({ "view.seconds": this.by.value === "seconds" ? Number(this.seconds.value) : null });
    this.how.onchange = () => {
      link.set({ "view.show": this.how.value });
      arrange();
    };
    document.querySelector("#compare-panel").append(
      row("Second sampler (B)", this.on), row("Sampler of B", this.other), list, row("Budget", this.by), row("Seconds each", this.seconds), row("Show", this.how),
      make("p", { className: "hint", textContent: "B has the scene's seed. One sampler for all decisions, or pixel=… lens=… light-pick=… light=…. In a budget of seconds the count is chosen by what a few samples take, since a set belongs to its count." }));
  }

  /** Whether of two pictures one is shown at a time. */
  get flips() {
    return this.how.value === "flip";
  }

  update({ config: { view } }) {
    this.on.checked = view.second !== null;
    if (view.second !== null) show(this.other, view.second);
    this.by.value = view.seconds === null ? "samples" : "seconds";
    this.seconds.disabled = view.seconds === null;
    if (view.seconds !== null) show(this.seconds, view.seconds);
    this.how.value = view.show;
  }
}
