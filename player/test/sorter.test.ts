/** The order in which Gaussians are drawn. */

import assert from "node:assert/strict";
import { test } from "node:test";
import type { SortPacket } from "../src/protocol.js";
import { Sorter } from "../src/sort/sorter.js";

/** Make a packet that moves slots to x positions. */
function makePacket(xBySlot: Readonly<Record<number, number>>, more: Partial<SortPacket> = {}): SortPacket {
  const slots = Object.keys(xBySlot).map(Number);
  return {
    ...{ isFull: false, slotLimit: 5, movedSlots: Uint32Array.from(slots), freedSlots: new Uint32Array(0) },
    positions: Int32Array.from(slots.flatMap((slot) => [xBySlot[slot] ?? 0, slot, -slot])),
    ...more,
  };
}

test("the farthest Gaussian is drawn first, and those at the same depth in the order of their slots", () => {
  const sorter = new Sorter();
  sorter.apply(makePacket({ 0: 5, 1: -1_000_000, 2: 5, 3: 1_000_000, 4: 6 }, { isFull: true }));
  assert.deepEqual([...sorter.sort([1, 0, 0])], [3, 4, 0, 2, 1]);
  assert.deepEqual([...sorter.sort([-1, 0, 0])], [1, 0, 2, 4, 3]);
  assert.deepEqual([...sorter.sort([0, 1, 0])], [4, 3, 2, 1, 0]);
  assert.deepEqual([...sorter.sort([0, 0, 1])], [0, 1, 2, 3, 4]);
  assert.deepEqual([...sorter.sort([0, 1, 1])], [0, 1, 2, 3, 4], "all have the same depth");
});

test("a packet moves, frees and adds slots, and a full packet replaces all", () => {
  const sorter = new Sorter();
  sorter.apply(makePacket({ 0: 3, 1: 2, 2: 1 }, { isFull: true, slotLimit: 3 }));
  sorter.apply(makePacket({ 2: 9, 7: 4 }, { slotLimit: 8, freedSlots: Uint32Array.of(1) }));
  assert.deepEqual([...sorter.sort([1, 0, 0])], [2, 7, 0]);
  sorter.apply(makePacket({ 1: 1 }, { isFull: true, slotLimit: 2 }));
  assert.deepEqual([...sorter.sort([1, 0, 0])], [1]);
  sorter.apply(makePacket({}, { isFull: true, slotLimit: 0 }));
  assert.deepEqual([...sorter.sort([1, 0, 0])], []);
});

test("depths are distinguished in 2^22 steps", () => {
  const sorter = new Sorter();
  const count = 1 << 12;
  const positions = Int32Array.from({ length: 3 * count }, (_, index) => (index % 3 === 0 ? 1021 * ((index * 1365) % count) : 0));
  sorter.apply(makePacket({}, { isFull: true, slotLimit: count, movedSlots: Uint32Array.from({ length: count }, (_, slot) => slot), positions }));
  const depths = [...sorter.sort([1, 0, 0])].map((slot) => positions[3 * slot]!);
  assert.deepEqual(depths, depths.slice().sort((a, b) => b - a));
});
