// The one way to the program: requests out, state, numbers and frames in.

const decoder = new TextDecoder();
const encoder = new TextEncoder();

/** Bytes under a JSON header: its length in 4 bytes, low ones first, the header, the rest. */
function split(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(decoder.decode(new Uint8Array(buffer, 4, length)));
  return [header, new Uint8Array(buffer, 4 + length)];
}

export class Link {
  /** `handlers[is]` gets each message of that kind, and its bytes; `lost` is told when the way is gone. */
  constructor(handlers, lost) {
    const token = new URLSearchParams(location.search).get("token") ?? "";
    this.socket = new WebSocket(`ws://${location.host}/live?token=${encodeURIComponent(token)}`);
    this.socket.binaryType = "arraybuffer";
    this.socket.onmessage = ({ data }) => {
      const [message, bytes] = typeof data === "string" ? [JSON.parse(data)] : split(data);
      handlers[message.is]?.(message, bytes);
    };
    this.socket.onclose = () => lost();
    this.drops = 0;
    document.body.dataset.asked = this.sets = 0;
  }

  get isOpen() {
    return this.socket.readyState === WebSocket.OPEN;
  }

  ask(ask, fields = {}) {
    // The program counts changes too: where both counts are equal, none is on the way.
    if (ask === "set") document.body.dataset.asked = ++this.sets;
    if (this.isOpen) this.socket.send(JSON.stringify({ ask, ...fields }));
  }

  /** Changes keys of the document: each value as JSON, a string too. */
  set(values, moving = false) {
    const sets = Object.entries(values).map(([key, value]) => `${key}=${JSON.stringify(value)}`);
    this.ask("set", { sets, moving });
  }

  /** Sends files of one drop, in order. */
  async upload(files) {
    const upload = ++this.drops;
    for (const [i, { name, file }] of files.entries()) {
      const header = encoder.encode(JSON.stringify({ upload, name, last: i + 1 === files.length }));
      const message = new Uint8Array(4 + header.length + file.size);
      new DataView(message.buffer).setUint32(0, header.length, true);
      message.set(header, 4);
      message.set(new Uint8Array(await file.arrayBuffer()), 4 + header.length);
      if (this.isOpen) this.socket.send(message);
    }
  }
}
