/**
 * The decoder, a WebAssembly module (core/wasm).
 *
 * Returned arrays are views of the module's memory; they are valid until the next call.
 */

import compressed from "wasm:quarc";
import type { CaptureCamera, StreamInfo } from "../protocol.js";
import type { Functions } from "./functions.js";
import { readCamera, readHead, type HeadFields } from "./layout.js";

const STATUS = { OK: 0, FRAME: 1, END: 3, MISUSE: -3 };
const SCRATCH_BYTES = 256;

/** A stream breaks the rule `rejectId` of SPEC 3.3 or, if `rejectId` is null, is too large for this machine. */
export class QuarcError extends Error {
  override readonly name = "QuarcError";
  constructor(
    message: string,
    readonly rejectId: string | null,
  ) {
    super(message);
  }
}

/** The module cannot be compiled or instantiated, because WebAssembly is missing or forbidden, or memory is short. */
export class ModuleError extends Error {
  override readonly name = "ModuleError";
}

/** The state of a frame (SPEC 7.1), as planes of `count` numbers. */
export interface FrameState {
  readonly frame: number;
  /** Number of frames since the last canonical frame. */
  readonly phase: number;
  readonly count: number;
  /** [count] ids of the Gaussians, ascending. */
  readonly ids: Uint32Array;
  readonly positions: readonly Int32Array[];
  readonly rotations: readonly Int32Array[];
  readonly codes: readonly Int16Array[];
}

/** The contents of the index at the end of a stream. */
export interface StreamIndex {
  readonly frameCount: number;
  readonly canonicalFrames: readonly number[];
}

/** The description of a stream that precedes its first frame. */
export type StreamHead = HeadFields & Pick<StreamInfo, "cameras" | "metadata">;

/** A range of bytes of a stream; `end` is exclusive. */
export interface ByteRange {
  readonly begin: number;
  readonly end: number;
}

type TypedArrayConstructor<T> = new (buffer: ArrayBufferLike, address: number, length: number) => T;

let compiledModule: Promise<WebAssembly.Module> | null = null;

/** An instance of the WebAssembly module, which is compiled only once. */
export class QuarcModule {
  readonly functions: Functions;
  readonly scratchAddress: number;

  /** Load the module; after a ModuleError, this can be tried again. */
  static async load(): Promise<QuarcModule> {
    try {
      const compiled = await (compiledModule ??= compileModule());
      return new QuarcModule(await WebAssembly.instantiate(compiled, {}));
    } catch (error) {
      compiledModule = null;
      throw new ModuleError(`the decoder cannot be loaded: ${String(error)}`);
    }
  }

  private constructor(instance: WebAssembly.Instance) {
    this.functions = instance.exports as unknown as Functions;
    this.scratchAddress = this.functions.quarc_allocate(SCRATCH_BYTES) >>> 0;
  }

  /** Create a decoder of the frames from `start` onwards. */
  open(start: number): Decoder {
    return new Decoder(this, this.functions.quarc_open_parts(start));
  }

  viewMemory<T>(type: TypedArrayConstructor<T>, address: number, length: number): T {
    return new type(this.functions.memory.buffer, address, length);
  }

  readText(address: number, length: number): string {
    return new TextDecoder().decode(this.viewMemory(Uint8Array, address, length).slice());
  }

  /** Read the zero-terminated text at an address; return null for address 0. */
  readZeroTerminated(signedAddress: number): string | null {
    const address = signedAddress >>> 0;
    if (address === 0) return null;
    const bytes = new Uint8Array(this.functions.memory.buffer, address);
    return this.readText(address, bytes.indexOf(0));
  }

  /** Allocate memory in the module while `useMemory` runs; return its result. */
  withMemory<T>(size: number, useMemory: (address: number) => T): T {
    const address = this.functions.quarc_allocate(size) >>> 0;
    if (address === 0) throw new QuarcError(`cannot allocate ${size} bytes`, null);
    try {
      return useMemory(address);
    } finally {
      this.functions.quarc_free(address, size);
    }
  }
}

/** A decoder of a stream whose bytes are passed in ranges. */
export class Decoder {
  readonly #quarc: QuarcModule;
  readonly #functions: Functions;
  #handle: number;

  constructor(quarc: QuarcModule, handle: number) {
    this.#quarc = quarc;
    this.#functions = quarc.functions;
    this.#handle = handle;
  }

  /** Pass the bytes at an offset of the stream to the decoder. */
  put(offset: number, bytes: Uint8Array): void {
    this.#quarc.withMemory(bytes.length, (address) => {
      this.#quarc.viewMemory(Uint8Array, address, bytes.length).set(bytes);
      this.#checkStatus(this.#functions.quarc_put(this.#handle, BigInt(offset), address, bytes.length));
    });
  }

  /** Set the length of the whole stream in bytes. */
  setLength(size: number): void {
    this.#checkStatus(this.#functions.quarc_limit(this.#handle, BigInt(size)));
  }

  /** Decode the next frame; return "end" after the last frame, and null if bytes are missing. */
  decodeNext(): FrameState | "end" | null {
    const { scratchAddress } = this.#quarc;
    const status = this.#checkStatus(this.#functions.quarc_pull(this.#handle, scratchAddress));
    if (status === STATUS.FRAME) return this.#readState();
    return status === STATUS.END ? "end" : null;
  }

  /**
   * After `decodeNext` has returned null, decode a canonical frame that is still arriving. Return its incomplete state
   * and the number of decoded sections (SPEC 8.5), or null if no further section has arrived since the last call.
   */
  preview(): { state: FrameState; sections: number } | null {
    const { scratchAddress } = this.#quarc;
    const countAddress = scratchAddress + SCRATCH_BYTES - 4;
    const status = this.#functions.quarc_preview(this.#handle, scratchAddress, countAddress);
    if (this.#checkStatus(status) !== STATUS.FRAME) return null;
    const [sections = 0] = this.#quarc.viewMemory(Uint32Array, countAddress, 1);
    return { state: this.#readState(), sections };
  }

  /** The range of bytes that the last call of `decodeNext` or `findIndex` needs; null if no bytes are missing. */
  missingRange(): ByteRange | null {
    const { scratchAddress } = this.#quarc;
    if (this.#functions.quarc_missing(this.#handle, scratchAddress) !== STATUS.OK) return null;
    const [begin, end] = this.#quarc.viewMemory(BigUint64Array, scratchAddress, 2);
    return { begin: Number(begin), end: Number(end) };
  }

  /** Offset of the chunk after the last decoded frame. */
  get offset(): number {
    const { scratchAddress } = this.#quarc;
    this.#checkStatus(this.#functions.quarc_offset(this.#handle, scratchAddress));
    return Number(this.#quarc.viewMemory(BigUint64Array, scratchAddress, 1)[0]);
  }

  /** Read the index; return null while the bytes of INDX are not available. */
  findIndex(): StreamIndex | null {
    const { scratchAddress } = this.#quarc;
    const readIndex = (address: number, capacity: number) =>
      this.#functions.quarc_index(this.#handle, scratchAddress, address, capacity) === STATUS.FRAME;
    if (!readIndex(scratchAddress + 8, 0)) return null;
    const [frameCount = 0, count = 0] = this.#quarc.viewMemory(Uint32Array, scratchAddress, 2);
    return this.#quarc.withMemory(4 * count, (address) => {
      readIndex(address, count);
      return { frameCount, canonicalFrames: [...this.#quarc.viewMemory(Uint32Array, address, count)] };
    });
  }

  /** Header, cameras and metadata, available with the first frame or preview. */
  get streamHead(): StreamHead {
    const { head, cameras, metadata } = this;
    if (head === null) throw new Error("the decoder returned a frame before the header");
    return { ...head, cameras, metadata };
  }

  /** The header; null before it has been read. */
  get head(): HeadFields | null {
    const { scratchAddress } = this.#quarc;
    if (this.#functions.quarc_head(this.#handle, scratchAddress) !== STATUS.OK) return null;
    return readHead(this.#memory, scratchAddress);
  }

  /** Whether frames may contain updates (SPEC 7.8), which change the codes of existing Gaussians. */
  get hasUpdates(): boolean {
    const { scratchAddress } = this.#quarc;
    this.#checkStatus(this.#functions.quarc_head(this.#handle, scratchAddress));
    return this.#quarc.viewMemory(Uint32Array, scratchAddress, 13)[12] === 1;
  }

  get cameras(): CaptureCamera[] {
    const { scratchAddress } = this.#quarc;
    const cameras: CaptureCamera[] = [];
    while (this.#functions.quarc_camera(this.#handle, cameras.length, scratchAddress) === STATUS.OK) {
      cameras.push(readCamera(this.#memory, scratchAddress, this.#readText(scratchAddress)));
    }
    return cameras;
  }

  get metadata(): Record<string, string> {
    const { scratchAddress } = this.#quarc;
    const entries: [string, string][] = [];
    while (this.#functions.quarc_metadata(this.#handle, entries.length, scratchAddress) === STATUS.OK) {
      entries.push([this.#readText(scratchAddress), this.#readText(scratchAddress + 8)]);
    }
    return Object.fromEntries(entries);
  }

  /** Free the decoder and all memory that it returned; a second call does nothing. */
  close(): void {
    const { scratchAddress } = this.#quarc;
    this.#quarc.viewMemory(Uint32Array, scratchAddress, 1)[0] = this.#handle;
    this.#functions.quarc_close(scratchAddress);
    this.#handle = 0;
  }

  get #memory(): DataView {
    return new DataView(this.#functions.memory.buffer);
  }

  #readText(viewAddress: number): string {
    const [address = 0, length = 0] = this.#quarc.viewMemory(Uint32Array, viewAddress, 2);
    return this.#quarc.readText(address, length);
  }

  #readState(): FrameState {
    const fields = this.#quarc.viewMemory(Uint32Array, this.#quarc.scratchAddress, 11);
    const field = (fieldIndex: number): number => fields[fieldIndex] ?? 0;
    const count = field(2);
    const viewPlanes = <T>(type: TypedArrayConstructor<T>, fieldIndex: number, numberBytes: number, planeCount: number) =>
      Array.from({ length: planeCount }, (_, row) =>
        this.#quarc.viewMemory(type, field(fieldIndex) + numberBytes * row * field(fieldIndex + 1), count),
      );
    return {
      ...{ frame: field(0), phase: field(1), count },
      ids: this.#quarc.viewMemory(Uint32Array, field(3), count),
      positions: viewPlanes(Int32Array, 4, 4, 3),
      rotations: viewPlanes(Int32Array, 6, 4, 4),
      codes: viewPlanes(Int16Array, 8, 2, field(10)),
    };
  }

  #checkStatus(status: number): number {
    if (status >= 0) return status;
    if (status === STATUS.MISUSE) throw new Error("the player called the decoder with invalid arguments");
    const message = this.#quarc.readZeroTerminated(this.#functions.quarc_message(this.#handle));
    const rejectId = this.#quarc.readZeroTerminated(this.#functions.quarc_reject_id(this.#handle));
    throw new QuarcError(message ?? "the decoder failed without a message", rejectId);
  }
}

async function compileModule(): Promise<WebAssembly.Module> {
  const binary = atob(compressed);
  const bytes = new Uint8Array(binary.length);
  for (let index = 0; index < bytes.length; index++) bytes[index] = binary.charCodeAt(index);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

