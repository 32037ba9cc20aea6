/** The open stream: its bytes, its index, and its extent. */

import type { StreamSource } from "../protocol.js";
import { ChunkWalk } from "./chunk-walk.js";
import type { Decoder, Index, Quarc } from "./quarc.js";
import type { Piece } from "./source.js";
import { makeStreamBytes, type StreamBytes } from "./stream-bytes.js";

const LEAD_BYTES = 1 << 25; // of a live stream, received ahead of decoding
const NEVER = new AbortController().signal; // a seek does not abort the search for the index

/** Receives bytes from an offset on; null at the end of the stream. */
export type Receive = (place: number) => Promise<Piece | null>;

export class OpenStream {
  readonly bytes: StreamBytes;
  /** Whether the index is read before the first frame is posted. */
  readonly isIndexFirst: boolean;
  /** Ordinal of the first frame; null until it is known. */
  firstFrame: number | null = null;
  /** From INDX; null until it has been read, and in streams without one. */
  index: Index | null = null;
  /** Whether the contents of the index have been sent to the page. */
  isIndexPosted = false;
  readonly #walk: ChunkWalk;
  #search: Promise<void> | null = null;

  constructor(source: StreamSource, isIndexFirst: boolean) {
    this.bytes = makeStreamBytes(source);
    this.isIndexFirst = isIndexFirst;
    this.#walk = new ChunkWalk(this.bytes);
  }

  /** Set the length of the stream in a decoder, if it is known. */
  limit(decoder: Decoder): void {
    const { size, isLive } = this.bytes;
    if (size !== null && !isLive) decoder.limit(size);
  }

  /**
   * Look for the index in parallel with the frames, so that the first picture does not wait for the end of the stream.
   * Errors are reported when a seek uses the index.
   */
  async findIndex(quarc: Quarc): Promise<void> {
    if (this.bytes.isSeekable) await (this.#search ??= this.#searchIndex(quarc));
  }

  /** The frame, or the last one of the stream if that comes first. */
  async clamp(frame: number, quarc: Quarc, receive: Receive): Promise<number> {
    await this.findIndex(quarc);
    const { index, firstFrame } = this;
    if (index !== null) return Math.min(frame, (firstFrame ?? 0) + index.frameCount - 1);
    const walk = this.#walk;
    while (!walk.advance() && (walk.lastFrame ?? -1) < frame) {
      if ((await receive(walk.place)) === null) break;
    }
    return Math.min(frame, walk.lastFrame ?? 0);
  }

  /** Ordinal of the newest frame of a live stream; null while unknown. */
  get liveEdge(): number | null {
    return this.bytes.isLive && this.#walk.advance() ? this.#walk.lastFrame : null;
  }

  /** Receive more of a live stream to find its live edge; `place` is the position of decoding. */
  async readAhead(place: number, receive: Receive): Promise<void> {
    const walk = this.#walk;
    while (this.bytes.isLive && !walk.isEnded && walk.place < place + LEAD_BYTES) {
      await receive(walk.place);
      walk.advance();
    }
  }

  async #searchIndex(quarc: Quarc): Promise<void> {
    const decoder = quarc.open(0);
    try {
      await this.bytes.prefetchEnd();
      this.limit(decoder);
      this.index = await this.#readIndex(decoder);
    } catch {
      return;
    } finally {
      decoder.close();
    }
  }

  async #readIndex(decoder: Decoder): Promise<Index | null> {
    for (;;) {
      const index = decoder.findIndex();
      const range = index === null ? decoder.missing() : null;
      if (range === null) return index;
      const piece = await this.bytes.next(range.begin, NEVER);
      if (piece === null) return null;
      decoder.put(piece.offset, piece.bytes);
    }
  }
}
