/**
 * The decoder of .quarc streams for the web and for Node: the C interface (capi/include/quarc.h)
 * of quarc.wasm, as classes.
 *
 *     const quarc = await Quarc.load(fetch("quarc.wasm"));
 *     const decoder = quarc.open();
 *     for await (const bytes of stream) {
 *       decoder.push(bytes);
 *       for (let found = decoder.pull(); found.state; found = decoder.pull()) draw(found.state);
 *     }
 *     decoder.finish();          // then pull to the end once more
 *     decoder.close();
 *
 * Returned arrays are views of the module's memory: they are valid until the next call of any
 * function here, and must not be modified. Use `slice()` to keep a copy.
 */

const STATUS = { FRAME: 1, GAP: 2, END: 3, REJECTED: -1, LIMIT: -2, MISUSE: -3, BROKEN: -4 };
const SCRATCH_BYTES = 72; // enough for the largest result that the module writes, a digest
const DIGEST_DIGITS = 64;
const POSITION_ROWS = 3;
const ROTATION_ROWS = 4;

/** A stream cannot be decoded; `rejectId` is that of SPEC 3.3, or null if the decoder declines it. */
export class QuarcError extends Error {
  constructor(message, rejectId) {
    super(message);
    this.name = "QuarcError";
    this.rejectId = rejectId;
  }
}

/** Return the content of a response, or what is given instead of one. */
async function read(source) {
  try {
    const given = await source;
    if (typeof Response === "undefined" || !(given instanceof Response)) return given;
    if (!given.ok) throw new Error(`${given.url} has the status ${given.status}`);
    return await given.arrayBuffer();
  } catch (error) {
    throw new Error(`quarc.wasm cannot be read: ${error.message}`, { cause: error });
  }
}

/** An address as a number from 0 on: the module returns those above 2 GiB as negative numbers. */
const address = (returned) => returned >>> 0;

/** The module, and its memory. */
export class Quarc {
  #functions;
  #scratch;

  /**
   * Load from a response, from the bytes of quarc.wasm, or from a compiled module; each may be a
   * promise. Throws an Error that says what failed: the request, or what it returned.
   */
  static async load(source) {
    const given = await read(source);
    try {
      const module =
        given instanceof WebAssembly.Module ? given : await WebAssembly.compile(given);
      return new Quarc(await WebAssembly.instantiate(module, {}));
    } catch (error) {
      throw new Error(`this is not quarc.wasm: ${error.message}`, { cause: error });
    }
  }

  constructor(instance) {
    this.#functions = instance.exports;
    if (typeof this.#functions.quarc_allocate !== "function") {
      throw new Error("the module lacks the functions of quarc.wasm");
    }
    this.#scratch = this.allocate(SCRATCH_BYTES);
  }

  /** The exports of the module. */
  get functions() {
    return this.#functions;
  }

  /** The size of the module's memory in bytes. */
  get memoryBytes() {
    return this.#functions.memory.buffer.byteLength;
  }

  get version() {
    return this.text(this.#functions.quarc_version());
  }

  /** A decoder of frames in order, as their bytes arrive. */
  open() {
    return new Decoder(this, this.#functions.quarc_open());
  }

  /** A decoder of the frames from `start` on; it needs the whole stream. */
  openSeek(start) {
    if (start !== start >>> 0) throw new RangeError(`${start} is not the ordinal of a frame`);
    return new Decoder(this, this.#functions.quarc_open_seek(start));
  }

  /** A decoder of the intact frames of a damaged stream; it needs the whole stream. */
  openRecover() {
    return new Decoder(this, this.#functions.quarc_open_recover());
  }

  /** The address at which the module writes results. */
  get scratch() {
    return this.#scratch;
  }

  /** The address of new memory. */
  allocate(size) {
    const isSize = size === size >>> 0; // other numbers would be passed modulo 2^32
    const place = isSize ? address(this.#functions.quarc_allocate(size)) : 0;
    if (place === 0) throw new RangeError(`cannot allocate ${size} bytes`);
    return place;
  }

  /** The zero-terminated text at an address that the module returned; null for address 0. */
  text(returned) {
    if (returned === 0) return null;
    const bytes = new Uint8Array(this.#functions.memory.buffer, address(returned));
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }

  /** Numbers at an address. */
  view(type, place, length) {
    return new type(this.#functions.memory.buffer, place, length);
  }

  /** Copy bytes into the module for the duration of `use`. */
  lend(bytes, use) {
    const place = this.allocate(bytes.length);
    this.view(Uint8Array, place, bytes.length).set(bytes);
    try {
      return use(place);
    } finally {
      this.#functions.quarc_free(place, bytes.length);
    }
  }
}

/** A decoder of one stream. */
class Decoder {
  #quarc;
  #functions;
  #handle;

  constructor(quarc, handle) {
    this.#quarc = quarc;
    this.#functions = quarc.functions;
    this.#handle = handle;
  }

  /** Append the next bytes of the stream, a Uint8Array. */
  push(bytes) {
    if (!(bytes instanceof Uint8Array)) throw new TypeError("push needs a Uint8Array");
    this.#quarc.lend(bytes, (place) => {
      this.#check(this.#functions.quarc_push(this.#handle, place, bytes.length));
    });
  }

  /** Declare the end of the stream. */
  finish() {
    this.#check(this.#functions.quarc_finish(this.#handle));
  }

  /**
   * Decode: `{state}` of the next frame, `{gap}` in a damaged stream, `{}` if more bytes are
   * needed, `{isOver: true}` at the end.
   */
  pull() {
    const status = this.#check(this.#functions.quarc_pull(this.#handle, this.#quarc.scratch));
    if (status === STATUS.FRAME) return { state: this.#readState() };
    if (status === STATUS.GAP) return { gap: this.#readGap() };
    return status === STATUS.END ? { isOver: true } : {};
  }

  /** The parameters of the stream; null before HEAD has been read. */
  get head() {
    const { scratch } = this.#quarc;
    if (this.#functions.quarc_head(this.#handle, scratch) !== 0) return null;
    const [timescale, frameTicks, level, latticeExponent] = this.#numbers(4);
    const steps = this.#quarc.view(Float32Array, scratch + 16, 4);
    const [logScaleStep, opacityStep, shDcStep, shRestStep] = steps;
    const [shDegree, rightHanded, upAxis] = this.#quarc.view(Uint32Array, scratch + 32, 3);
    const [metersPerUnit] = this.#quarc.view(Float32Array, scratch + 44, 1);
    return {
      ...{ timescale, frameTicks, level, latticeExponent },
      ...{ logScaleStep, opacityStep, shDcStep, shRestStep },
      ...{ shDegree, isRightHanded: rightHanded === 1, upAxis, metersPerUnit },
    };
  }

  /** The SHA-256 of the last state (SPEC 9.1). */
  digest() {
    const { scratch } = this.#quarc;
    this.#check(this.#functions.quarc_digest(this.#handle, scratch));
    const digits = this.#quarc.view(Uint8Array, scratch, DIGEST_DIGITS);
    return String.fromCharCode(...digits);
  }

  /**
   * The last state as floats, one row per Gaussian, as 3DGS stores them. `changed` says which
   * arrays differ from the state that was dequantized before.
   */
  dequantize() {
    this.#check(this.#functions.quarc_dequantize(this.#handle, this.#quarc.scratch));
    const [count, positions, rotations, logScales, opacities, sh, shCoefficients, changed] =
      this.#numbers(8);
    const floats = (place, width) => this.#quarc.view(Float32Array, place, count * width);
    return {
      count,
      positions: floats(positions, POSITION_ROWS),
      rotations: floats(rotations, ROTATION_ROWS),
      logScales: floats(logScales, 3),
      opacities: floats(opacities, 1),
      sh: floats(sh, 3 * shCoefficients),
      shCoefficients,
      changed: {
        positions: (changed & 1) !== 0,
        rotations: (changed & 2) !== 0,
        codes: (changed & 4) !== 0,
      },
    };
  }

  /** Free the decoder and all memory that it returned; a second call does nothing. */
  close() {
    const { scratch } = this.#quarc;
    this.#quarc.view(Uint32Array, scratch, 1)[0] = this.#handle;
    this.#functions.quarc_close(scratch);
    this.#handle = 0;
  }

  #readState() {
    const [frame, phase, count, ids, ...rest] = this.#numbers(11);
    const [positions, positionsStride, rotations, rotationsStride] = rest;
    const [codes, codesStride, codeRows] = rest.slice(4);
    const rows = (type, place, stride, number) =>
      Array.from({ length: number }, (_, row) =>
        this.#quarc.view(type, place + row * stride * type.BYTES_PER_ELEMENT, count),
      );
    return {
      frame,
      phase,
      count,
      ids: this.#quarc.view(Uint32Array, ids, count),
      positions: rows(Int32Array, positions, positionsStride, POSITION_ROWS),
      rotations: rows(Int32Array, rotations, rotationsStride, ROTATION_ROWS),
      codes: rows(Int16Array, codes, codesStride, codeRows),
    };
  }

  #readGap() {
    const { scratch } = this.#quarc;
    this.#check(this.#functions.quarc_gap(this.#handle, scratch));
    const [offset, bytes, lost] = this.#quarc.view(BigInt64Array, scratch, 3);
    return {
      offset: Number(offset),
      bytes: Number(bytes),
      framesLost: lost < 0n ? null : Number(lost),
      rejectId: this.#quarc.text(this.#quarc.view(Uint32Array, scratch + 24, 1)[0]),
    };
  }

  /** Words that the module has written to the scratch memory. */
  #numbers(count) {
    return this.#quarc.view(Uint32Array, this.#quarc.scratch, count);
  }

  #check(status) {
    if (status >= 0) return status;
    if (status === STATUS.MISUSE) {
      const closed = this.#handle === 0 && "the decoder is closed";
      throw new Error(`invalid call: ${closed || "there is no state now, or finish() was called"}`);
    }
    const message = this.#quarc.text(this.#functions.quarc_message(this.#handle));
    const rejectId = this.#quarc.text(this.#functions.quarc_reject_id(this.#handle));
    throw new QuarcError(message ?? "the decoder is broken", rejectId);
  }
}
