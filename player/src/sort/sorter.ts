/**
 * The drawing order of slots: farthest first.
 *
 * Depths are converted to integers of 22 bits and sorted by 11 bits at a time. Two short tables of counts fit into the
 * cache, unlike one of 16 bits, and resolve 64 times as many depths.
 */

import type { Direction, SortPacket } from "../protocol.js";

const DIGIT_BITS = 11;
const DIGITS = 1 << DIGIT_BITS;
const LAST_KEY = 2 ** (2 * DIGIT_BITS) - 1;

export class Sorter {
  #positions = new Int32Array(0);
  #isUsed = new Uint8Array(0);
  #slotLimit = 0;
  #depths = new Float64Array(0);
  #keys = new Uint32Array(0);
  #slots = new Uint32Array(0);
  #halfSorted = new Uint32Array(0);
  readonly #low = new Uint32Array(DIGITS);
  readonly #high = new Uint32Array(DIGITS);

  /** Update the positions of the Gaussians of a frame. */
  apply(packet: SortPacket): void {
    this.#reserve(packet.slotLimit);
    this.#slotLimit = packet.slotLimit;
    if (packet.isFull) this.#isUsed.fill(0);
    const { movedSlots, positions } = packet;
    for (let index = 0; index < movedSlots.length; index++) {
      const slot = movedSlots[index]!;
      this.#isUsed[slot] = 1;
      this.#positions[3 * slot] = positions[3 * index]!;
      this.#positions[3 * slot + 1] = positions[3 * index + 1]!;
      this.#positions[3 * slot + 2] = positions[3 * index + 2]!;
    }
    for (const slot of packet.freedSlots) this.#isUsed[slot] = 0;
  }

  /** Return the slots in use, sorted from the farthest along a direction; the sort is stable. */
  sort(forward: Direction): Uint32Array {
    const [count, least, most] = this.#measure(forward);
    this.#makeKeys(count, most, most > least ? LAST_KEY / (most - least) : 0);
    const order = new Uint32Array(count);
    this.#pass(this.#low, null, this.#halfSorted, count, 0);
    this.#pass(this.#high, this.#halfSorted, order, count, DIGIT_BITS);
    const slots = this.#slots;
    for (let place = 0; place < count; place++) order[place] = slots[order[place]!]!;
    return order;
  }

  /** List the slots in use with their depths; returns their number, and the minimum and maximum depth. */
  #measure([x, y, z]: Direction): [number, number, number] {
    const [positions, isUsed, depths, slots] = [this.#positions, this.#isUsed, this.#depths, this.#slots];
    let [count, least, most] = [0, Infinity, -Infinity];
    for (let slot = 0; slot < this.#slotLimit; slot++) {
      if (isUsed[slot] === 0) continue;
      const at = 3 * slot;
      const depth = x * positions[at]! + y * positions[at + 1]! + z * positions[at + 2]!;
      slots[count] = slot;
      depths[count++] = depth;
      if (depth < least) least = depth;
      if (depth > most) most = depth;
    }
    return [count, least, most];
  }

  /** Convert depths to keys, 0 for the farthest, and set the tables to the start of each digit. */
  #makeKeys(count: number, most: number, scale: number): void {
    const [low, high, keys, depths] = [this.#low.fill(0), this.#high.fill(0), this.#keys, this.#depths];
    for (let index = 0; index < count; index++) {
      const key = ((most - depths[index]!) * scale) >>> 0;
      keys[index] = key;
      low[key & (DIGITS - 1)]!++;
      high[key >>> DIGIT_BITS]!++;
    }
    for (const table of [low, high]) {
      let before = 0;
      for (let digit = 0; digit < DIGITS; digit++) {
        const size = table[digit]!;
        table[digit] = before;
        before += size;
      }
    }
  }

  /** Move indices to the positions of a digit of their keys; stable. */
  #pass(table: Uint32Array, from: Uint32Array | null, to: Uint32Array, count: number, shift: number): void {
    const keys = this.#keys;
    for (let place = 0; place < count; place++) {
      const index = from === null ? place : from[place]!;
      const digit = (keys[index]! >>> shift) & (DIGITS - 1);
      to[table[digit]!++] = index;
    }
  }

  #reserve(slotLimit: number): void {
    if (slotLimit <= this.#isUsed.length) return;
    const size = Math.max(slotLimit, Math.ceil(1.5 * this.#isUsed.length));
    const [positions, isUsed] = [new Int32Array(3 * size), new Uint8Array(size)];
    positions.set(this.#positions);
    isUsed.set(this.#isUsed);
    [this.#positions, this.#isUsed] = [positions, isUsed];
    [this.#depths, this.#keys] = [new Float64Array(size), new Uint32Array(size)];
    [this.#slots, this.#halfSorted] = [new Uint32Array(size), new Uint32Array(size)];
  }
}
