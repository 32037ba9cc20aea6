/** Slots of Gaussians that are born and die, from states that the test makes. */

import assert from "node:assert/strict";
import { test } from "node:test";
import type { FrameState } from "../src/decode/quarc.js";
import { SlotTracker } from "../src/decode/slots.js";

/** Make a state whose position planes and code contain the ids. */
function makeState(frame: number, ids: readonly number[]): FrameState {
  const [plane, codes] = [Int32Array.from(ids), Int16Array.from(ids)];
  return {
    ...{ frame, phase: frame, count: ids.length, ids: Uint32Array.from(ids) },
    ...{ positions: [plane, plane, plane], rotations: [plane, plane, plane, plane], codes: [codes] },
  };
}

test("all lists of slots are ascending, also if births reuse several slots", () => {
  const tracker = new SlotTracker();
  const states = [[0, 1, 2, 3, 4, 5], [0, 5], [0, 5, 6, 7, 8], [9]];
  const packets = states.map((ids, frame) => tracker.makePacket(makeState(frame, ids), false, { run: 0, bytes: null, decodeMs: 0 }));
  assert.deepEqual(packets.map(({ freedSlots }) => [...freedSlots]), [[], [1, 2, 3, 4], [], [0, 3, 4, 5]]);
  assert.deepEqual(packets.map(({ bornSlots }) => [...bornSlots]), [[], [], [2, 3, 4], [2]]);
  assert.deepEqual(packets.map(({ movedSlots }) => [...movedSlots]), [[0, 1, 2, 3, 4, 5], [], [2, 3, 4], [2]]);
  assert.deepEqual(packets.map(({ codes }) => [...codes]), [[0, 1, 2, 3, 4, 5], [], [8, 7, 6], [9]]);
  assert.deepEqual(packets.map(({ slotLimit }) => slotLimit), [6, 6, 6, 6]);
});

test("a packet lists only changes, also when the number of slots grows", () => {
  const tracker = new SlotTracker();
  const metadata = { run: 0, bytes: null, decodeMs: 0 };
  tracker.makePacket(makeState(0, [1, 2]), true, metadata);
  const packet = tracker.makePacket(makeState(1, [1, 2, 3, 4, 5]), true, metadata);
  assert.deepEqual([[...packet.movedSlots], [...packet.codedSlots]], [[2, 3, 4], [2, 3, 4]]);
});
