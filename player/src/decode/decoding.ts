/**
 * What the decode worker does: takes requests, and posts frames no faster than they are asked for.
 *
 * Nothing of a page or a worker is needed here: a program can run it by itself.
 */

import type { DecodeReply, DecodeRequest, StreamInfo } from "../protocol.js";
import { describe } from "./fault.js";
import { PartReader, readEnd } from "./part-reader.js";
import { Quarc, type Decoder, type State } from "./quarc.js";
import { Slots } from "./slots.js";
import { makeSource, type ByteSource, type Piece } from "./source.js";

export type Post = (reply: DecodeReply, transferred: ArrayBuffer[]) => void;

/** The frames of one opening or seek. */
interface Run {
  readonly number: number;
  readonly abort: AbortController;
  /** Frames that may still be posted. */
  credit: number;
  /** Tell that there is more credit. */
  wake: () => void;
}

/** What is known of the stream that is open. */
interface Stream {
  readonly source: ByteSource;
  /** Its first and last bytes, which every seek asks for. */
  ends: readonly Piece[];
  index: { frameCount: number; canonicalFrames: number[] } | null;
  /** Ordinal of its first frame; null before that is decoded. */
  firstFrame: number | null;
}

export class Decoding {
  readonly #post: Post;
  #run: Run | null = null;
  #stream: Stream | null = null;
  #done: Promise<void> = Promise.resolve();

  constructor(post: Post) {
    this.#post = post;
  }

  /** Do what a page asks for. */
  take(request: DecodeRequest): void {
    if (request.kind === "more") {
      if (this.#run?.number !== request.run) return;
      this.#run.credit += request.frames;
      this.#run.wake();
      return;
    }
    this.#run?.abort.abort();
    this.#run = null;
    if (request.kind === "close") return;
    if (request.kind === "open") {
      const source = makeSource(request.source);
      this.#stream = { source, ends: [], index: null, firstFrame: null };
    }
    this.#begin(request.run, request.kind === "open" ? 0 : request.frame);
  }

  #begin(number: number, start: number): void {
    const run = { number, abort: new AbortController(), credit: 0, wake: () => undefined };
    this.#run = run;
    // One after the other: the run before lets go of its decoder first.
    this.#done = this.#done.then(() => this.#play(run, start));
  }

  async #play(run: Run, start: number): Promise<void> {
    const stream = this.#stream;
    if (stream === null || run.abort.signal.aborted) return;
    const playing = new Playing(run, stream, this.#post);
    try {
      await playing.begin(start);
      await playing.go();
    } catch (error) {
      if (run.abort.signal.aborted) return;
      const frame = playing.frame === null ? null : playing.frame + 1;
      this.#post({ kind: "error", error: describe(error, frame), run: run.number }, []);
    } finally {
      await playing.close();
    }
  }
}

/** One run, from the first byte that is read to the last frame that is posted. */
class Playing {
  /** Ordinal of the last frame. */
  frame: number | null = null;
  readonly #run: Run;
  readonly #stream: Stream;
  readonly #post: Post;
  readonly #reader: PartReader;
  readonly #slots = new Slots();
  #decoder: Decoder | null = null;
  #hasUpdates = false;

  constructor(run: Run, stream: Stream, post: Post) {
    this.#run = run;
    this.#stream = stream;
    this.#post = post;
    this.#reader = new PartReader(stream.source, run.abort.signal);
  }

  /** Make a decoder that knows the ends of the stream. */
  async begin(start: number): Promise<void> {
    const quarc = await Quarc.load();
    this.#decoder = quarc.open(start);
    if (this.#stream.ends.length === 0) await this.#readEnds(quarc);
    for (const { offset, bytes } of this.#stream.ends) this.#decoder.put(offset, bytes);
    this.#limit(this.#decoder);
  }

  /** Post frames up to the end of the stream. */
  async go(): Promise<void> {
    const decoder = this.#decoder as Decoder;
    let begin = this.#stream.firstFrame === null ? 0 : null; // of the frame's chunks, where known
    let decodeMs = 0;
    for (;;) {
      await this.#waitForCredit();
      const begun = performance.now();
      const found = decoder.pull();
      decodeMs += performance.now() - begun;
      if (found === "end") break;
      if (found === null) {
        await this.#readOn(decoder);
        continue;
      }
      if (this.frame === null) this.#hasUpdates = decoder.hasUpdates;
      if (this.#stream.firstFrame === null) this.#tellInfo(decoder, found);
      const end = decoder.offset;
      this.#tellFrame(found, begin === null ? 0 : end - begin, decodeMs);
      [begin, decodeMs] = [end, 0];
      await nextTask();
    }
    this.#tellEnd();
  }

  async close(): Promise<void> {
    this.#decoder?.close();
    this.#decoder = null;
    await this.#reader.close();
  }

  /** The first bytes and, where a server gives any place, the last; of a live stream none yet. */
  async #readEnds(quarc: Quarc): Promise<void> {
    const { source } = this.#stream;
    const first = await this.#reader.next({ begin: 0, end: 1 });
    if (first === null) return;
    this.#stream.ends = [first];
    const { size, hasRanges, isLive } = source;
    if (size === null || !hasRanges || isLive) return;
    if (first.bytes.length < size) {
      this.#stream.ends = [first, await readEnd(source, size, this.#run.abort.signal)];
    }
    await this.#readIndex(quarc, size);
  }

  /** What INDX says, for the page; what is wrong there is told when a seek goes by it. */
  async #readIndex(quarc: Quarc, size: number): Promise<void> {
    const decoder = quarc.open(0);
    const reader = new PartReader(this.#stream.source, this.#run.abort.signal);
    try {
      for (const { offset, bytes } of this.#stream.ends) decoder.put(offset, bytes);
      decoder.limit(size);
      while ((this.#stream.index = decoder.findIndex()) === null) {
        const range = decoder.missing();
        const piece = range === null ? null : await reader.next(range);
        if (piece === null) return;
        decoder.put(piece.offset, piece.bytes);
      }
    } finally {
      decoder.close();
      await reader.close();
    }
  }

  /** Hand over the bytes that a decoder lacks. */
  async #readOn(decoder: Decoder): Promise<void> {
    const range = decoder.missing();
    if (range === null) throw new Error("a decoder that waits for nothing");
    const piece = await this.#reader.next(range);
    if (piece === null) {
      decoder.limit(this.#stream.source.size ?? range.begin);
      return;
    }
    decoder.put(piece.offset, piece.bytes);
    this.#limit(decoder);
    const { received } = this.#reader;
    const byteLength = this.#stream.source.size;
    this.#post({ kind: "progress", bytes: received, byteLength, run: this.#run.number }, []);
  }

  #limit(decoder: Decoder): void {
    const { size, isLive } = this.#stream.source;
    if (size !== null && !isLive) decoder.limit(size);
  }

  async #waitForCredit(): Promise<void> {
    const { abort } = this.#run;
    while (this.#run.credit === 0 && !abort.signal.aborted) {
      await new Promise<void>((resolve) => {
        this.#run.wake = resolve;
        abort.signal.addEventListener("abort", () => resolve(), { once: true });
      });
    }
    abort.signal.throwIfAborted();
  }

  #tellInfo(decoder: Decoder, { frame }: State): void {
    const { head } = decoder;
    if (head === null) throw new Error("a frame before HEAD");
    const { index, source } = this.#stream;
    this.#stream.firstFrame = index?.canonicalFrames[0] ?? frame;
    const info: StreamInfo = {
      ...head,
      ...{ cameras: decoder.cameras, metadata: decoder.metadata, firstFrame: this.#stream.firstFrame },
      frameCount: index?.frameCount ?? null,
      canonicalFrames: index?.canonicalFrames ?? [],
      ...{ byteLength: source.size, isLive: source.isLive },
    };
    this.#post({ kind: "info", info, run: this.#run.number }, []);
  }

  #tellFrame(state: State, bytes: number, decodeMs: number): void {
    const run = this.#run.number;
    const begun = performance.now();
    const { frame } = state;
    const taken = this.#slots.take(state, this.#hasUpdates, { run, bytes, decodeMs });
    const packet = { ...taken, decodeMs: decodeMs + performance.now() - begun };
    this.frame = frame;
    this.#run.credit -= 1;
    const { movedSlots, positions, rotations, codedSlots, codes, freedSlots } = packet;
    const arrays = [movedSlots, positions, rotations, codedSlots, codes, freedSlots];
    this.#post({ kind: "frame", packet }, arrays.map(({ buffer }) => buffer as ArrayBuffer));
  }

  #tellEnd(): void {
    const { index, firstFrame } = this.#stream;
    const counted = (this.frame ?? -1) + 1 - (firstFrame ?? 0);
    const frameCount = index?.frameCount ?? Math.max(0, counted);
    this.#post({ kind: "end", frameCount, run: this.#run.number }, []);
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
