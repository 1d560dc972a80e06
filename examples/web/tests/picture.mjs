// A screenshot as pixels, and what can be said of a face in it without knowing the face.
import { inflateSync } from "node:zlib";

/** The pixels of a PNG of 8 bits, RGB or RGBA, not interlaced: what browsers write. */
export function decoded(png) {
  let [at, header, data] = [8, null, []];
  while (at < png.length) {
    const [length, type] = [png.readUInt32BE(at), png.toString("latin1", at + 4, at + 8)];
    const content = png.subarray(at + 8, at + 8 + length);
    if (type === "IHDR") header = content;
    if (type === "IDAT") data.push(content);
    at += length + 12;
  }
  const [width, height, depth, colour, interlaced] = [header.readUInt32BE(0), header.readUInt32BE(4), header[8], header[9], header[12]];
  const channels = { 2: 3, 6: 4 }[colour];
  if (depth !== 8 || channels === undefined || interlaced !== 0) throw new Error("a PNG of another kind was expected");
  const raw = inflateSync(Buffer.concat(data));
  const row = width * channels;
  const pixels = new Uint8Array(row * height);
  for (let y = 0; y < height; y++) {
    const filter = raw[y * (row + 1)];
    const [from, to] = [y * (row + 1) + 1, y * row];
    for (let x = 0; x < row; x++) {
      const left = x >= channels ? pixels[to + x - channels] : 0;
      const up = y > 0 ? pixels[to + x - row] : 0;
      let guess = 0;
      if (filter === 1) guess = left;
      else if (filter === 2) guess = up;
      else if (filter === 3) guess = (left + up) >> 1;
      else if (filter === 4) guess = paeth(left, up, x >= channels && y > 0 ? pixels[to + x - row - channels] : 0);
      pixels[to + x] = raw[from + x] + guess;
    }
  }
  return { width, height, channels, pixels };
}

function paeth(left, up, corner) {
  const guess = left + up - corner;
  const a = Math.abs(guess - left);
  const b = Math.abs(guess - up);
  const c = Math.abs(guess - corner);
  return a <= b && a <= c ? left : b <= c ? up : corner;
}

const luminance = (r, g, b) => 0.2126 * r + 0.7152 * g + 0.0722 * b;

/** Whether a colour is one of lit or shaded skin: red above green above blue, and neither grey nor black. */
const isSkin = (r, g, b) => r > 60 && r - b > 18 && r > g && g >= b;

/** What the skin in a part of a picture says: its share of the area, its box, how far left and right sides are alike, and its shading. */
export function faceIn(picture, { left, top, width, height }) {
  const { channels, pixels } = picture;
  const rows = [];
  let [count, sum, squares] = [0, 0, 0];
  const box = { left: Infinity, right: -Infinity, top: Infinity, bottom: -Infinity };
  for (let y = top; y < top + height; y++) {
    const row = [];
    for (let x = left; x < left + width; x++) {
      const at = (y * picture.width + x) * channels;
      const [r, g, b] = [pixels[at], pixels[at + 1], pixels[at + 2]];
      if (!isSkin(r, g, b)) continue;
      row.push(x);
      count++;
      sum += luminance(r, g, b);
      squares += luminance(r, g, b) ** 2;
    }
    if (row.length > 0) {
      const [from, to] = [row[0], row[row.length - 1]];
      Object.assign(box, { left: Math.min(box.left, from), right: Math.max(box.right, to), top: Math.min(box.top, y), bottom: y });
    }
    if (row.length > 8) rows.push([row[0], row[row.length - 1]]);
  }
  if (count === 0) return { share: 0, aspect: 0, asymmetry: 1, shading: 0, tapering: 0 };
  const [mean, middle] = [sum / count, (box.left + box.right) / 2];
  const off = rows.map(([from, to]) => Math.abs((from + to) / 2 - middle) / (box.right - box.left));
  const widths = rows.map(([from, to]) => to - from);
  return {
    share: count / (width * height),
    aspect: (box.bottom - box.top) / (box.right - box.left),
    // Mean distance of the rows' middles from the middle line, in widths of the face.
    asymmetry: off.reduce((total, value) => total + value, 0) / off.length,
    // Standard deviation of the luminance: a flat shape has none.
    shading: Math.sqrt(Math.max(0, squares / count - mean * mean)),
    // The chin is narrower than the cheeks.
    tapering: widths[widths.length - Math.ceil(widths.length / 20)] / Math.max(...widths),
  };
}

/** Why the part of a picture shows no face; empty if it does. The limits are wide; an empty, uniform or flat picture is far outside them. */
export function noFace(found) {
  const within = { share: [0.12, 0.8], aspect: [1.0, 2.2], asymmetry: [0, 0.04], shading: [12, 90], tapering: [0.1, 0.75] };
  return Object.entries(within)
    .filter(([key, [low, high]]) => !(found[key] >= low && found[key] <= high))
    .map(([key, [low, high]]) => `${key} is ${found[key].toFixed(3)}, expected ${low} to ${high}`);
}

/** Pixels of a part in which two pictures differ by more than a shade. */
export function differing(one, other, { left, top, width, height }) {
  let count = 0;
  for (let y = top; y < top + height; y++) {
    for (let x = left; x < left + width; x++) {
      const [a, b] = [(y * one.width + x) * one.channels, (y * other.width + x) * other.channels];
      let distance = 0;
      for (let k = 0; k < 3; k++) distance += Math.abs(one.pixels[a + k] - other.pixels[b + k]);
      if (distance > 12) count++;
    }
  }
  return count;
}
