/** Parses INDX and TAIL, and checks them against the stream (SPEC 5.8, 5.9). */

import type { Chunk } from "./chunks.js";
import { Fields } from "./fields.js";
import { demand } from "./reject.js";

/** The position and the ordinal of a canonical frame. */
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
  #isComplete = true;

  /** Start at the beginning of a stream, or after `frameCount` frames and the seek points among them. */
  constructor(frameCount = 0, precedingPoints: readonly SeekPoint[] = []) {
    this.#frameCount = frameCount;
    this.#seekPoints = [...precedingPoints];
  }

  /** Record a decoded CANO or SNAP, with its ordinal. */
  addCanonical(chunk: Chunk, frame: number): void {
    this.#seekPoints.push({ offset: BigInt(chunk.offset), sequence: chunk.sequence, frame });
    this.#frameCount += 1;
  }

  /** Record a decoded FRAM. */
  addFrame(): void {
    this.#frameCount += 1;
  }

  /** Record that critical chunks were skipped, so that INDX and TAIL need not match (11.4-3). */
  noteSkippedChunks(): void {
    this.#isComplete = false;
  }

  checkIndex(chunk: Chunk): void {
    const points = parseIndex(chunk.payload);
    const matches =
      points.length === this.#seekPoints.length && points.every((point, i) => this.#matchesPoint(point, i));
    demand(matches || !this.#isComplete, "index-mismatch", "INDX does not match the stream");
    this.#indexOffset = BigInt(chunk.offset);
  }

  checkTail(chunk: Chunk): void {
    const tail = parseTail(chunk.payload);
    const matches =
      tail.frameCount === this.#frameCount &&
      tail.canonicalCount === this.#seekPoints.length &&
      tail.indexOffset === this.#indexOffset;
    demand(matches || !this.#isComplete, "tail-mismatch", "TAIL does not match the stream");
  }

  #matchesPoint(point: SeekPoint, index: number): boolean {
    const { offset, sequence, frame } = this.#seekPoints[index];
    return point.offset === offset && point.sequence === sequence && point.frame === frame;
  }
}

/** Parse the seek points of INDX (5.9). */
export function parseIndex(payload: Uint8Array): SeekPoint[] {
  const fields = new Fields(payload);
  const count = fields.u32("count");
  const points: SeekPoint[] = [];
  while (points.length < count) {
    points.push({ offset: fields.u64("offset"), sequence: fields.u32("sequence"), frame: fields.u32("frame") });
  }
  fields.finish();
  return points;
}

/** Parse the fields of TAIL (5.8). */
export function parseTail(payload: Uint8Array) {
  const fields = new Fields(payload);
  const tail = {
    frameCount: fields.u32("frame_count"),
    canonicalCount: fields.u32("canonical_count"),
    indexOffset: fields.u64("index_offset"),
  };
  fields.finish();
  return tail;
}
