/** Digests of frames, from packets or states; they do not depend on the order of Gaussians. */

import { createHash } from "node:crypto";
import type { FramePacket } from "../src/protocol.js";
import type { FrameState } from "../src/decode/quarc.js";

/** Applies packets to Gaussians by slot, like a renderer, and returns the digest of each frame. */
export class FrameRebuilder {
  readonly #motion = new Map<number, readonly number[]>();
  readonly #codes = new Map<number, readonly number[]>();

  apply(packet: FramePacket): string {
    if (packet.isFull) {
      this.#motion.clear();
      this.#codes.clear();
    }
    for (const slot of [...packet.freedSlots, ...packet.bornSlots]) {
      this.#motion.delete(slot);
      this.#codes.delete(slot);
    }
    packet.movedSlots.forEach((slot, row) => {
      const position = packet.positions.subarray(3 * row, 3 * row + 3);
      this.#motion.set(slot, [...position, ...packet.rotations.subarray(4 * row, 4 * row + 4)]);
    });
    const planes = packet.codes.length / Math.max(1, packet.codedSlots.length);
    packet.codedSlots.forEach((slot, row) => {
      this.#codes.set(slot, [...packet.codes.subarray(planes * row, planes * (row + 1))]);
    });
    return digestRows([...this.#motion].map(([slot, row]) => [...row, ...(this.#codes.get(slot) ?? [])]));
  }
}

export function digestState(state: FrameState): string {
  const planes = [...state.positions, ...state.rotations, ...state.codes];
  return digestRows(Array.from({ length: state.count }, (_, row) => planes.map((plane) => plane[row] ?? 0)));
}

function digestRows(rows: number[][]): string {
  const sorted = rows.map((row) => row.join(" ")).sort();
  return createHash("sha256").update(sorted.join("\n")).digest("hex");
}
