// The page: what comes in is shown, what is done is asked for.

import { Flight } from "./camera.js";
import { pointSet, spectrum } from "./charts.js";
import { Controls, make } from "./controls.js";
import { Configs, offer, takeDrops } from "./files.js";
import { Link } from "./link.js";
import { Samplers } from "./samplers.js";
import { Screen, many, number } from "./screen.js";

const $ = (selector) => document.querySelector(selector);
const screens = [new Screen("a"), new Screen("b")];
let samplers, configs, picked, flipped = 0, panels = 1, spectral = 0;

function say(text, good = false) {
  $("#message").hidden = !text;
  $("#message").classList.toggle("good", good);
  $("#message span").textContent = text;
}
$("#message button").onclick = () => say("");

function lost() {
  if (!lost.told) say("The program has ended, or this tab was left: reload the page to go on.");
  $("#state").textContent = "not connected";
  document.body.dataset.connected = "no";
}

const link = new Link(
  {
    hello(hello) {
      samplers = new Samplers(link, hello);
      configs = new Configs(link, $("#configs-panel"), hello.can_save);
      compare.build(hello);
      for (const { key, name } of hello.decisions) $("#points-decision").append(make("option", { value: key, textContent: name }));
      document.body.dataset.connected = "yes";
    },
    state(state) {
      if (!state.moving) say("");
      $("#scene-name").textContent = state.name;
      document.title = `${state.name} · sampler-lab view`;
      controls.update(state);
      samplers.update(state);
      configs.update(state);
      flight.take(state.config.camera, state);
      $("#speed").textContent = number(flight.speed);
      if (state.notes) $("#notes").replaceChildren(...state.notes.map((text) => make("li", { textContent: text })));
      for (const option of $("#points-decision").options) option.disabled = !state.made.includes(option.value);
      Object.assign(document.body.dataset, { document: JSON.stringify(state.config), version: state.version });
    },
    frame(frame, bytes) {
      panels = frame.panels.length;
      let from = 0;
      frame.panels.forEach((panel, i) => {
        const size = 3 * panel.width * panel.height;
        screens[i].draw(panel, bytes.subarray(from, from + size));
        from += size;
      });
      arrange();
      if (document.body.dataset.frame === undefined && document.activeElement === document.body) screens[0].canvas.focus({ preventScroll: true });
      link.ask("shown", { frame: frame.frame });
      Object.assign(document.body.dataset, { frame: frame.frame, epoch: frame.epoch, shown: frame.version, samples: frame.panels[0].samples });
    },
    status: showStatus,
    probe: showProbe,
    pick({ distance, depth, material, emits, focused }) {
      const what = distance == null ? "Nothing there." : `Distance ${number(distance)}, depth ${number(depth)}: ${material}${emits ? " (emits)" : ""}.`;
      $("#picked").textContent = what + (focused ? " In focus now." : "");
    },
    points({ about, sets }) {
      const title = about.file ? `${about.file}` : `Pixel (${about.x}, ${about.y}), ${about.name}`;
      $("#points-out").replaceChildren(make("p", { textContent: title }), ...sets.map(pointSet));
      $("#points-out").scrollIntoView({ block: "nearest" });
    },
    spectrum({ panels, reference_samples, wait }) {
      if (!spectral) return;
      const out = wait ? make("p", { className: "hint", textContent: wait }) : spectrum(panels, reference_samples);
      $("#spectrum-out").replaceChildren(out);
      spectral = setTimeout(() => link.ask("spectrum"), wait ? 700 : 4000);
    },
    saved: ({ name }) => say(`Saved as ${name}.`, true),
    file: offer,
    error: ({ text }) => say(text),
    refused({ text }) {
      lost.told = true;
      say(text);
    },
  },
  lost,
);
const controls = new Controls(link);
const flight = new Flight((camera, moving) =>
  link.set({ "camera.pos": camera.pos, "camera.dir": camera.dir, "camera.up": camera.up }, moving));
takeDrops(link, say);

// Two samplers.
const compare = {
  build({ presets, legal }) {
    const panel = $("#compare-panel");
    const row = (text, input) => make("div", { className: "row" }, make("label", { htmlFor: input.id, textContent: text }), input);
    this.on = make("input", { type: "checkbox", id: "compare-on" });
    this.other = make("input", { type: "text", id: "compare-other", value: "uniform" });
    this.other.setAttribute("list", "compare-list");
    const list = make("datalist", { id: "compare-list" });
    for (const text of [...Object.keys(presets), ...legal]) list.append(make("option", { value: text }));
    this.by = make("select", { id: "compare-by" }, make("option", { value: "samples", textContent: "the same samples a pixel" }), make("option", { value: "seconds", textContent: "the same seconds of rendering" }));
    this.seconds = make("input", { type: "number", id: "compare-seconds", min: 0.1, max: 3600, step: "any", value: 3 });
    this.how = make("select", { id: "compare-how" }, make("option", { value: "side", textContent: "side by side" }), make("option", { value: "flip", textContent: "flipped with the key X" }));
    for (const input of [this.on, this.other, this.by, this.seconds]) input.onchange = () => this.send();
    this.how.onchange = arrange;
    panel.append(row("Second sampler (B)", this.on), row("Sampler of B", this.other), list, row("Budget", this.by), row("Seconds each", this.seconds), row("Show", this.how),
      make("p", { className: "hint", textContent: "B has the scene's seed. One sampler for all decisions, or pixel=… lens=… light-pick=… light=…. In a budget of seconds the count is chosen by what a few samples take, since a set belongs to its count." }));
    this.send(true);
  },
  send(first) {
    const bySeconds = this.by.value === "seconds";
    this.seconds.disabled = !bySeconds;
    controls.second(this.on.checked);
    if (!first) link.ask("compare", { other: this.on.checked ? this.other.value : null, seconds: bySeconds ? Number(this.seconds.value) : null });
  },
};

/** One panel, two beside each other, or one of two. */
function arrange() {
  const flips = panels > 1 && compare.how?.value === "flip";
  $("#stage").dataset.panels = flips ? 1 : panels;
  $("#stage").classList.toggle("flip", flips);
  screens[0].figure.hidden = flips && flipped === 1;
  screens[1].figure.hidden = panels < 2 || (flips && flipped === 0);
}

function row(name, values, title = "") {
  return make("tr", { title }, make("th", { scope: "row", textContent: name }), ...values.map((value) => make("td", { textContent: value })));
}

function showStatus(status) {
  $("#state").textContent = `– ${status.state}`;
  Object.assign(document.body.dataset, { state: status.state, stateEpoch: status.epoch, answered: status.sets, reference: status.reference });
  const done = status.panels.reduce((sum, p) => sum + p.samples, 0);
  $("#progress").max = status.panels.reduce((sum, p) => sum + p.of, 0) || 1;
  $("#progress").value = done;
  const of = (f) => status.panels.map(f);
  const errors = of(({ errors }) => errors);
  const interval = (e) => (e?.rmse?.ci95 ? `${number(Math.max(0, e.rmse.ci95[0]))} … ${number(e.rmse.ci95[1])}` : "–");
  const rows = [
    row("samples a pixel", of((p) => (p.timing ? "timing" : `${p.samples} of ${p.of}`))),
    row("seconds of rendering", of((p) => p.seconds.toFixed(2))),
    row("RMSE against reference", errors.map((e) => (e?.rmse ? number(e.rmse.value) : e ? "below its noise" : "–")), "mean (T−R₁)(T−R₂), its root; radiance"),
    row("95 %, reference's noise", errors.map(interval), "One picture says nothing of its own spread: the interval holds the noise of the reference alone"),
    row("at", errors.map((e) => (e ? `${e.samples} spp` : "–"))),
  ];
  if (status.panels.length > 1) rows.unshift(row("", ["A", "B"]));
  const all = (name, value, title) => {
    const line = row(name, [value], title);
    line.lastChild.colSpan = status.panels.length || 1;
    rows.push(line);
  };
  all("samples a second", many(status.samples_per_second));
  all("rays a second", many(status.rays_per_second));
  all("time left", status.left > 0 ? `${status.left.toFixed(1)} s` : "–");
  all("reference", status.reference > 0 ? `2 × ${status.reference} spp` : "–");
  all("reference's own RMSE", errors[0] ? number(errors[0].reference_rmse) : "–");
  $("#numbers tbody").replaceChildren(...rows);
}

function showProbe({ x, y, panels: values, reference }) {
  $("#pixel-place").textContent = `(${x}, ${y})`;
  const rgb = (v) => (v ? v.map(number) : ["–", "–", "–"]);
  const rows = values.map(({ mean }, i) => row(values.length > 1 ? "AB"[i] : "radiance", rgb(mean)));
  rows.unshift(row("", ["R", "G", "B"]));
  rows.push(row("reference", rgb(reference)));
  values.forEach(({ standard_error, samples }, i) => {
    const line = row(`${values.length > 1 ? "AB"[i] + ": " : ""}luma's standard error, ${samples} spp`, [number(standard_error)], "As if the samples were independent: those of a good set err less");
    line.lastChild.colSpan = 3;
    rows.push(line);
  });
  $("#pixel tbody").replaceChildren(...rows);
}

// Mouse on the pictures.
let under = null, dragFrom = null, probing = 0;
const middle = () => ({ x: screens[0].full[0] >> 1, y: screens[0].full[1] >> 1 });

function askPoints() {
  link.ask("points", { ...(picked ?? under ?? middle()), decision: $("#points-decision").value || "pixel" });
}

for (const screen of screens) {
  const { canvas } = screen;
  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0) return;
    canvas.focus();
    dragFrom = [event.clientX, event.clientY];
    canvas.setPointerCapture(event.pointerId);
    flight.startDrag();
  });
  canvas.addEventListener("pointermove", (event) => {
    under = screen.pixelAt(event);
    if (dragFrom) {
      flight.drag(event.clientX - dragFrom[0], event.clientY - dragFrom[1], canvas.getBoundingClientRect().height);
      dragFrom = [event.clientX, event.clientY];
    } else if (under && performance.now() - probing > 50) {
      probing = performance.now();
      link.ask("probe", under);
    }
  });
  const end = () => {
    dragFrom = null;
    flight.endDrag();
  };
  canvas.addEventListener("pointerup", end);
  canvas.addEventListener("pointercancel", end);
  canvas.addEventListener("pointerleave", () => (under = null));
  canvas.addEventListener("contextmenu", (event) => {
    event.preventDefault();
    pick(screen.pixelAt(event));
  });
  canvas.addEventListener("dblclick", (event) => {
    picked = screen.pixelAt(event);
    askPoints();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    faster(-Math.sign(event.deltaY));
  }, { passive: false });
}
addEventListener("keyup", (event) => flight.release(event.code));
addEventListener("blur", () => flight.releaseAll());

function pick(pixel) {
  if (!pixel) return;
  picked = pixel;
  link.ask("probe", pixel);
  link.ask("pick", pixel);
}

function look(index) {
  const radio = document.querySelectorAll("#views input")[index];
  radio.checked = true;
  link.ask("look", { view: radio.value });
}

const CONTROLS = "input, select, button, summary, textarea";
const TEXTS = "input:not([type=radio], [type=checkbox], [type=range], [type=file]), select, textarea";

// Letters and digits anywhere but where one types; keys that controls use only outside of them.
addEventListener("keydown", (event) => {
  const within = (list) => event.target.closest?.(list);
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  if (event.code === "Escape") {
    const open = $("nav details[open]");
    if (open) {
      open.open = false;
      open.querySelector("summary").focus();
    } else link.ask("stop");
    return;
  }
  if (within(TEXTS)) return;
  const isOwn = /^(Arrow|Space|Enter)/.test(event.code);
  if (isOwn && within(CONTROLS)) return;
  if (flight.press(event.code)) event.preventDefault();
  else if (event.code === "Space") {
    event.preventDefault();
    link.ask("restart");
  } else if (event.repeat) return;
  else if (event.code === "KeyX") flip();
  else if (event.code === "KeyP") askPoints();
  else if (event.code === "Enter") pick(under ?? middle());
  else if (event.key === "+" || event.key === "-") faster(event.key === "+" ? 1 : -1);
  else if (/^[1-4]$/.test(event.key)) look(Number(event.key) - 1);
});

function flip() {
  flipped = 1 - flipped;
  const there = document.activeElement?.tagName === "CANVAS";
  arrange();
  if (there) screens[screens[flipped].figure.hidden ? 0 : flipped].canvas.focus();
}

function faster(steps) {
  $("#speed").textContent = number(flight.faster(steps));
  say(`Speed: ${number(flight.speed)} units a second.`, true);
}

// A click elsewhere closes an open panel.
addEventListener("pointerdown", (event) => {
  const open = $("nav details[open]");
  if (open && !open.contains(event.target)) open.open = false;
});

document.querySelectorAll("#views input").forEach((radio, i) => (radio.onchange = () => look(i)));
$("#reset").onclick = () => link.ask("reset");
$("#restart").onclick = () => link.ask("restart");
$("#stop").onclick = () => link.ask("stop");
$("#refine").onchange = (event) => link.ask("reference", { on: event.target.checked });
$("#points-go").onclick = askPoints;
$("#spectrum-go").onclick = () => {
  clearTimeout(spectral);
  spectral = spectral ? 0 : 1;
  $("#spectrum-go").setAttribute("aria-pressed", String(spectral > 0));
  $("#spectrum-go").textContent = spectral ? "Hide" : "Show";
  if (spectral) link.ask("spectrum");
  else $("#spectrum-out").replaceChildren();
};
