/** Decodes the screenshots that Chromium writes: 8-bit PNG files in RGB or RGBA, without interlacing. */

import { inflateSync } from "node:zlib";

export interface Pixels {
  readonly width: number;
  readonly height: number;
  /** Return red, green and blue of a pixel, from 0 to 255. */
  readonly pixelAt: (x: number, y: number) => readonly [number, number, number];
}

const SIGNATURE_BYTES = 8;
const COLOR_RGBA = 6;

export function decodePng(png: Buffer): Pixels {
  const data: Buffer[] = [];
  let header: Buffer = Buffer.alloc(0);
  for (let offset = SIGNATURE_BYTES; offset < png.length; ) {
    const length = png.readUInt32BE(offset);
    const chunkType = png.toString("latin1", offset + 4, offset + 8);
    const payload = png.subarray(offset + 8, offset + 8 + length);
    if (chunkType === "IHDR") header = payload;
    if (chunkType === "IDAT") data.push(payload);
    offset += length + 12;
  }
  const [width, height] = [header.readUInt32BE(0), header.readUInt32BE(4)];
  const channels = header[9] === COLOR_RGBA ? 4 : 3;
  const rows = unfilter(inflateSync(Buffer.concat(data)), width * channels, height, channels);
  const pixelAt = (x: number, y: number): readonly [number, number, number] => {
    const offset = (y * width + x) * channels;
    return [rows[offset] ?? 0, rows[offset + 1] ?? 0, rows[offset + 2] ?? 0];
  };
  return { width, height, pixelAt };
}

function unfilter(filtered: Buffer, rowBytes: number, height: number, channels: number): Uint8Array {
  const rows = new Uint8Array(rowBytes * height);
  for (let row = 0; row < height; row++) {
    const filterType = filtered[row * (rowBytes + 1)];
    for (let column = 0; column < rowBytes; column++) {
      const index = row * rowBytes + column;
      const left = column >= channels ? (rows[index - channels] ?? 0) : 0;
      const up = row > 0 ? (rows[index - rowBytes] ?? 0) : 0;
      const upperLeft = row > 0 && column >= channels ? (rows[index - rowBytes - channels] ?? 0) : 0;
      const predictions = [0, left, up, (left + up) >> 1, predictNearest(left, up, upperLeft)];
      rows[index] = (filtered[row * (rowBytes + 1) + 1 + column] ?? 0) + (predictions[filterType ?? 0] ?? 0);
    }
  }
  return rows;
}

/** The prediction of filter type 4: the neighbor that is nearest to left + up - upperLeft. */
function predictNearest(left: number, up: number, upperLeft: number): number {
  const [leftDistance, upDistance] = [Math.abs(up - upperLeft), Math.abs(left - upperLeft)];
  const cornerDistance = Math.abs(left + up - 2 * upperLeft);
  if (leftDistance <= upDistance && leftDistance <= cornerDistance) return left;
  return upDistance <= cornerDistance ? up : upperLeft;
}
