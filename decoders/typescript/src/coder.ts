/**
 * The entropy coder (SPEC 8.3): ANS with a state of 64 bits, stored as two halves of 32 bits.
 *
 * All arithmetic uses doubles and is exact. With state = high x 2^32 + low, floor(state / 2^24) is a x 2^24 + b, a <
 * 2^16 and b < 2^24, and the new state is
 *
 *     a x share x 2^24 + (b x share + part - left)        with share <= 2^24 and part - left < share.
 *
 * Both products are below 2^48. a x share is split again at 2^8, so that its lower part times 2^24 is below 2^32; the
 * sum for the lower half is then below 2^49. All divisions are by powers of two.
 */

import { HALF_WEIGHT, WEIGHT_TOTAL } from "./constants.js";
import type { Words } from "./fields.js";
import { demand } from "./reject.js";

const WORD = 2 ** 32;

export class Coder {
  readonly #words: Words;
  /** Number of unread words; they are read from the end. */
  #left: number;
  #high = 0;
  #low = 0;

  constructor(words: Words) {
    this.#words = words;
    this.#left = words.length;
    if (words.length === 0) return;
    this.#low = this.#nextWord();
    demand(this.#low !== 0, "invalid-words", "the last word of a section is 0");
  }

  /** Decode the next bit; `weight` is that of a 1. */
  bit(weight: number): number {
    if (this.#high === 0 && this.#left > 0) {
      this.#high = this.#low;
      this.#low = this.#nextWord();
    }
    const part = this.#low % WEIGHT_TOTAL;
    const zeros = WEIGHT_TOTAL - weight;
    const bit = part >= zeros ? 1 : 0;
    this.#advance(bit ? weight : zeros, bit ? part - zeros : part);
    return bit;
  }

  /** Decode a number of `count` bits of weight 2^23, most significant bit first. */
  bits(count: number): number {
    let value = 0;
    for (let i = 0; i < count; i++) value = 2 * value + this.bit(HALF_WEIGHT);
    return value;
  }

  /** Check that nothing is left after the last plane. */
  finish(): void {
    demand(this.#high === 0 && this.#low === 0, "unconsumed-words", "the coder's state is not 0 after the last plane");
    demand(this.#left === 0, "unconsumed-words", `${this.#left} words are left after the last plane`);
  }

  /** state = floor(state / 2^24) x share + rest */
  #advance(share: number, rest: number): void {
    const a = Math.floor(this.#high / 2 ** 16);
    const b = (this.#high % 2 ** 16) * 2 ** 8 + Math.floor(this.#low / WEIGHT_TOTAL);
    const upper = a * share;
    const lower = (upper % 2 ** 8) * 2 ** 24 + (b * share + rest);
    this.#high = Math.floor(upper / 2 ** 8) + Math.floor(lower / WORD);
    this.#low = lower % WORD;
  }

  #nextWord(): number {
    this.#left -= 1;
    return this.#words.at(this.#left);
  }
}
