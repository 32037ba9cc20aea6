/** Splats match the state of a frame, slot by slot. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { readFrames, Splats } from "../src/decode/index.js";
import type { FramePacket, StreamInfo } from "../src/protocol.js";
import { readVector } from "./server.js";

async function decode(name: string, from = 0): Promise<{ info: StreamInfo; packets: FramePacket[] }> {
  const packets: FramePacket[] = [];
  let info: StreamInfo | null = null;
  const source = { bytes: Uint8Array.from(readVector(`streams/${name}`)).buffer };
  for await (const packet of readFrames(source, { from, onInfo: (found) => (info ??= found) })) packets.push(packet);
  assert.ok(info !== null);
  return { info, packets };
}

const used = (splats: Splats): number[] =>
  [...splats.opacities.keys()].filter((slot) => (splats.opacities[slot] ?? 0) > 0);

for (const name of ["births-and-deaths", "journey", "updates-journey"]) {
  test(`${name}: changes add up to the result of a seek`, async () => {
    const { info, packets } = await decode(name);
    const splats = new Splats(info);
    for (const packet of packets) {
      splats.apply(packet);
      assert.equal(used(splats).length, packet.count);
      const fresh = new Splats(info);
      fresh.apply((await decode(name, packet.frame)).packets[0] as FramePacket);
      const rows = (from: Splats): string[] =>
        used(from).map((slot) =>
          [from.positions, from.scales, from.colors]
            .map((array) => array.subarray(3 * slot, 3 * slot + 3).join())
            .concat(from.rotations.subarray(4 * slot, 4 * slot + 4).join(), String(from.opacities[slot]))
            .join(" "),
        );
      assert.deepEqual(rows(splats).sort(), rows(fresh).sort());
    }
  });
}

test("the changed slots are those of the packet, and all slots of a full packet", async () => {
  const { info, packets } = await decode("births-and-deaths");
  const splats = new Splats(info);
  for (const packet of packets) {
    const due = new Set([...packet.movedSlots, ...packet.codedSlots, ...packet.freedSlots]);
    assert.deepEqual([...splats.apply(packet)], [...due].sort((a, b) => a - b));
  }
  const all = splats.slotLimit;
  assert.equal(splats.apply(packets[0] as FramePacket).length, Math.max(all, packets[0]?.slotLimit ?? 0));
});

test("floats match SPEC 10", async () => {
  const { info, packets } = await decode("brief");
  const [packet] = packets as [FramePacket];
  const splats = new Splats(info);
  splats.apply(packet);
  const [slot, row] = [packet.movedSlots[0] ?? 0, packet.codedSlots.indexOf(packet.movedSlots[0] ?? 0)];
  const width = packet.codes.length / packet.codedSlots.length;
  const code = (k: number): number => packet.codes[width * row + k] ?? 0;
  const near = (found: number | undefined, due: number): void =>
    assert.ok(Math.abs((found ?? NaN) - due) <= 1e-6 * Math.max(1, Math.abs(due)), `${found}; expected ${due}`);
  near(splats.positions[3 * slot + 1], (packet.positions[1] ?? 0) / 2 ** info.latticeExponent);
  near(splats.scales[3 * slot + 2], Math.exp(code(2) * info.logScaleStep));
  near(splats.colors[3 * slot], Math.max(0, 0.5 + 0.28209479177387814 * code(4) * info.shDcStep));
  near(splats.opacities[slot], Math.min(0.99, 1 / (1 + Math.exp(-code(3) * info.opacityStep))));
  near(splats.rotations[4 * slot + 3], (packet.rotations[0] ?? 0) / 2 ** 22);
  near(splats.rotations[4 * slot], (packet.rotations[1] ?? 0) / 2 ** 22);
});
