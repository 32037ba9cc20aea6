/**
 * The decoder (core/wasm).
 *
 * Arrays that it returns are views of the module's memory, valid until the next call.
 */

import compressed from "wasm:quarc";
import type { CaptureCamera, StreamInfo } from "../protocol.js";
import type { Functions } from "./functions.js";
import { readCamera, readHead, type Head } from "./layout.js";

const STATUS = { OK: 0, FRAME: 1, END: 3, MISUSE: -3 };
const SCRATCH_BYTES = 256;

/** A stream is invalid by the rule `rejectId` of SPEC 3.3; or too large, if that is null. */
export class QuarcError extends Error {
  override readonly name = "QuarcError";
  constructor(
    message: string,
    readonly rejectId: string | null,
  ) {
    super(message);
  }
}

/** The state of a frame: planes of `count` numbers. */
export interface State {
  readonly frame: number;
  /** Frames since the canonical one. */
  readonly phase: number;
  readonly count: number;
  /** Ascending. */
  readonly ids: Uint32Array;
  readonly positions: readonly Int32Array[];
  readonly rotations: readonly Int32Array[];
  readonly codes: readonly Int16Array[];
}

/** The contents of the index at the end of a stream. */
export interface Index {
  readonly frameCount: number;
  readonly canonicalFrames: readonly number[];
}

/** The description of a stream that precedes its first frame. */
export type StreamHead = Head & Pick<StreamInfo, "cameras" | "metadata">;

/** A range of bytes of a stream; the end is exclusive. */
export interface Range {
  readonly begin: number;
  readonly end: number;
}

type NumberArray<T> = new (buffer: ArrayBufferLike, place: number, length: number) => T;

let compiled: Promise<WebAssembly.Module> | null = null;

/** The module; it is compiled once. */
export class Quarc {
  readonly functions: Functions;
  readonly scratch: number;

  static async load(): Promise<Quarc> {
    compiled ??= compile();
    return new Quarc(await WebAssembly.instantiate(await compiled, {}));
  }

  private constructor(instance: WebAssembly.Instance) {
    this.functions = instance.exports as unknown as Functions;
    this.scratch = this.functions.quarc_allocate(SCRATCH_BYTES);
  }

  get memoryBytes(): number {
    return this.functions.memory.buffer.byteLength;
  }

  /** A decoder of the frames from `start` on. */
  open(start: number): Decoder {
    return new Decoder(this, this.functions.quarc_open_parts(start));
  }

  view<T>(type: NumberArray<T>, place: number, length: number): T {
    return new type(this.functions.memory.buffer, place, length);
  }

  text(place: number, length: number): string {
    return new TextDecoder().decode(this.view(Uint8Array, place, length).slice());
  }

  /** The zero-terminated text at an address; null for address 0. */
  textAt(place: number): string | null {
    if (place === 0) return null;
    const bytes = new Uint8Array(this.functions.memory.buffer, place);
    return this.text(place, bytes.indexOf(0));
  }

  /** Allocate memory in the module for the duration of `use`. */
  lend<T>(size: number, use: (place: number) => T): T {
    const place = this.functions.quarc_allocate(size);
    if (place === 0) throw new QuarcError(`cannot allocate ${size} bytes`, null);
    try {
      return use(place);
    } finally {
      this.functions.quarc_free(place, size);
    }
  }
}

/** A decoder that reads byte ranges of a stream. */
export class Decoder {
  readonly #quarc: Quarc;
  readonly #call: Functions;
  #handle: number;

  constructor(quarc: Quarc, handle: number) {
    this.#quarc = quarc;
    this.#call = quarc.functions;
    this.#handle = handle;
  }

  /** Pass bytes at an offset of the stream. */
  put(offset: number, bytes: Uint8Array): void {
    this.#quarc.lend(bytes.length, (place) => {
      this.#quarc.view(Uint8Array, place, bytes.length).set(bytes);
      this.#check(this.#call.quarc_put(this.#handle, BigInt(offset), place, bytes.length));
    });
  }

  /** Set the length of the whole stream in bytes. */
  limit(size: number): void {
    this.#check(this.#call.quarc_limit(this.#handle, BigInt(size)));
  }

  /** The next frame, "end", or null if bytes are missing. */
  pull(): State | "end" | null {
    const { scratch } = this.#quarc;
    const status = this.#check(this.#call.quarc_pull(this.#handle, scratch));
    if (status === STATUS.FRAME) return this.#readState();
    return status === STATUS.END ? "end" : null;
  }

  /**
   * After `pull` returned null: a preview of a canonical frame that is still arriving, and the number of its sections
   * that have been decoded (SPEC 8.5); null if there is nothing new since the last call.
   */
  preview(): { state: State; sections: number } | null {
    const { scratch } = this.#quarc;
    const count = scratch + SCRATCH_BYTES - 4;
    if (this.#check(this.#call.quarc_preview(this.#handle, scratch, count)) !== STATUS.FRAME) return null;
    const [sections = 0] = this.#quarc.view(Uint32Array, count, 1);
    return { state: this.#readState(), sections };
  }

  /** The range of bytes that `pull` or `findIndex` lacked; null if none are missing. */
  missing(): Range | null {
    const { scratch } = this.#quarc;
    if (this.#call.quarc_missing(this.#handle, scratch) !== STATUS.OK) return null;
    const [begin, end] = this.#quarc.view(BigUint64Array, scratch, 2);
    return { begin: Number(begin), end: Number(end) };
  }

  /** Offset of the chunk after the last frame. */
  get offset(): number {
    const { scratch } = this.#quarc;
    this.#check(this.#call.quarc_offset(this.#handle, scratch));
    return Number(this.#quarc.view(BigUint64Array, scratch, 1)[0]);
  }

  /** The number of frames, and the canonical ones; null while INDX is not available. */
  findIndex(): Index | null {
    const { scratch } = this.#quarc;
    const ask = (place: number, room: number) =>
      this.#call.quarc_index(this.#handle, scratch, place, room) === STATUS.FRAME;
    if (!ask(scratch + 8, 0)) return null;
    const [frameCount = 0, count = 0] = this.#quarc.view(Uint32Array, scratch, 2);
    return this.#quarc.lend(4 * count, (place) => {
      ask(place, count);
      return { frameCount, canonicalFrames: [...this.#quarc.view(Uint32Array, place, count)] };
    });
  }

  /** Header, cameras and metadata, available with the first frame or preview. */
  get streamHead(): StreamHead {
    const { head, cameras, metadata } = this;
    if (head === null) throw new Error("a frame before the header");
    return { ...head, cameras, metadata };
  }

  /** The header; null before it has been read. */
  get head(): Head | null {
    const { scratch } = this.#quarc;
    if (this.#call.quarc_head(this.#handle, scratch) !== STATUS.OK) return null;
    return readHead(this.#memory, scratch);
  }

  /** Whether frames may change the codes of existing Gaussians. */
  get hasUpdates(): boolean {
    const { scratch } = this.#quarc;
    this.#check(this.#call.quarc_head(this.#handle, scratch));
    return this.#quarc.view(Uint32Array, scratch, 13)[12] === 1;
  }

  get cameras(): CaptureCamera[] {
    const { scratch } = this.#quarc;
    const cameras: CaptureCamera[] = [];
    while (this.#call.quarc_camera(this.#handle, cameras.length, scratch) === STATUS.OK) {
      cameras.push(readCamera(this.#memory, scratch, this.#readText(scratch)));
    }
    return cameras;
  }

  get metadata(): Record<string, string> {
    const { scratch } = this.#quarc;
    const entries: [string, string][] = [];
    while (this.#call.quarc_metadata(this.#handle, entries.length, scratch) === STATUS.OK) {
      entries.push([this.#readText(scratch), this.#readText(scratch + 8)]);
    }
    return Object.fromEntries(entries);
  }

  /** Free the decoder and all memory that it returned; a second call does nothing. */
  close(): void {
    const { scratch } = this.#quarc;
    this.#quarc.view(Uint32Array, scratch, 1)[0] = this.#handle;
    this.#call.quarc_close(scratch);
    this.#handle = 0;
  }

  get #memory(): DataView {
    return new DataView(this.#call.memory.buffer);
  }

  #readText(view: number): string {
    const [place = 0, length = 0] = this.#quarc.view(Uint32Array, view, 2);
    return this.#quarc.text(place, length);
  }

  #readState(): State {
    const numbers = this.#quarc.view(Uint32Array, this.#quarc.scratch, 11);
    const at = (place: number): number => numbers[place] ?? 0;
    const count = at(2);
    const planes = <T>(type: NumberArray<T>, place: number, bytes: number, number: number) =>
      Array.from({ length: number }, (_, row) =>
        this.#quarc.view(type, at(place) + bytes * row * at(place + 1), count),
      );
    return {
      ...{ frame: at(0), phase: at(1), count },
      ids: this.#quarc.view(Uint32Array, at(3), count),
      positions: planes(Int32Array, 4, 4, 3),
      rotations: planes(Int32Array, 6, 4, 4),
      codes: planes(Int16Array, 8, 2, at(10)),
    };
  }

  #check(status: number): number {
    if (status >= 0) return status;
    if (status === STATUS.MISUSE) throw new Error("invalid call");
    const message = this.#quarc.textAt(this.#call.quarc_message(this.#handle));
    const rejectId = this.#quarc.textAt(this.#call.quarc_reject_id(this.#handle));
    throw new QuarcError(message ?? "the decoder is broken", rejectId);
  }
}

async function compile(): Promise<WebAssembly.Module> {
  const letters = atob(compressed);
  const bytes = new Uint8Array(letters.length);
  for (let at = 0; at < bytes.length; at++) bytes[at] = letters.charCodeAt(at);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

