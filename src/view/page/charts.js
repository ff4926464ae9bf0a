// Points and lines on small canvases.

import { make } from "./controls.js";
import { number } from "./screen.js";

/** A sharp canvas of so many CSS pixels. */
function canvas(width, height, label) {
  const element = make("canvas", { ariaLabel: label });
  element.setAttribute("role", "img");
  const scale = window.devicePixelRatio || 1;
  [element.width, element.height] = [width * scale, height * scale];
  const context = element.getContext("2d");
  context.scale(scale, scale);
  return [element, context];
}

const ink = () => getComputedStyle(document.body).color;

/** Points in the unit square, origin bottom left, from cyan to red in their order; in one dimension against their index. */
export function pointSet({ source, points, measured, error }) {
  const size = 280;
  const n = points.length;
  const [element, context] = canvas(size, size, `${n} points of ${source}, the first cyan, the last red`);
  context.fillStyle = "#000";
  context.fillRect(0, 0, size, size);
  const radius = n > 1024 ? 1.2 : n > 256 ? 1.8 : 2.6;
  points.forEach((point, i) => {
    const [x, y] = point.length > 1 ? point : [point[0], (i + 0.5) / n];
    const t = n > 1 ? i / (n - 1) : 0;
    context.fillStyle = `rgb(${255 * t} ${255 * (1 - t)} ${255 * (1 - t)})`;
    context.beginPath();
    context.arc(x * size, (1 - y) * size, radius, 0, 7);
    context.fill();
  });
  const rows = make("tbody");
  const tell = (name, value) => rows.append(make("tr", {}, make("th", { scope: "row", textContent: name }), make("td", { textContent: value })));
  if (error) tell("not measured", error);
  if (measured) {
    tell("star discrepancy D*", measured.star ? number(measured.star.value) : "takes too long here");
    tell("L2 star", number(measured.l2_star?.value));
    tell("centred L2", number(measured.centred_l2?.value));
    tell("wrap-around L2", number(measured.wrap_around_l2?.value));
    tell("diaphony", number(measured.diaphony?.value));
    tell("t value", measured.t_value ?? "–");
    tell("smallest distance, toroidal", number(measured.min_toroidal_distance));
  }
  return make("div", {}, make("p", { className: "hint", textContent: source }), element, make("table", {}, rows));
}

const COLOURS = ["#0072b2", "#d55e00"];

/** Power of the error by frequency, logarithmic in power; white noise of the same error is level. */
export function spectrum(panels, reference) {
  const [width, height, left, bottom] = [280, 190, 52, 34];
  const [element, context] = canvas(width, height, "Power of the error by frequency");
  const curves = panels.map(({ spectrum: s }) => s.frequency.map((f, i) => [f, s.power[i]]).filter(([f, p]) => f > 0 && p > 0));
  const powers = [...curves.flat().map(([, p]) => p), ...panels.map((p) => p.mse).filter((m) => m > 0)];
  if (powers.length === 0) return make("p", { textContent: "The error is below the reference's noise: nothing to draw yet." });
  const low = Math.floor(Math.log10(Math.min(...powers)));
  const high = Math.max(Math.ceil(Math.log10(Math.max(...powers))), low + 1);
  const x = (f) => left + (f / 0.71) * (width - left - 8);
  const y = (p) => 8 + ((high - Math.log10(p)) / (high - low)) * (height - bottom - 8);
  Object.assign(context, { fillStyle: ink(), strokeStyle: ink(), font: "11px system-ui, sans-serif", lineWidth: 1, globalAlpha: 0.85 });
  context.strokeRect(left, 8, width - left - 8, height - bottom - 8);
  context.textAlign = "right";
  const every = Math.ceil((high - low) / 6);
  for (let e = low; e <= high; e += every) {
    context.fillText(`1e${e}`, left - 5, y(10 ** e) + 4);
    context.fillRect(left - 3, y(10 ** e), 3, 1);
  }
  context.textAlign = "center";
  for (const f of [0, 0.25, 0.5, 0.707]) {
    context.fillText(String(f), Math.min(x(f), width - 18), height - bottom + 15);
    context.fillRect(x(f), height - bottom, 1, 3);
  }
  context.fillText("cycles per pixel", (left + width) / 2, height - 4);
  context.globalAlpha = 1;
  const rows = make("tbody");
  panels.forEach(({ sampler, samples, mse, spectrum: s }, i) => {
    Object.assign(context, { strokeStyle: COLOURS[i], lineWidth: 2 });
    context.setLineDash(i === 0 ? [] : [6, 3]);
    context.beginPath();
    curves[i].forEach(([f, p], k) => (k === 0 ? context.moveTo(x(f), y(p)) : context.lineTo(x(f), y(p))));
    context.stroke();
    if (mse > 0) {
      Object.assign(context, { lineWidth: 1 });
      context.setLineDash([2, 4]);
      context.beginPath();
      context.moveTo(left, y(mse));
      context.lineTo(width - 8, y(mse));
      context.stroke();
    }
    const key = make("span", { className: "key" });
    key.style.borderTopColor = COLOURS[i];
    key.style.borderTopStyle = i === 0 ? "solid" : "dashed";
    const share = (v) => (v == null ? "–" : `${(100 * v).toPrecision(3)} %`);
    rows.append(make("tr", {}, make("th", { scope: "row" }, key, `${sampler}, ${samples} spp`), make("td", { textContent: `low-frequency share ${share(s.low_share?.value)}; white noise ${share(s.white_low_share)}` })));
  });
  return make("div", {}, element, make("table", {}, rows),
    make("p", { className: "hint", textContent: `Power in squared radiance; dotted: white noise of the same mean square error. Reference 2 × ${reference} spp.` }));
}
