/**
 * The entropy coder (SPEC 8.3): ANS with a state of 64 bits, stored as two halves of 32 bits.
 *
 * All arithmetic uses doubles and is exact. The state is high x 2^32 + low, and floor(state / 2^24) is a x 2^24 + b,
 * where a < 2^16 and b < 2^24. With share <= 2^24 and offset < share, the new state is
 *
 *     a x share x 2^24 + (b x share + offset).
 *
 * Both products are below 2^48. The product a x share is split again at 2^8, so that its lower part times 2^24 is below
 * 2^32. Therefore the sum for the lower half is below 2^49. All divisions are by powers of two.
 */

import { HALF_WEIGHT, WEIGHT_TOTAL } from "./constants.js";
import type { Words } from "./fields.js";
import { demand } from "./reject.js";

const WORD_RANGE = 2 ** 32;

export class Coder {
  readonly #words: Words;
  /** Number of unread words; words are read from the end. */
  #unreadWords: number;
  #high = 0;
  #low = 0;

  constructor(words: Words) {
    this.#words = words;
    this.#unreadWords = words.length;
    if (words.length === 0) return;
    this.#low = this.#nextWord();
    demand(this.#low !== 0, "invalid-words", "the last word of a section is 0");
  }

  /** Decode the next bit; `weight` is the weight of a 1. */
  decodeBit(weight: number): number {
    if (this.#high === 0 && this.#unreadWords > 0) {
      this.#high = this.#low;
      this.#low = this.#nextWord();
    }
    const remainder = this.#low % WEIGHT_TOTAL;
    const zeroWeight = WEIGHT_TOTAL - weight;
    const decodeBit = remainder >= zeroWeight ? 1 : 0;
    this.#advance(decodeBit ? weight : zeroWeight, decodeBit ? remainder - zeroWeight : remainder);
    return decodeBit;
  }

  /** Decode a number of `count` bits of weight 2^23, most significant bit first. */
  decodeBits(count: number): number {
    let value = 0;
    for (let i = 0; i < count; i++) value = 2 * value + this.decodeBit(HALF_WEIGHT);
    return value;
  }

  /** Check that the state is 0 and that no words are unread after the last plane. */
  finish(): void {
    demand(this.#high === 0 && this.#low === 0, "unconsumed-words", "the coder's state is not 0 after the last plane");
    demand(this.#unreadWords === 0, "unconsumed-words", `${this.#unreadWords} words are left after the last plane`);
  }

  /** Set the state to floor(state / 2^24) x share + offset. */
  #advance(share: number, offset: number): void {
    const upperQuotient = Math.floor(this.#high / 2 ** 16);
    const lowerQuotient = (this.#high % 2 ** 16) * 2 ** 8 + Math.floor(this.#low / WEIGHT_TOTAL);
    const upperProduct = upperQuotient * share;
    const lowerSum = (upperProduct % 2 ** 8) * 2 ** 24 + (lowerQuotient * share + offset);
    this.#high = Math.floor(upperProduct / 2 ** 8) + Math.floor(lowerSum / WORD_RANGE);
    this.#low = lowerSum % WORD_RANGE;
  }

  #nextWord(): number {
    this.#unreadWords -= 1;
    return this.#words.wordAt(this.#unreadWords);
  }
}
