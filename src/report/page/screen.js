// From radiance to pixels of a screen: the library's curve by its thresholds, and two colour scales.

/** Code values of all half floats at a scale and an exposure, by the thresholds of the codes 1 to 255. */
function codes(thresholds, factor) {
  const table = new Uint8ClampedArray(65536);
  let code = 0;
  for (let bits = 0; bits < 0x7c00; bits++) {
    const exposed = HALF[bits] * factor;
    while (code < 255 && exposed >= thresholds[code]) code++;
    table[bits] = code;
  }
  return table;
}

/** Rec. 709 luminance. */
const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/** Blue at −1, white at 0, red at 1: the scale of the error maps in the report. */
function diverging(t) {
  const end = t < 0 ? [33, 102, 172] : [178, 24, 43];
  const share = Math.min(1, Math.abs(t));
  return end.map((c) => 255 + (c - 255) * share);
}

/** Black at 0, over purple and orange to pale yellow at 1 (nine stops of the scale `magma`, as FLIP maps are usually shown). */
function magma(t) {
  const stops = [
    [0, 0, 4], [28, 16, 68], [79, 18, 123], [129, 37, 129], [181, 54, 122],
    [229, 80, 100], [251, 135, 97], [254, 194, 135], [252, 253, 191],
  ];
  const at = Math.min(1, Math.max(0, t)) * (stops.length - 1);
  const i = Math.min(stops.length - 2, Math.floor(at));
  return stops[i].map((c, k) => c + (stops[i + 1][k] - c) * (at - i));
}
