/** Decodes screenshots: 8-bit PNG files in RGB or RGBA without interlacing, as written by Chromium. */

import { inflateSync } from "node:zlib";

export interface Pixels {
  readonly width: number;
  readonly height: number;
  /** Red, green and blue, row by row. */
  readonly at: (x: number, y: number) => readonly [number, number, number];
}

const SIGNATURE_BYTES = 8;
const COLOR_RGBA = 6;

export function decodePng(png: Buffer): Pixels {
  const data: Buffer[] = [];
  let header: Buffer = Buffer.alloc(0);
  for (let at = SIGNATURE_BYTES; at < png.length; ) {
    const length = png.readUInt32BE(at);
    const kind = png.toString("latin1", at + 4, at + 8);
    const payload = png.subarray(at + 8, at + 8 + length);
    if (kind === "IHDR") header = payload;
    if (kind === "IDAT") data.push(payload);
    at += length + 12;
  }
  const [width, height] = [header.readUInt32BE(0), header.readUInt32BE(4)];
  const channels = header[9] === COLOR_RGBA ? 4 : 3;
  const rows = unfilter(inflateSync(Buffer.concat(data)), width * channels, height, channels);
  const at = (x: number, y: number): readonly [number, number, number] => {
    const place = (y * width + x) * channels;
    return [rows[place] ?? 0, rows[place + 1] ?? 0, rows[place + 2] ?? 0];
  };
  return { width, height, at };
}

function unfilter(filtered: Buffer, rowBytes: number, height: number, channels: number): Uint8Array {
  const rows = new Uint8Array(rowBytes * height);
  for (let row = 0; row < height; row++) {
    const kind = filtered[row * (rowBytes + 1)];
    for (let column = 0; column < rowBytes; column++) {
      const at = row * rowBytes + column;
      const left = column >= channels ? (rows[at - channels] ?? 0) : 0;
      const up = row > 0 ? (rows[at - rowBytes] ?? 0) : 0;
      const corner = row > 0 && column >= channels ? (rows[at - rowBytes - channels] ?? 0) : 0;
      const predictions = [0, left, up, (left + up) >> 1, nearestOf(left, up, corner)];
      rows[at] = (filtered[row * (rowBytes + 1) + 1 + column] ?? 0) + (predictions[kind ?? 0] ?? 0);
    }
  }
  return rows;
}

/** The one of left, up and corner that is nearest to left + up - corner (filter type 4). */
function nearestOf(left: number, up: number, corner: number): number {
  const [a, b, c] = [Math.abs(up - corner), Math.abs(left - corner), Math.abs(left + up - 2 * corner)];
  if (a <= b && a <= c) return left;
  return b <= c ? up : corner;
}
