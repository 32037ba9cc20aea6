/** INDX and TAIL, checked against the stream (SPEC 5.8, 5.9). */

import type { Chunk } from "./chunks.js";
import { Fields } from "./fields.js";
import { demand } from "./reject.js";

/** The position of a canonical frame. */
export interface SeekPoint {
  readonly offset: bigint;
  readonly sequence: number;
  readonly frame: number;
}

/** Collects the expected contents of INDX and TAIL while a stream is read. */
export class StreamRecord {
  readonly #seekPoints: SeekPoint[];
  #frameCount: number;
  #indexOffset = 0n;
  #whole = true;

  /** Starts at the beginning of a stream, or after the given frames and seek points. */
  constructor(frameCount = 0, points: readonly SeekPoint[] = []) {
    this.#frameCount = frameCount;
    this.#seekPoints = [...points];
  }

  /** Count a decoded CANO or SNAP of frame `frame`. */
  addCanonical(chunk: Chunk, frame: number): void {
    this.#seekPoints.push({ offset: BigInt(chunk.offset), sequence: chunk.sequence, frame });
    this.#frameCount += 1;
  }

  /** Count a decoded FRAM chunk. */
  addFrame(): void {
    this.#frameCount += 1;
  }

  /** Critical chunks were skipped: INDX and TAIL are not checked against the rest (11.4-3). */
  leaveOut(): void {
    this.#whole = false;
  }

  checkIndex(chunk: Chunk): void {
    const points = parseIndex(chunk.payload);
    const same = points.length === this.#seekPoints.length && points.every((point, i) => this.#isPoint(point, i));
    demand(same || !this.#whole, "index-mismatch", "INDX does not match the stream");
    this.#indexOffset = BigInt(chunk.offset);
  }

  checkTail(chunk: Chunk): void {
    const tail = parseTail(chunk.payload);
    const same =
      tail.frameCount === this.#frameCount &&
      tail.canonicalCount === this.#seekPoints.length &&
      tail.indexOffset === this.#indexOffset;
    demand(same || !this.#whole, "tail-mismatch", "TAIL does not match the stream");
  }

  #isPoint(point: SeekPoint, index: number): boolean {
    const { offset, sequence, frame } = this.#seekPoints[index];
    return point.offset === offset && point.sequence === sequence && point.frame === frame;
  }
}

/** The seek points of INDX (5.9). */
export function parseIndex(payload: Uint8Array): SeekPoint[] {
  const fields = new Fields(payload);
  const count = fields.u32("count");
  const points: SeekPoint[] = [];
  while (points.length < count) {
    points.push({ offset: fields.u64("offset"), sequence: fields.u32("sequence"), frame: fields.u32("frame") });
  }
  fields.end();
  return points;
}

/** The fields of TAIL (5.8). */
export function parseTail(payload: Uint8Array) {
  const fields = new Fields(payload);
  const tail = {
    frameCount: fields.u32("frame_count"),
    canonicalCount: fields.u32("canonical_count"),
    indexOffset: fields.u64("index_offset"),
  };
  fields.end();
  return tail;
}
