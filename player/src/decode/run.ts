/** One opening or seek, from the first byte read to the last frame posted. */

import type { FramePacket, StreamInfo } from "../protocol.js";
import type { Post } from "./decoding.js";
import type { OpenStream } from "./open-stream.js";
import { Preview, SECTIONS_TO_SHOW } from "./preview.js";
import type { Decoder, Quarc, State, StreamHead } from "./quarc.js";
import { Slots } from "./slots.js";
import type { Piece } from "./source.js";
import { unlessAborted } from "./stream-bytes.js";

const PREVIEW_PAUSE_MS = 250;

export class Run {
  readonly number: number;
  /** Ordinal of the last posted frame. */
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
  #liveEdge: number | null = null; // as last posted
  #place = 0; // offset in the stream, after the last posted frame

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

  /** Allow more frames to be posted. */
  allow(frames: number): void {
    this.#credit += frames;
    this.#wake();
  }

  /**
   * Post the frames from `start` to the end of the stream; with `orLast`, the last frame if the stream ends before
   * `start`.
   */
  async play(quarc: Quarc, start: number, orLast = false): Promise<void> {
    const { bytes, isIndexFirst } = this.#stream;
    if (isIndexFirst) {
      await bytes.next(0, this.#ended.signal); // the response tells whether the end can be read
      await this.#stream.findIndex(quarc);
    }
    const decoder = quarc.open(orLast ? await this.#clamp(start, quarc) : start);
    try {
      this.#stream.limit(decoder);
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
      this.#place = decoder.offset;
      this.#postFrame(found, begin === null ? null : this.#place - begin, decodeMs);
      [begin, decodeMs] = [this.#place, 0];
      this.#postLiveEdge();
      void this.#findIndex(quarc);
      await nextTask();
    }
    this.#postEnd();
  }

  /** Pass the bytes that the decoder needs. */
  async #readOn(decoder: Decoder): Promise<void> {
    const { bytes } = this.#stream;
    const range = decoder.missing();
    if (range === null) throw new Error("the decoder lacks no bytes");
    const piece = await this.#receive(range.begin, this.#ended.signal);
    if (piece === null) decoder.limit(bytes.size ?? range.begin);
    else {
      decoder.put(piece.offset, piece.bytes);
      this.#stream.limit(decoder);
    }
    this.#postLiveEdge();
  }

  async #receive(place: number, signal: AbortSignal): Promise<Piece | null> {
    const { bytes } = this.#stream;
    const piece = await bytes.next(place, signal);
    this.#post({ kind: "progress", bytes: bytes.received, byteLength: bytes.size, run: this.number }, []);
    return piece;
  }

  /** The frame, or the last one of the stream if that comes first. */
  async #clamp(frame: number, quarc: Quarc): Promise<number> {
    const { signal } = this.#ended;
    const receive = (place: number): Promise<Piece | null> => this.#receive(place, signal);
    const clamped = await unlessAborted(this.#stream.clamp(frame, quarc, receive), signal);
    this.#postLiveEdge();
    return clamped;
  }

  /** While there is nothing to decode, follow a live stream. */
  async #readAhead(signal: AbortSignal): Promise<void> {
    const receive = async (place: number): Promise<Piece | null> => {
      this.#postLiveEdge();
      return this.#receive(place, signal);
    };
    // If the server fails, the error is reported when the bytes are decoded.
    await this.#stream.readAhead(this.#place, receive).catch(() => undefined);
  }

  #postLiveEdge(): void {
    const { liveEdge } = this.#stream;
    if (liveEdge === null || liveEdge === this.#liveEdge) return;
    this.#liveEdge = liveEdge;
    this.#post({ kind: "edge", frame: liveEdge, run: this.number }, []);
  }

  async #waitForCredit(): Promise<void> {
    const { signal } = this.#ended;
    const idle = new AbortController();
    if (this.#credit === 0) void this.#readAhead(idle.signal);
    while (this.#credit === 0 && !signal.aborted) {
      await new Promise<void>((resolve) => {
        this.#wake = resolve;
        signal.addEventListener("abort", () => resolve(), { once: true });
      });
    }
    idle.abort();
    signal.throwIfAborted();
  }

  /** Read the header of the stream at the first frame or preview, and post it if it is new. */
  #learn(decoder: Decoder, frame: number): void {
    this.#head = decoder.streamHead;
    this.#hasUpdates = decoder.hasUpdates;
    if (this.#stream.firstFrame !== null) return;
    this.#stream.firstFrame = frame;
    this.#postInfo(this.#head);
  }

  /** Look for the index, and post its contents. */
  async #findIndex(quarc: Quarc): Promise<void> {
    if (this.#stream.isIndexPosted) return;
    await this.#stream.findIndex(quarc);
    const { index, isIndexPosted } = this.#stream;
    if (index === null || this.#head === null || isIndexPosted) return;
    this.#postInfo(this.#head);
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
    this.#stream.isIndexPosted = index !== null;
    this.#post({ kind: "info", info, run: this.number }, []);
  }

  /** Post a preview of the first frame, if more of it has arrived. */
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

/** Let the worker receive messages. */
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
