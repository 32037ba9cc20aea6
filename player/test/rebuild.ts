/** Reconstructs frames from packets; the digest does not depend on the order of Gaussians. */

import { createHash } from "node:crypto";
import type { FramePacket } from "../src/protocol.js";
import type { State } from "../src/decode/quarc.js";

/** Gaussians by slot, as on a page. */
export class Rebuilt {
  readonly #motion = new Map<number, readonly number[]>();
  readonly #codes = new Map<number, readonly number[]>();

  take(packet: FramePacket): string {
    if (packet.isFull) {
      this.#motion.clear();
      this.#codes.clear();
    }
    for (const slot of packet.freedSlots) {
      this.#motion.delete(slot);
      this.#codes.delete(slot);
    }
    packet.movedSlots.forEach((slot, at) => {
      const position = packet.positions.subarray(3 * at, 3 * at + 3);
      this.#motion.set(slot, [...position, ...packet.rotations.subarray(4 * at, 4 * at + 4)]);
    });
    const planes = packet.codes.length / Math.max(1, packet.codedSlots.length);
    packet.codedSlots.forEach((slot, at) => {
      this.#codes.set(slot, [...packet.codes.subarray(planes * at, planes * (at + 1))]);
    });
    return digest([...this.#motion].map(([slot, row]) => [...row, ...(this.#codes.get(slot) ?? [])]));
  }
}

export function digestState(state: State): string {
  const planes = [...state.positions, ...state.rotations, ...state.codes];
  return digest(Array.from({ length: state.count }, (_, row) => planes.map((plane) => plane[row] ?? 0)));
}

function digest(rows: number[][]): string {
  const sorted = rows.map((row) => row.join(" ")).sort();
  return createHash("sha256").update(sorted.join("\n")).digest("hex");
}
