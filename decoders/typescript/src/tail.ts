/** INDX and TAIL, held against the stream that was read (SPEC 5.8, 5.9). */

import type { Chunk } from "./chunks.js";
import { Fields } from "./fields.js";
import { demand } from "./reject.js";

interface SeekPoint {
  readonly offset: number;
  readonly sequence: number;
  readonly frame: number;
}

/** What INDX and TAIL say of a stream, gathered while it is read. */
export class StreamRecord {
  readonly #seekPoints: SeekPoint[] = [];
  #frameCount = 0;
  #indexOffset = 0;

  /** A CANO chunk was decoded, whose frame has the ordinal `frame`. */
  addCanonical(chunk: Chunk, frame: number): void {
    this.#seekPoints.push({ offset: chunk.offset, sequence: chunk.sequence, frame });
    this.#frameCount += 1;
  }

  /** A FRAM chunk was decoded. */
  addFrame(): void {
    this.#frameCount += 1;
  }

  checkIndex(chunk: Chunk): void {
    const fields = new Fields(chunk.payload);
    const count = fields.u32("count");
    demand(
      count === this.#seekPoints.length,
      "index-mismatch",
      `INDX has ${count} of ${this.#seekPoints.length} points`,
    );
    for (const point of this.#seekPoints) {
      const same =
        fields.u64("offset") === BigInt(point.offset) &&
        fields.u32("sequence") === point.sequence &&
        fields.u32("frame") === point.frame;
      demand(same, "index-mismatch", `INDX is not that of the stream at frame ${point.frame}`);
    }
    fields.end();
    this.#indexOffset = chunk.offset;
  }

  checkTail(chunk: Chunk): void {
    const fields = new Fields(chunk.payload);
    const same =
      fields.u32("frame_count") === this.#frameCount &&
      fields.u32("canonical_count") === this.#seekPoints.length &&
      fields.u64("index_offset") === BigInt(this.#indexOffset);
    demand(same, "tail-mismatch", "TAIL is not that of the stream");
    fields.end();
  }
}
