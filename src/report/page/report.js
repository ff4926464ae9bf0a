// The page: theme, tables that scroll, and which viewer the keys are for.

const viewers = [...document.querySelectorAll("section.viewer")].map((section) => new Viewer(section));

/** The viewer that has the focus, else, where no control has it, the one that is most in sight. */
function current() {
  const active = document.activeElement;
  const own = viewers.find((viewer) => viewer.section.contains(active));
  if (own) return own;
  if (active?.matches("input, select, textarea, summary, a, button, .scroll")) return null;
  const seen = (viewer) => {
    const box = viewer.stage.getBoundingClientRect();
    return Math.min(box.bottom, window.innerHeight) - Math.max(box.top, 0);
  };
  const best = viewers.reduce((best, viewer) => (best && seen(best) >= seen(viewer) ? best : viewer), null);
  return best && seen(best) > 40 ? best : null;
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const viewer = current();
  if (!viewer) return;
  if (event.key === "Shift") return viewer.hold(true);
  // Lists choose by letters and arrows, ranges move by arrows.
  const own = event.target.matches?.("select") || (event.target.matches?.("input") && event.key.startsWith("Arrow"));
  if (!own && viewer.press(event)) event.preventDefault();
});
const release = () => viewers.forEach((viewer) => viewer.hold(false));
document.addEventListener("keyup", (event) => event.key === "Shift" && release());
window.addEventListener("blur", release);

/** Tables that are wider than the page can be reached and scrolled by keys. */
function reachable() {
  for (const box of document.querySelectorAll(".scroll")) {
    if (box.scrollWidth > box.clientWidth + 1) box.tabIndex = 0;
    else box.removeAttribute("tabindex");
  }
}
reachable();
window.addEventListener("resize", reachable);
document.addEventListener("toggle", reachable, true);

/** Opens what is folded around the target of a link. */
function unfold() {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let fold = target?.closest("details"); fold; fold = fold.parentElement.closest("details")) fold.open = true;
  target?.scrollIntoView();
}
window.addEventListener("hashchange", unfold);
if (location.hash) unfold();

const theme = element("select", {}, ...[["", "System"], ["light", "Light"], ["dark", "Dark"]].map(([value, text]) => element("option", { value }, text)));
theme.addEventListener("change", () => {
  if (theme.value) document.documentElement.dataset.theme = theme.value;
  else delete document.documentElement.dataset.theme;
});
document.getElementById("theme").append(element("label", {}, element("span", { class: "word" }, "Colours "), theme));
