// Colour scales that stay in order for the colour-blind, as points of polylines in sRGB.

/** Dark blue to yellow, in the manner of cividis. */
const SEQUENTIAL = [
  [0, 32, 76], [0, 48, 111], [57, 67, 109], [87, 86, 108], [112, 105, 111], [138, 124, 112],
  [166, 144, 108], [196, 165, 98], [227, 189, 81], [255, 217, 61],
];
/** Dark blue over near white to dark red, for values of both signs. */
const DIVERGING = [
  [5, 48, 97], [33, 102, 172], [67, 147, 195], [146, 197, 222], [226, 236, 240], [247, 221, 196],
  [244, 165, 130], [214, 96, 77], [178, 24, 43], [103, 0, 31],
];
/** Colours of kinds that are told apart by the colour-blind, too (Okabe and Ito). */
export const KINDS = [
  [0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [240, 228, 66], [140, 140, 140],
];

function along(points, share) {
  const at = Math.min(Math.max(share, 0), 1) * (points.length - 1);
  const k = Math.min(Math.floor(at), points.length - 2);
  return points[k].map((c, i) => (c + (points[k + 1][i] - c) * (at - k)) / 255);
}

/** Red, green and blue from 0 to 1 of a share from 0 to 1. */
export const sequential = (share) => along(SEQUENTIAL, share);
/** Of a share from −1 to 1; 0 is neutral. */
export const diverging = (share) => along(DIVERGING, 0.5 * (share + 1));
export const kind = (k) => KINDS[k % KINDS.length].map((c) => c / 255);
export const css = ([r, g, b]) => `rgb(${Math.round(255 * r)} ${Math.round(255 * g)} ${Math.round(255 * b)})`;

/** A linear gradient of a scale. */
export function gradient(scale, from, to) {
  const stops = Array.from({ length: 17 }, (_, k) => css(scale(from + ((to - from) * k) / 16)));
  return `linear-gradient(to right, ${stops.join(', ')})`;
}

/** Round numbers between two, about `n` of them. */
export function ticks(low, high, n = 5) {
  const span = high - low;
  if (!(span > 0)) return [low];
  const raw = span / n;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= raw);
  const all = [];
  for (let x = Math.ceil(low / step) * step; x <= high + 1e-9 * span; x += step) all.push(Math.abs(x) < 1e-9 * span ? 0 : x);
  return all;
}
