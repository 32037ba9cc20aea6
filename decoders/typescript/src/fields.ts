/** Reading of the fields of a payload (SPEC 5). */

import { demand } from "./reject.js";

const UTF8 = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });

/** The words of a section, as stored (SPEC 8.1). */
export interface Words {
  readonly length: number;
  at(index: number): number;
}

export class Fields {
  readonly #bytes: Uint8Array;
  readonly #view: DataView;
  #offset = 0;

  constructor(bytes: Uint8Array) {
    this.#bytes = bytes;
    this.#view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  }

  /** Number of unread bytes. */
  get left(): number {
    return this.#bytes.length - this.#offset;
  }

  u8(name: string, least = 0, greatest = 0xff): number {
    return within(this.#view.getUint8(this.#take(name, 1)), name, least, greatest);
  }

  u16(name: string, least = 0, greatest = 0xffff): number {
    return within(this.#view.getUint16(this.#take(name, 2), true), name, least, greatest);
  }

  u32(name: string, least = 0, greatest = 0xffffffff): number {
    return within(this.#view.getUint32(this.#take(name, 4), true), name, least, greatest);
  }

  i32(name: string): number {
    return this.#view.getInt32(this.#take(name, 4), true);
  }

  u64(name: string): bigint {
    return this.#view.getBigUint64(this.#take(name, 8), true);
  }

  /** A finite f32 above 0. */
  positive(name: string, greatest = Number.MAX_VALUE): number {
    const value = this.finite(name, 0, greatest);
    demand(value > 0, "field", `${name} must be above 0`);
    return value;
  }

  /** An f32 from `least` to `greatest`; NaN and the infinities are rejected, and -0 counts as 0. */
  finite(name: string, least = -Number.MAX_VALUE, greatest = Number.MAX_VALUE): number {
    return within(this.#view.getFloat32(this.#take(name, 4), true), name, least, greatest);
  }

  /** A text8. */
  text8(name: string): string {
    return this.#text(name, this.u8(name));
  }

  /** A text32. */
  text32(name: string): string {
    return this.#text(name, this.u32(name));
  }

  /** The words of a section, as a view of the payload. */
  section(name: string): Words {
    const length = this.u32(`${name}.word_count`);
    const start = this.#take(`${name}.words`, 4 * length);
    return { length, at: (index) => this.#view.getUint32(start + 4 * index, true) };
  }

  /** Check that the payload ends after its last field. */
  end(): void {
    demand(this.left === 0, "trailing-data", `${this.left} bytes follow the last field of a payload`);
  }

  #text(name: string, length: number): string {
    const start = this.#take(name, length);
    try {
      return UTF8.decode(this.#bytes.subarray(start, start + length));
    } catch {
      return fail(name);
    }
  }

  #take(name: string, length: number): number {
    demand(length <= this.left, "field", `the payload ends before ${name}`);
    const start = this.#offset;
    this.#offset += length;
    return start;
  }
}

function fail(name: string): never {
  demand(false, "field", `${name} is not valid UTF-8`);
}

function within(value: number, name: string, least: number, greatest: number): number {
  demand(value >= least && value <= greatest, "field", `${name} is ${value}; it must be from ${least} to ${greatest}`);
  return value;
}
