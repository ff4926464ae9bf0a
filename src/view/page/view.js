// The page: what comes in is shown, what is done is asked for.

import { Flight } from "./camera.js";
import { pointSet, spectrum } from "./charts.js";
import { Comparison } from "./comparison.js";
import { Controls, make } from "./controls.js";
import { Configs, offer, takeDrops } from "./files.js";
import { Link } from "./link.js";
import { Samplers } from "./samplers.js";
import { Screen, many, number } from "./screen.js";

const $ = (selector) => document.querySelector(selector);
const screens = [new Screen("a"), new Screen("b")];
let samplers, configs, compare, picked, flipped = 0, panels = 1, spectral = 0;

/** Says what went wrong until it is closed or mended; what is good to know for some seconds. */
function say(text, good = false) {
  clearTimeout(say.ends);
  if (good) say.ends = setTimeout(() => say(""), 5000);
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
      link.bounds = hello;
      samplers = new Samplers(link, hello);
      configs = new Configs(link, $("#configs-panel"), hello.can_save, say);
      compare = new Comparison(link, hello, arrange);
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
      compare.update(state);
      flight.take(state.config, state);
      document.querySelector(`#views input[value=${state.config.view.look}]`).checked = true;
      $("#refine").checked = state.config.view.refine;
      arrange();
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
      // Where the numbers lie below the picture, they would not be seen.
      if (matchMedia("(max-width: 56rem)").matches) say($("#picked").textContent, true);
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
    error({ text }) {
      say(text);
      // Nothing changed: controls show what is, but for one in which somebody may want to mend what was typed.
      if (controls.state) showAgain(document.activeElement?.matches("input, select") ? document.activeElement : null);
    },
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

/** Shows the document again in all controls; one that has the focus keeps what was typed, marked, until it is left. */
function showAgain(typed) {
  controls.revert();
  samplers.update(controls.state);
  compare.update(controls.state);
  if (!typed) return;
  typed.setAttribute("aria-invalid", "true");
  typed.addEventListener("blur", () => {
    typed.removeAttribute("aria-invalid");
    setTimeout(() => showAgain(null));
  }, { once: true });
}

/** One panel, two beside each other, or one of two. */
function arrange() {
  const flips = panels > 1 && compare?.flips;
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

/** Rings a pixel and shows its values. */
function choose(pixel) {
  picked = pixel;
  for (const screen of screens) screen.mark(pixel);
  link.ask("probe", pixel);
}

function askPoints() {
  choose(under ?? picked ?? middle());
  link.ask("points", { ...picked, decision: $("#points-decision").value || "pixel" });
}

const STEPS = { KeyI: [0, -1], KeyK: [0, 1], KeyJ: [-1, 0], KeyL: [1, 0] };

/** Moves the ring by a pixel, or ten. */
function step([dx, dy], far) {
  const [w, h] = screens[0].full;
  const inside = (i, n) => Math.max(0, Math.min(n - 1, i));
  const { x, y } = picked ?? middle();
  // The keys' until the mouse moves again.
  under = null;
  choose({ x: inside(x + dx * far, w), y: inside(y + dy * far, h) });
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
    const pixel = screen.pixelAt(event);
    if (!pixel) return;
    choose(pixel);
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
  choose(pixel);
  link.ask("pick", pixel);
}

function look(index) {
  const radio = document.querySelectorAll("#views input")[index];
  radio.checked = true;
  link.set({ "view.look": radio.value });
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
  } else if (event.code in STEPS) step(STEPS[event.code], event.shiftKey ? 10 : 1);
  else if (event.repeat) return;
  else if (event.code === "KeyX") flip();
  else if (event.code === "KeyP") askPoints();
  else if (event.code === "Enter") pick(under ?? picked ?? middle());
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
  link.set({ "view.speed": flight.speed }, true);
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
$("#refine").onchange = (event) => link.set({ "view.refine": event.target.checked });
$("#points-go").onclick = askPoints;
$("#spectrum-go").onclick = () => {
  clearTimeout(spectral);
  spectral = spectral ? 0 : 1;
  $("#spectrum-go").setAttribute("aria-pressed", String(spectral > 0));
  $("#spectrum-go").textContent = spectral ? "Hide" : "Show";
  if (spectral) link.ask("spectrum");
  else $("#spectrum-out").replaceChildren();
};
