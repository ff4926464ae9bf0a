// Files in and out: dropped, chosen, downloaded.

import { make } from "./controls.js";

/** Offers bytes as a download. */
export function offer({ name, type }, bytes) {
  const url = URL.createObjectURL(new Blob([bytes], { type }));
  make("a", { href: url, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** All files below an entry of a drop, with their folders' names but the dropped one's. */
async function walk(entry, prefix, found) {
  if (entry.isFile) {
    const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
    found.push({ name: prefix + file.name, file });
  } else {
    const reader = entry.createReader();
    for (;;) {
      const entries = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (entries.length === 0) break;
      for (const inner of entries) await walk(inner, inner.isDirectory ? `${prefix}${inner.name}/` : prefix, found);
    }
  }
}

async function filesOf(transfer) {
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  if (entries.length === 0) return [...transfer.files].map((file) => ({ name: file.name, file }));
  const found = [];
  for (const entry of entries) await walk(entry, "", found);
  return found;
}

/** Takes drops anywhere on the page. */
export function takeDrops(link, failed) {
  const veil = document.querySelector("#drop");
  const hasFiles = (event) => [...(event.dataTransfer?.types ?? [])].includes("Files");
  let inside = 0;
  addEventListener("dragenter", (event) => {
    if (!hasFiles(event)) return;
    inside++;
    veil.hidden = false;
  });
  addEventListener("dragleave", (event) => {
    if (hasFiles(event) && --inside <= 0) veil.hidden = true;
  });
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", async (event) => {
    event.preventDefault();
    inside = 0;
    veil.hidden = true;
    try {
      const files = await filesOf(event.dataTransfer);
      if (files.length > 0) await link.upload(files);
    } catch (error) {
      failed(error.message);
    }
  });
}

/** The panel of configs. */
export class Configs {
  constructor(link, panel, canSave, failed) {
    this.list = make("select", { id: "config-list" });
    const load = make("button", { type: "button", textContent: "Load", onclick: () => this.list.value && link.ask("load", { name: this.list.value }) });
    const open = make("input", { type: "file", id: "config-files", multiple: true, accept: ".json,.obj,.mtl,.png,.jpg,.jpeg,.csv,.txt" });
    open.onchange = async () => {
      try {
        await link.upload([...open.files].map((file) => ({ name: file.name, file })));
      } catch (error) {
        failed(error.message);
      }
      open.value = "";
    };
    this.name = make("input", { type: "text", id: "config-name", maxLength: 100 });
    const save = make("button", { type: "button", textContent: "Save", onclick: () => link.ask("save", { name: this.name.value }) });
    save.disabled = this.name.disabled = !canSave;
    const row = (text, id, ...controls) => make("div", { className: "row" }, make("label", { htmlFor: id, textContent: text }), make("div", { className: "pair" }, ...controls));
    panel.append(
      row("Beside the scene", "config-list", this.list, load),
      row("From this computer", "config-files", open),
      row("Save as", "config-name", this.name, save),
      make("p", { className: "hint", textContent: canSave ? "Saved into the folder of --data, never over another file." : "To save on the program's side, start it with --data DIR." }),
      make("p", { className: "buttons" }, make("button", { type: "button", id: "download-json", textContent: "Download the full JSON", onclick: () => link.ask("download", { what: "document" }) })),
    );
  }

  update({ neighbours, name }) {
    if (!neighbours) return;
    this.list.replaceChildren(...neighbours.map((value) => make("option", { value, textContent: value })));
    if (neighbours.includes(name)) this.list.value = name;
    if (document.activeElement !== this.name) this.name.value = name.replace(/\.json$/, "");
  }
}
