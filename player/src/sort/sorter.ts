/**
 * Sorts slots into drawing order, farthest first.
 *
 * Depths are converted to keys of 22 bits, and radix-sorted by 11 bits at a time. The two tables of counts fit into the
 * cache, unlike one table for keys of 16 bits, and 22 bits distinguish 64 times as many depths.
 */

import type { Direction, SortPacket } from "../protocol.js";

const DIGIT_BITS = 11;
const DIGIT_VALUES = 1 << DIGIT_BITS;
const MAX_KEY = 2 ** (2 * DIGIT_BITS) - 1;

export class Sorter {
  #positions = new Int32Array(0);
  #usedFlags = new Uint8Array(0);
  #slotLimit = 0;
  #depths = new Float64Array(0);
  #keys = new Uint32Array(0);
  #slots = new Uint32Array(0);
  #halfSorted = new Uint32Array(0);
  readonly #lowCounts = new Uint32Array(DIGIT_VALUES);
  readonly #highCounts = new Uint32Array(DIGIT_VALUES);

  /** Update the positions of the Gaussians of a frame. */
  apply(packet: SortPacket): void {
    this.#reserve(packet.slotLimit);
    this.#slotLimit = packet.slotLimit;
    if (packet.isFull) this.#usedFlags.fill(0);
    const { movedSlots, positions } = packet;
    for (let index = 0; index < movedSlots.length; index++) {
      const slot = movedSlots[index]!;
      this.#usedFlags[slot] = 1;
      this.#positions[3 * slot] = positions[3 * index]!;
      this.#positions[3 * slot + 1] = positions[3 * index + 1]!;
      this.#positions[3 * slot + 2] = positions[3 * index + 2]!;
    }
    for (const slot of packet.freedSlots) this.#usedFlags[slot] = 0;
  }

  /** Return the used slots, sorted by depth along `forward`, farthest first; the sort is stable. */
  sort(forward: Direction): Uint32Array {
    const [count, minDepth, maxDepth] = this.#measureDepths(forward);
    this.#makeKeys(count, maxDepth, maxDepth > minDepth ? MAX_KEY / (maxDepth - minDepth) : 0);
    const order = new Uint32Array(count);
    this.#sortByDigit(this.#lowCounts, null, this.#halfSorted, count, 0);
    this.#sortByDigit(this.#highCounts, this.#halfSorted, order, count, DIGIT_BITS);
    const slots = this.#slots;
    for (let rank = 0; rank < count; rank++) order[rank] = slots[order[rank]!]!;
    return order;
  }

  /** List the used slots and their depths; return their number, the minimum depth and the maximum depth. */
  #measureDepths([x, y, z]: Direction): [number, number, number] {
    const [positions, usedFlags, depths, slots] = [this.#positions, this.#usedFlags, this.#depths, this.#slots];
    let [count, minDepth, maxDepth] = [0, Infinity, -Infinity];
    for (let slot = 0; slot < this.#slotLimit; slot++) {
      if (usedFlags[slot] === 0) continue;
      const base = 3 * slot;
      const depth = x * positions[base]! + y * positions[base + 1]! + z * positions[base + 2]!;
      slots[count] = slot;
      depths[count++] = depth;
      if (depth < minDepth) minDepth = depth;
      if (depth > maxDepth) maxDepth = depth;
    }
    return [count, minDepth, maxDepth];
  }

  /** Convert depths to keys, 0 for the farthest, and set the tables to the first rank of each digit. */
  #makeKeys(count: number, maxDepth: number, scale: number): void {
    const [lowCounts, highCounts] = [this.#lowCounts.fill(0), this.#highCounts.fill(0)];
    const [keys, depths] = [this.#keys, this.#depths];
    for (let index = 0; index < count; index++) {
      const key = ((maxDepth - depths[index]!) * scale) >>> 0;
      keys[index] = key;
      lowCounts[key & (DIGIT_VALUES - 1)]!++;
      highCounts[key >>> DIGIT_BITS]!++;
    }
    for (const table of [lowCounts, highCounts]) {
      let start = 0;
      for (let digit = 0; digit < DIGIT_VALUES; digit++) {
        const digitCount = table[digit]!;
        table[digit] = start;
        start += digitCount;
      }
    }
  }

  /** Sort indices by one digit of their keys, stably; a null `source` means 0, 1, 2, ... */
  #sortByDigit(
    table: Uint32Array,
    source: Uint32Array | null,
    target: Uint32Array,
    count: number,
    shift: number,
  ): void {
    const keys = this.#keys;
    for (let rank = 0; rank < count; rank++) {
      const index = source === null ? rank : source[rank]!;
      const digit = (keys[index]! >>> shift) & (DIGIT_VALUES - 1);
      target[table[digit]!++] = index;
    }
  }

  #reserve(slotLimit: number): void {
    if (slotLimit <= this.#usedFlags.length) return;
    const size = Math.max(slotLimit, Math.ceil(1.5 * this.#usedFlags.length));
    const [positions, usedFlags] = [new Int32Array(3 * size), new Uint8Array(size)];
    positions.set(this.#positions);
    usedFlags.set(this.#usedFlags);
    [this.#positions, this.#usedFlags] = [positions, usedFlags];
    [this.#depths, this.#keys] = [new Float64Array(size), new Uint32Array(size)];
    [this.#slots, this.#halfSorted] = [new Uint32Array(size), new Uint32Array(size)];
  }
}
