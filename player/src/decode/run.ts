/** A run: decodes and posts frames after the stream is opened or after a seek. */

import type { FramePacket, PostReply, StreamInfo } from "../protocol.js";
import type { OpenStream } from "./open-stream.js";
import { Preview, MIN_PREVIEW_SECTIONS } from "./preview.js";
import type { Decoder, QuarcModule, FrameState } from "./quarc.js";
import { SlotTracker } from "./slots.js";
import type { Piece } from "./source.js";
import { unlessAborted } from "./stream-bytes.js";

const PREVIEW_INTERVAL_MS = 250;
const READ_AHEAD_RETRY_MS = 1000;
const TYPE_OFFSET = 4; // of a chunk
const ANCILLARY_BIT = 0x20; // of the first letter of a type (SPEC 5.2)

export class Run {
  readonly runNumber: number;
  /** Ordinal of the last posted frame; null before the first frame. */
  frame: number | null = null;
  readonly #stream: OpenStream;
  readonly #post: PostReply;
  readonly #abortController = new AbortController();
  readonly #slots = new SlotTracker();
  readonly #preview = new Preview();
  #frameCredit = 0;
  #wakeUp = (): void => undefined;
  #previewTime = -Infinity;
  #hasUpdates = false;
  #isFirst = false; // whether the decoder reads all chunks from HEAD on
  #postedLiveEdge: number | null = null;
  #decodedOffset = 0; // offset of the chunk after the last posted frame

  constructor(number: number, stream: OpenStream, post: PostReply) {
    this.runNumber = number;
    this.#stream = stream;
    this.#post = post;
  }

  get isAborted(): boolean {
    return this.#abortController.signal.aborted;
  }

  abort(): void {
    this.#abortController.abort();
    this.#wakeUp();
  }

  /** Allow `frames` more frames to be posted. */
  allow(frames: number): void {
    this.#frameCredit += frames;
    this.#wakeUp();
  }

  /**
   * Post the frames from `startFrame` to the end of the stream. If the stream ends before `startFrame` and `clampToLast`
   * is true, post the last frame.
   */
  async play(quarc: QuarcModule, startFrame: number, clampToLast = false): Promise<void> {
    const { bytes, isIndexFirst } = this.#stream;
    if (isIndexFirst) {
      await bytes.readPiece(0, this.#abortController.signal); // the response shows whether the end of the stream can be read
      await this.#stream.findIndex(quarc);
    }
    const decoder = quarc.open(clampToLast ? await this.#clampFrame(startFrame, quarc) : startFrame);
    try {
      this.#stream.setDecoderLength(decoder);
      await this.#postFrames(decoder, quarc);
    } finally {
      decoder.close();
    }
  }

  async #postFrames(decoder: Decoder, quarc: QuarcModule): Promise<void> {
    this.#isFirst = this.#stream.firstFrame === null;
    let beginOffset = this.#isFirst ? 0 : null; // offset of the frame's first chunk, if known
    let decodeMs = 0;
    for (;;) {
      await this.#waitForCredit();
      const startTime = performance.now();
      const result = decoder.decodeNext();
      decodeMs += performance.now() - startTime;
      if (result === "end") break;
      if (result === null) {
        this.#postPreview(decoder);
        await this.#feedDecoder(decoder);
        continue;
      }
      if (this.frame === null) this.#readHeader(decoder, result.frame);
      this.#decodedOffset = decoder.offset;
      this.#updateHead(decoder, beginOffset);
      this.#postFrame(result, beginOffset === null ? null : this.#decodedOffset - beginOffset, decodeMs);
      [beginOffset, decodeMs] = [this.#decodedOffset, 0];
      this.#postLiveEdge();
      void this.#findIndex(quarc);
      await yieldToMessages();
    }
    this.#updateHead(decoder, beginOffset);
    this.#postEnd();
  }

  /** Receive bytes that the decoder needs, and pass them to the decoder. */
  async #feedDecoder(decoder: Decoder): Promise<void> {
    const { bytes } = this.#stream;
    const range = decoder.missingRange();
    if (range === null) throw new Error("the decoder returned no frame, although no bytes are missing");
    const piece = await this.#receiveBytes(range.begin, this.#abortController.signal);
    if (piece === null) decoder.setLength(bytes.size ?? range.begin);
    else {
      decoder.put(piece.offset, piece.bytes);
      this.#stream.setDecoderLength(decoder);
    }
    this.#postLiveEdge();
  }

  async #receiveBytes(offset: number, signal: AbortSignal): Promise<Piece | null> {
    const { bytes } = this.#stream;
    const piece = await bytes.readPiece(offset, signal);
    this.#post({ kind: "progress", bytes: bytes.receivedBytes, byteLength: bytes.size, run: this.runNumber }, []);
    return piece;
  }

  /** Return `frame`, or the last frame of the stream if the stream ends earlier. */
  async #clampFrame(frame: number, quarc: QuarcModule): Promise<number> {
    const { signal } = this.#abortController;
    const receiveBytes = (offset: number): Promise<Piece | null> => this.#receiveBytes(offset, signal);
    const clampedFrame = await unlessAborted(this.#stream.clampFrame(frame, quarc, receiveBytes), signal);
    this.#postLiveEdge();
    return clampedFrame;
  }

  /** Find new frames of a live stream while no frame may be posted. */
  async #readAhead(signal: AbortSignal): Promise<void> {
    const receiveBytes = async (offset: number): Promise<Piece | null> => {
      const piece = await this.#receiveBytes(offset, signal);
      this.#postLiveEdge();
      return piece;
    };
    const readAhead = (): Promise<boolean> =>
      this.#stream.readAhead(this.#decodedOffset, receiveBytes).then(() => true, () => signal.aborted);
    // An error of the server is reported when the decoder needs the bytes.
    while (!(await readAhead())) await new Promise((resolve) => setTimeout(resolve, READ_AHEAD_RETRY_MS));
  }

  #postLiveEdge(): void {
    const { liveEdge } = this.#stream;
    if (liveEdge === null || liveEdge === this.#postedLiveEdge) return;
    this.#postedLiveEdge = liveEdge;
    this.#post({ kind: "edge", frame: liveEdge, run: this.runNumber }, []);
  }

  async #waitForCredit(): Promise<void> {
    const { signal } = this.#abortController;
    const idle = new AbortController();
    if (this.#frameCredit === 0) void this.#readAhead(idle.signal);
    while (this.#frameCredit === 0 && !signal.aborted) {
      await new Promise<void>((resolve) => (this.#wakeUp = resolve));
    }
    idle.abort();
    signal.throwIfAborted();
  }

  /** Read the header of the stream at the first frame or preview; post the description if this is the first run. */
  #readHeader(decoder: Decoder, frame: number): void {
    this.#hasUpdates = decoder.hasUpdates;
    if (this.#stream.firstFrame !== null) return;
    this.#stream.firstFrame = frame;
    this.#stream.head = decoder.streamHead;
    this.#postInfo();
  }

  /**
   * Post the description again if it has been changed by `came` or `meta` chunks before a frame or the end, whose first
   * chunk is at `beginOffset`. After a seek, the decoder does not know the chunks before the seek point.
   */
  #updateHead(decoder: Decoder, beginOffset: number | null): void {
    const stream = this.#stream;
    const { head } = stream;
    const typeLetter = beginOffset === null ? null : stream.bytes.findAvailable(beginOffset + TYPE_OFFSET)?.[0];
    const isFrame = ((typeLetter ?? ANCILLARY_BIT) & ANCILLARY_BIT) === 0;
    if (head === null || isFrame || this.#decodedOffset < stream.headOffset) return;
    const { cameras, metadata } = decoder;
    const newHead = {
      ...head,
      ...((this.#isFirst || cameras.length > 0) && { cameras }),
      ...((this.#isFirst || Object.keys(metadata).length > 0) && { metadata }),
    };
    if (JSON.stringify(newHead) === JSON.stringify(head)) return;
    stream.head = newHead;
    stream.headOffset = this.#decodedOffset;
    this.#postInfo();
  }

  /** Look for the index, and post its contents. */
  async #findIndex(quarc: QuarcModule): Promise<void> {
    await this.#stream.findIndex(quarc);
    const { index, isIndexPosted } = this.#stream;
    if (index !== null && !isIndexPosted) this.#postInfo();
  }

  #postInfo(): void {
    const { head, index, bytes, firstFrame } = this.#stream;
    if (head === null) return;
    const info: StreamInfo = {
      ...head,
      firstFrame: firstFrame ?? 0,
      frameCount: index?.frameCount ?? null,
      canonicalFrames: index?.canonicalFrames ?? [],
      ...{ byteLength: bytes.size, isLive: bytes.isLive },
    };
    this.#stream.isIndexPosted = index !== null;
    this.#post({ kind: "info", info, run: this.runNumber }, []);
  }

  /** Post a preview of the first frame if a further section has arrived. */
  #postPreview(decoder: Decoder): void {
    const isFirstFrame = this.#stream.firstFrame === null || this.#previewTime > -Infinity;
    const startTime = performance.now();
    if (!isFirstFrame || this.frame !== null || startTime < this.#previewTime + PREVIEW_INTERVAL_MS) return;
    const preview = decoder.preview();
    if (preview === null) return;
    if (preview.sections < MIN_PREVIEW_SECTIONS) {
      this.#preview.estimateSizes(preview.state);
      return;
    }
    this.#previewTime = startTime;
    this.#readHeader(decoder, preview.state.frame);
    const { head } = this.#stream;
    if (head === null) return;
    const packet = this.#preview.makePacket(preview.state, preview.sections, head);
    this.#postPacket({ ...packet, run: this.runNumber, decodeMs: performance.now() - startTime });
  }

  #postFrame(state: FrameState, bytes: number | null, decodeMs: number): void {
    const startTime = performance.now();
    const packet = this.#slots.makePacket(state, this.#hasUpdates, { run: this.runNumber, bytes, decodeMs });
    this.frame = packet.frame;
    this.#frameCredit -= 1;
    this.#postPacket({ ...packet, decodeMs: decodeMs + performance.now() - startTime });
  }

  #postPacket(packet: FramePacket): void {
    const { movedSlots, positions, rotations, codedSlots, codes, freedSlots, bornSlots } = packet;
    const arrays = [movedSlots, positions, rotations, codedSlots, codes, freedSlots, bornSlots];
    this.#post({ kind: "frame", packet }, arrays.map(({ buffer }) => buffer as ArrayBuffer));
  }

  #postEnd(): void {
    const { index, firstFrame } = this.#stream;
    const decodedCount = (this.frame ?? -1) + 1 - (firstFrame ?? 0);
    const frameCount = index?.frameCount ?? Math.max(0, decodedCount);
    this.#post({ kind: "end", frameCount, run: this.runNumber }, []);
  }
}

/** Resolve in a new task, so that the worker can receive messages. */
function yieldToMessages(): Promise<void> {
  return new Promise((resolve) => {
    const { port1, port2 } = new MessageChannel();
    port1.onmessage = () => {
      port1.close();
      resolve();
    };
    port2.postMessage(null);
  });
}
