/** The open stream: its bytes, its index, and its range of frames. */

import type { StreamSource } from "../protocol.js";
import { ChunkWalk } from "./chunk-walk.js";
import type { Decoder, StreamHead, StreamIndex, QuarcModule } from "./quarc.js";
import type { Piece } from "./source.js";
import { makeStreamBytes, type StreamBytes } from "./stream-bytes.js";

const READ_AHEAD_BYTES = 1 << 25; // of a live stream, received ahead of the decoder
const NEVER_ABORTED = new AbortController().signal; // a seek does not abort the search for the index

/** Receives bytes from an offset onwards; gives null at the end of the stream. */
export type ReceiveBytes = (offset: number) => Promise<Piece | null>;

export class OpenStream {
  readonly bytes: StreamBytes;
  /** Whether the index is read before the first frame is posted. */
  readonly isIndexFirst: boolean;
  /** Ordinal of the first frame; null until it is known. */
  firstFrame: number | null = null;
  /** Header, and the last cameras and metadata that have been read; null before the first frame or preview. */
  head: StreamHead | null = null;
  /** Offset of the chunk after the frame before which `head` changed; earlier chunks do not change it again. */
  headOffset = 0;
  /** The contents of INDX; null until the index has been read, and for streams without an index. */
  index: StreamIndex | null = null;
  /** Whether the contents of the index have been sent to the page. */
  isIndexPosted = false;
  readonly #chunkWalk: ChunkWalk;
  #indexSearch: Promise<void> | null = null;

  constructor(source: StreamSource, isIndexFirst: boolean) {
    this.bytes = makeStreamBytes(source);
    this.isIndexFirst = isIndexFirst;
    this.#chunkWalk = new ChunkWalk(this.bytes);
  }

  /** Tell a decoder the length of the stream, if it is final and the end can be read, because a seek then begins there. */
  setDecoderLength(decoder: Decoder): void {
    const { size, isLive, isSeekable } = this.bytes;
    if (size === null || isLive) return;
    if (isSeekable || this.bytes.findAvailable(size - 1) !== null) decoder.setLength(size);
  }

  /**
   * Look for the index while frames are decoded, so that the first picture does not wait for the end of the stream.
   * After an error, the index stays null.
   */
  async findIndex(quarc: QuarcModule): Promise<void> {
    if (this.bytes.isSeekable) await (this.#indexSearch ??= this.#searchIndex(quarc));
  }

  /** Return `frame`, or the last frame of the stream if the stream ends earlier. */
  async clampFrame(frame: number, quarc: QuarcModule, receiveBytes: ReceiveBytes): Promise<number> {
    await this.findIndex(quarc);
    const { index, firstFrame } = this;
    if (index !== null) return Math.min(frame, (firstFrame ?? 0) + index.frameCount - 1);
    const chunkWalk = this.#chunkWalk;
    while (!chunkWalk.advance() && (chunkWalk.lastFrame ?? -1) < frame) {
      if ((await receiveBytes(chunkWalk.nextOffset)) === null) break;
    }
    return Math.min(frame, chunkWalk.lastFrame ?? 0);
  }

  /** Ordinal of the newest frame of a live stream; null while unknown. */
  get liveEdge(): number | null {
    return this.bytes.isLive && this.#chunkWalk.advance() ? this.#chunkWalk.lastFrame : null;
  }

  /** Receive more of a live stream to find its newest frame; the decoder has reached `decodedOffset`. */
  async readAhead(decodedOffset: number, receiveBytes: ReceiveBytes): Promise<void> {
    const chunkWalk = this.#chunkWalk;
    while (this.bytes.isLive && !chunkWalk.hasEnded && chunkWalk.nextOffset < decodedOffset + READ_AHEAD_BYTES) {
      await receiveBytes(chunkWalk.nextOffset);
      chunkWalk.advance();
    }
  }

  async #searchIndex(quarc: QuarcModule): Promise<void> {
    const decoder = quarc.open(0);
    try {
      this.setDecoderLength(decoder);
      this.index = await this.#readIndex(decoder);
    } catch {
      return;
    } finally {
      decoder.close();
    }
  }

  async #readIndex(decoder: Decoder): Promise<StreamIndex | null> {
    for (;;) {
      const index = decoder.findIndex();
      const range = index === null ? decoder.missingRange() : null;
      if (range === null) return index;
      await this.bytes.prefetchEnd(range.begin); // a download from there would abort the download of the frames
      const piece = await this.bytes.readPiece(range.begin, NEVER_ABORTED);
      if (piece === null) return null;
      decoder.put(piece.offset, piece.bytes);
    }
  }
}
