//! What makes a page unusable for somebody, found in the browser's own accessibility tree and computed styles.

use serde_json::{Value, json};

use crate::chromium::Page;

/// Every serious finding on the page as it is now, in words.
///
/// Language, title, landmarks, order of headings, names of controls and pictures, double ids, dead links inside the page, contrast of
/// all visible text (WCAG 1.4.3: 4.5, large letters 3), a mark on whatever has the focus, sizes of targets (WCAG 2.5.8: 24 pixels).
pub fn findings(page: &Page) -> Vec<String> {
    let mut found = nameless(page);
    for script in [STRUCTURE, CONTRAST, FOCUS, TARGETS] {
        let list = page.evaluate(&format!("(() => {{ const found = []; {script}; return found; }})()"));
        found.extend(list.as_array().unwrap().iter().map(|text| text.as_str().unwrap().to_owned()));
    }
    found
}

/// Controls and pictures of the accessibility tree that have no name.
fn nameless(page: &Page) -> Vec<String> {
    let roles = [
        "button",
        "link",
        "combobox",
        "slider",
        "textbox",
        "checkbox",
        "radio",
        "spinbutton",
        "tab",
        "switch",
        "image",
        "img",
        "canvas",
        "application",
        "region",
        "navigation",
        "group",
        "searchbox",
        "menuitem",
        "option",
    ];
    let tree = page.call("Accessibility.getFullAXTree", json!({}));
    let nodes = tree["nodes"].as_array().unwrap().iter().filter(|node| node["ignored"] != true);
    let is_nameless = |node: &&Value| {
        let role = node["role"]["value"].as_str().unwrap_or("");
        let name = node["name"]["value"].as_str().unwrap_or("");
        roles.contains(&role) && name.trim().is_empty()
    };
    let describe = |node: &Value| {
        let found = page.call("DOM.describeNode", json!({"backendNodeId": node["backendDOMNodeId"]}));
        let (name, attributes) = (&found["node"]["localName"], &found["node"]["attributes"]);
        // A folded part of a page is a group whose summary names it.
        (name != "details").then(|| format!("no name: {} {name} {attributes}", node["role"]["value"]))
    };
    nodes.filter(is_nameless).filter_map(describe).collect()
}

const STRUCTURE: &str = r#"
  const say = (wrong, what) => wrong && found.push(what);
  say(!/^[a-z]{2}/.test(document.documentElement.lang), "no language");
  say(!document.title.trim(), "no title");
  say(document.querySelectorAll("main").length !== 1, "not one main part");
  say(document.querySelectorAll("h1").length !== 1, "not one heading of level 1");
  let before = 0;
  for (const heading of document.querySelectorAll("h1, h2, h3, h4, h5, h6")) {
    const level = Number(heading.tagName[1]);
    say(level > before + 1, `heading ${heading.textContent} of level ${level} after one of ${before}`);
    before = level;
  }
  const ids = [...document.querySelectorAll("[id]")].map((e) => e.id);
  say(new Set(ids).size !== ids.length, `ids twice: ${ids.filter((id, i) => ids.indexOf(id) !== i)}`);
  for (const link of document.querySelectorAll("a[href^='#']")) {
    say(!document.getElementById(decodeURIComponent(link.hash.slice(1))), `dead link ${link.hash}`);
  }
  for (const image of document.images) say(!image.alt.trim(), "a picture without words");
  for (const table of document.querySelectorAll("table")) say(!table.querySelector("th"), "a table without headings");
  for (const hidden of document.querySelectorAll("[aria-hidden=true]")) {
    say(hidden.matches("a, button, input, select, [tabindex]") || hidden.querySelector("a, button, input, select, [tabindex]"), "a hidden control");
  }
"#;

const CONTRAST: &str = r#"
  const channels = (text) => {
    const parts = text.match(/[\d.]+/g).map(Number);
    return parts.length > 3 ? parts : [...parts, 1];
  };
  const over = (top, under) => top.slice(0, 3).map((c, i) => c * top[3] + under[i] * (1 - top[3]));
  const linear = (c) => (c / 255 <= 0.04045 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4);
  const light = (c) => 0.2126 * linear(c[0]) + 0.7152 * linear(c[1]) + 0.0722 * linear(c[2]);
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const seen = new Set();
  for (let text = walker.nextNode(); text; text = walker.nextNode()) {
    const element = text.parentElement;
    if (seen.has(element) || !text.textContent.trim() || !element.checkVisibility() || element.matches("script, style, noscript")) continue;
    seen.add(element);
    const style = getComputedStyle(element);
    const layers = [];
    let opacity = 1;
    for (let e = element; e; e = e.parentElement) {
      layers.push(channels(getComputedStyle(e).backgroundColor));
      opacity *= Number(getComputedStyle(e).opacity);
    }
    // Behind letters that lie on a picture may be white.
    const onPicture = element.closest(".label, .scale");
    let back = [255, 255, 255];
    for (const layer of (onPicture ? layers.slice(0, 1) : layers).reverse()) back = over(layer, back);
    const ink = channels(style.color);
    const front = over([...ink.slice(0, 3), ink[3] * opacity], back);
    const [high, low] = [light(front), light(back)].sort((a, b) => b - a);
    const ratio = (high + 0.05) / (low + 0.05);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    if (ratio < (large ? 3 : 4.5)) found.push(`contrast ${ratio.toFixed(2)}: ${text.textContent.trim().slice(0, 40)}`);
  }
"#;

const FOCUS: &str = r#"
  const before = document.activeElement;
  for (const control of document.querySelectorAll("a[href], button, select, input, summary, [tabindex='0']")) {
    if (!control.checkVisibility() || control.disabled) continue;
    control.focus({ focusVisible: true });
    const style = getComputedStyle(control);
    if (document.activeElement !== control) found.push(`cannot have the focus: ${control.outerHTML.slice(0, 60)}`);
    else if (style.outlineStyle === "none" || parseFloat(style.outlineWidth) < 1) found.push(`focus is not seen: ${control.outerHTML.slice(0, 60)}`);
  }
  before?.focus?.({ preventScroll: true });
"#;

const TARGETS: &str = r#"
  for (const control of document.querySelectorAll("button, select, input[type=checkbox]")) {
    const box = control.getBoundingClientRect();
    if (control.checkVisibility() && (box.width < 24 || box.height < 24)) found.push(`small target: ${control.outerHTML.slice(0, 60)}`);
  }
"#;
