/** Reads the fields of a payload (SPEC 5). */

import { demand } from "./reject.js";

const UTF8 = new TextDecoder("utf-8", { fatal: true, ignoreBOM: true });

/** The words of a section, as stored (SPEC 8.1). */
export interface Words {
  readonly length: number;
  wordAt(index: number): number;
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
  get unreadBytes(): number {
    return this.#bytes.length - this.#offset;
  }

  u8(name: string, minimum = 0, maximum = 0xff): number {
    return checkRange(this.#view.getUint8(this.#advance(name, 1)), name, minimum, maximum);
  }

  u16(name: string, minimum = 0, maximum = 0xffff): number {
    return checkRange(this.#view.getUint16(this.#advance(name, 2), true), name, minimum, maximum);
  }

  u32(name: string, minimum = 0, maximum = 0xffffffff): number {
    return checkRange(this.#view.getUint32(this.#advance(name, 4), true), name, minimum, maximum);
  }

  i32(name: string): number {
    return this.#view.getInt32(this.#advance(name, 4), true);
  }

  u64(name: string): bigint {
    return this.#view.getBigUint64(this.#advance(name, 8), true);
  }

  /** Read a finite f32 above 0. */
  positiveFloat(name: string, maximum = Number.MAX_VALUE): number {
    const value = this.finiteFloat(name, 0, maximum);
    demand(value > 0, "field", `${name} must be above 0`);
    return value;
  }

  /** Read an f32 from `minimum` to `maximum`; NaN and infinities are rejected, and -0 counts as 0. */
  finiteFloat(name: string, minimum = -Number.MAX_VALUE, maximum = Number.MAX_VALUE): number {
    return checkRange(this.#view.getFloat32(this.#advance(name, 4), true), name, minimum, maximum);
  }

  /** Read a text8. */
  text8(name: string): string {
    return this.#text(name, this.u8(name));
  }

  /** Read a text32. */
  text32(name: string): string {
    return this.#text(name, this.u32(name));
  }

  /** Read the words of a section, as a view of the payload. */
  words(name: string): Words {
    const length = this.u32(`${name}.word_count`);
    const start = this.#advance(`${name}.words`, 4 * length);
    return { length, wordAt: (index) => this.#view.getUint32(start + 4 * index, true) };
  }

  /** Check that the payload ends after its last field. */
  finish(): void {
    demand(this.unreadBytes === 0, "trailing-data", `${this.unreadBytes} bytes follow the last field of a payload`);
  }

  #text(name: string, length: number): string {
    const start = this.#advance(name, length);
    try {
      return UTF8.decode(this.#bytes.subarray(start, start + length));
    } catch {
      return rejectText(name);
    }
  }

  #advance(name: string, length: number): number {
    demand(length <= this.unreadBytes, "field", `the payload ends before ${name}`);
    const start = this.#offset;
    this.#offset += length;
    return start;
  }
}

function rejectText(name: string): never {
  demand(false, "field", `${name} is not valid UTF-8`);
}

function checkRange(value: number, name: string, minimum: number, maximum: number): number {
  demand(
    value >= minimum && value <= maximum,
    "field",
    `${name} is ${value}; it must be from ${minimum} to ${maximum}`,
  );
  return value;
}
