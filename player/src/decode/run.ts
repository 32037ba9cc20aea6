/** One opening or seek: from the first byte that is read to the last frame that is posted. */

import type { FramePacket, StreamInfo } from "../protocol.js";
import type { Post } from "./decoding.js";
import { Preview, SECTIONS_TO_SHOW } from "./preview.js";
import type { Decoder, Index, Quarc, State, StreamHead } from "./quarc.js";
import { Slots } from "./slots.js";
import type { StreamBytes } from "./stream-bytes.js";

const PREVIEW_PAUSE_MS = 250;
const NEVER = new AbortController().signal; // a seek does not abort the search for the index

/** What is known of the stream that is open; runs share it. */
export interface OpenStream {
  readonly bytes: StreamBytes;
  /** Of INDX; null until it has been read, and in streams without one. */
  index: Index | null;
  /** Ordinal of the first frame; null until it is known. */
  firstFrame: number | null;
  /** Whether the index is read before the first frame is posted. */
  readonly isIndexFirst: boolean;
  isIndexSought: boolean;
}

export class Run {
  readonly number: number;
  /** Ordinal of the frame that was posted last. */
  frame: number | null = null;
  readonly #stream: OpenStream;
  readonly #post: Post;
  readonly #ended = new AbortController();
  readonly #slots = new Slots();
  readonly #preview = new Preview();
  #credit = 0;
  #wake = (): void => undefined;
  #previewAt = -Infinity;
  #head: StreamHead | null = null;
  #hasUpdates = false;

  constructor(number: number, stream: OpenStream, post: Post) {
    this.number = number;
    this.#stream = stream;
    this.#post = post;
  }

  get isAborted(): boolean {
    return this.#ended.signal.aborted;
  }

  abort(): void {
    this.#ended.abort();
  }

  /** Allow so many more frames to be posted. */
  allow(frames: number): void {
    this.#credit += frames;
    this.#wake();
  }

  /** Post the frames from `start` to the end of the stream. */
  async play(quarc: Quarc, start: number): Promise<void> {
    const { bytes, isIndexFirst } = this.#stream;
    if (isIndexFirst) {
      await bytes.next(0, this.#ended.signal); // its answer tells whether the end can be read
      await this.#findIndex(quarc);
    }
    const decoder = quarc.open(start);
    try {
      this.#limit(decoder);
      await this.#postFrames(decoder, quarc);
    } finally {
      decoder.close();
    }
  }

  async #postFrames(decoder: Decoder, quarc: Quarc): Promise<void> {
    let begin = this.#stream.firstFrame === null ? 0 : null; // of the frame's chunks, if known
    let decodeMs = 0;
    for (;;) {
      await this.#waitForCredit();
      const begun = performance.now();
      const found = decoder.pull();
      decodeMs += performance.now() - begun;
      if (found === "end") break;
      if (found === null) {
        this.#postPreview(decoder);
        await this.#readOn(decoder);
        continue;
      }
      if (this.frame === null) this.#learn(decoder, found.frame);
      const end = decoder.offset;
      this.#postFrame(found, begin === null ? null : end - begin, decodeMs);
      [begin, decodeMs] = [end, 0];
      void this.#findIndex(quarc);
      await nextTask();
    }
    this.#postEnd();
  }

  /** Hand over the bytes that the decoder is waiting for. */
  async #readOn(decoder: Decoder): Promise<void> {
    const { bytes } = this.#stream;
    const range = decoder.missing();
    if (range === null) throw new Error("the decoder waits for nothing");
    const piece = await bytes.next(range.begin, this.#ended.signal);
    if (piece === null) decoder.limit(bytes.size ?? range.begin);
    else {
      decoder.put(piece.offset, piece.bytes);
      this.#limit(decoder);
    }
    const { received, size } = bytes;
    this.#post({ kind: "progress", bytes: received, byteLength: size, run: this.number }, []);
  }

  #limit(decoder: Decoder): void {
    const { size, isLive } = this.#stream.bytes;
    if (size !== null && !isLive) decoder.limit(size);
  }

  async #waitForCredit(): Promise<void> {
    const { signal } = this.#ended;
    while (this.#credit === 0 && !signal.aborted) {
      await new Promise<void>((resolve) => {
        this.#wake = resolve;
        signal.addEventListener("abort", () => resolve(), { once: true });
      });
    }
    signal.throwIfAborted();
  }

  /** Read the header of the stream at the first frame or preview, and post it if it is news. */
  #learn(decoder: Decoder, frame: number): void {
    this.#head = decoder.streamHead;
    this.#hasUpdates = decoder.hasUpdates;
    if (this.#stream.firstFrame !== null) return;
    this.#stream.firstFrame = frame;
    this.#postInfo(this.#head);
  }

  /**
   * Look for the index beside the frames, so that the first picture does not wait for the end of
   * the stream. What is wrong there is reported when a seek goes by it.
   */
  async #findIndex(quarc: Quarc): Promise<void> {
    const { bytes, isIndexSought } = this.#stream;
    if (isIndexSought || !bytes.isSeekable) return;
    this.#stream.isIndexSought = true;
    const decoder = quarc.open(0);
    try {
      await bytes.prefetchEnd();
      this.#limit(decoder);
      this.#stream.index = await this.#readIndex(decoder);
    } catch {
      return;
    } finally {
      decoder.close();
    }
    if (this.#stream.index !== null && this.#head !== null) this.#postInfo(this.#head);
  }

  async #readIndex(decoder: Decoder): Promise<Index | null> {
    for (;;) {
      const index = decoder.findIndex();
      const range = index === null ? decoder.missing() : null;
      if (range === null) return index;
      const piece = await this.#stream.bytes.next(range.begin, NEVER);
      if (piece === null) return null;
      decoder.put(piece.offset, piece.bytes);
    }
  }

  #postInfo(known: StreamHead): void {
    const { index, bytes, firstFrame } = this.#stream;
    const info: StreamInfo = {
      ...known,
      firstFrame: firstFrame ?? 0,
      frameCount: index?.frameCount ?? null,
      canonicalFrames: index?.canonicalFrames ?? [],
      ...{ byteLength: bytes.size, isLive: bytes.isLive },
    };
    this.#post({ kind: "info", info, run: this.number }, []);
  }

  /** Post what has arrived of the very first frame, if there is more to see than before. */
  #postPreview(decoder: Decoder): void {
    const isWanted = this.#stream.firstFrame === null || this.#previewAt > -Infinity;
    const begun = performance.now();
    if (!isWanted || this.frame !== null || begun < this.#previewAt + PREVIEW_PAUSE_MS) return;
    const found = decoder.preview();
    if (found === null) return;
    if (found.sections < SECTIONS_TO_SHOW) {
      this.#preview.prepare(found.state);
      return;
    }
    this.#previewAt = begun;
    this.#learn(decoder, found.state.frame);
    if (this.#head === null) return;
    const packet = this.#preview.make(found.state, found.sections, this.#head);
    this.#send({ ...packet, run: this.number, decodeMs: performance.now() - begun });
  }

  #postFrame(state: State, bytes: number | null, decodeMs: number): void {
    const begun = performance.now();
    const taken = this.#slots.take(state, this.#hasUpdates, { run: this.number, bytes, decodeMs });
    this.frame = taken.frame;
    this.#credit -= 1;
    this.#send({ ...taken, decodeMs: decodeMs + performance.now() - begun });
  }

  #send(packet: FramePacket): void {
    const { movedSlots, positions, rotations, codedSlots, codes, freedSlots } = packet;
    const arrays = [movedSlots, positions, rotations, codedSlots, codes, freedSlots];
    this.#post({ kind: "frame", packet }, arrays.map(({ buffer }) => buffer as ArrayBuffer));
  }

  #postEnd(): void {
    const { index, firstFrame } = this.#stream;
    const counted = (this.frame ?? -1) + 1 - (firstFrame ?? 0);
    const frameCount = index?.frameCount ?? Math.max(0, counted);
    this.#post({ kind: "end", frameCount, run: this.number }, []);
  }
}

/** Let messages in. */
function nextTask(): Promise<void> {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}
