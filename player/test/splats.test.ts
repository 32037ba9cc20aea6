/** Splats match the states of frames, slot by slot. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { readFrames, Splats } from "../src/decode/index.js";
import type { FramePacket, StreamInfo } from "../src/protocol.js";
import { readVector } from "./server.js";

async function readPackets(name: string, from = 0): Promise<{ info: StreamInfo; packets: FramePacket[] }> {
  const packets: FramePacket[] = [];
  let info: StreamInfo | null = null;
  const source = { bytes: Uint8Array.from(readVector(`streams/${name}`)).buffer };
  for await (const packet of readFrames(source, { from, onInfo: (streamInfo) => (info ??= streamInfo) })) packets.push(packet);
  assert.ok(info !== null);
  return { info, packets };
}

const listUsedSlots = (splats: Splats): number[] =>
  [...splats.opacities.keys()].filter((slot) => (splats.opacities[slot] ?? 0) > 0);

for (const name of ["births-and-deaths", "journey", "updates-journey"]) {
  test(`${name}: applying all changes gives the same splats as a seek`, async () => {
    const { info, packets } = await readPackets(name);
    const splats = new Splats(info);
    for (const packet of packets) {
      splats.apply(packet);
      assert.equal(listUsedSlots(splats).length, packet.count);
      const seekSplats = new Splats(info);
      seekSplats.apply((await readPackets(name, packet.frame)).packets[0] as FramePacket);
      const describeSplats = (source: Splats): string[] =>
        listUsedSlots(source).map((slot) =>
          [source.positions, source.scales, source.colors]
            .map((array) => array.subarray(3 * slot, 3 * slot + 3).join())
            .concat(source.rotations.subarray(4 * slot, 4 * slot + 4).join(), String(source.opacities[slot]))
            .join(" "),
        );
      assert.deepEqual(describeSplats(splats).sort(), describeSplats(seekSplats).sort());
    }
  });
}

test("apply returns the slots that a packet lists and, for a full packet, all slots", async () => {
  const { info, packets } = await readPackets("births-and-deaths");
  const splats = new Splats(info);
  for (const packet of packets) {
    const expectedSlots = new Set([...packet.movedSlots, ...packet.codedSlots, ...packet.freedSlots]);
    assert.deepEqual([...splats.apply(packet)], [...expectedSlots].sort((a, b) => a - b));
  }
  const oldSlotLimit = splats.slotLimit;
  assert.equal(splats.apply(packets[0] as FramePacket).length, Math.max(oldSlotLimit, packets[0]?.slotLimit ?? 0));
  assert.deepEqual([splats.slotLimit, listUsedSlots(splats).length], [packets[0]?.slotLimit, packets[0]?.count]);
});

test("values are dequantized as in SPEC 10", async () => {
  const { info, packets } = await readPackets("brief");
  const [packet] = packets as [FramePacket];
  const splats = new Splats(info);
  splats.apply(packet);
  const [slot, row] = [packet.movedSlots[0] ?? 0, packet.codedSlots.indexOf(packet.movedSlots[0] ?? 0)];
  const width = packet.codes.length / packet.codedSlots.length;
  const readCode = (k: number): number => packet.codes[width * row + k] ?? 0;
  const assertNear = (actual: number | undefined, expected: number): void =>
    assert.ok(Math.abs((actual ?? NaN) - expected) <= 1e-6 * Math.max(1, Math.abs(expected)), `${actual}; expected ${expected}`);
  assertNear(splats.positions[3 * slot + 1], (packet.positions[1] ?? 0) / 2 ** info.latticeExponent);
  assertNear(splats.scales[3 * slot + 2], Math.exp(readCode(2) * info.logScaleStep));
  assertNear(splats.colors[3 * slot], Math.max(0, 0.5 + 0.28209479177387814 * readCode(4) * info.shDcStep));
  assertNear(splats.opacities[slot], Math.min(0.99, 1 / (1 + Math.exp(-readCode(3) * info.opacityStep))));
  assertNear(splats.rotations[4 * slot + 3], (packet.rotations[0] ?? 0) / 2 ** 22);
  assertNear(splats.rotations[4 * slot], (packet.rotations[1] ?? 0) / 2 ** 22);
});
