"use strict";
// Pictures out of text: the way back of packed.rs.

/** The bytes that a base64 text of deflated data stands for. */
async function inflated(base64) {
  const packed = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A plane of 16 bits from its residuals: high bytes from `at` on, low bytes behind them. */
function plane(bytes, at, width, height) {
  const count = width * height;
  const values = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    const code = (bytes[at + i] << 8) | bytes[at + count + i];
    const beyond = (code >> 1) ^ -(code & 1);
    const left = i % width > 0 ? values[i - 1] : null;
    const above = i >= width ? values[i - width] : null;
    let expected = left ?? above ?? 0;
    if (left !== null && above !== null) {
      const way = ((above - left) << 16) >> 16;
      expected = left + (way >> 1);
    }
    values[i] = expected + beyond;
  }
  return values;
}

/** The red, green and blue half floats of a picture. */
async function halves(base64, width, height) {
  const bytes = await inflated(base64);
  const count = width * height;
  const green = plane(bytes, 0, width, height);
  const red = plane(bytes, 2 * count, width, height);
  const blue = plane(bytes, 4 * count, width, height);
  for (let i = 0; i < count; i++) {
    red[i] += green[i];
    blue[i] += green[i];
  }
  return [red, green, blue];
}

/** Shares from 0 to 255. */
async function shares(base64, width, height) {
  return plane(await inflated(base64), 0, width, height);
}

/** What each half float stands for, by its bits. */
const HALF = Float32Array.from({ length: 65536 }, (_, bits) => {
  const exponent = (bits >> 10) & 31;
  const mantissa = bits & 1023;
  const size = exponent === 0 ? mantissa * 2 ** -24 : (1024 + mantissa) * 2 ** (exponent - 25);
  return bits & 0x8000 ? -size : size;
});
