/** Dequantized Gaussians for other renderers (SPEC 10.1 and 10.2), without view-dependent color. */

import type { FramePacket, StreamInfo } from "./protocol.js";

const SH_C0 = 0.28209479177387814;
const ROTATION_ONE = 2 ** 22;
const MAX_OPACITY = 0.99; // SPEC 10.3

/**
 * The Gaussians of a frame, by slot. A Gaussian keeps its slot from birth to death. Packets must be applied in order.
 *
 * Colors are those of SH degree 0, which are the same from all directions.
 */
export class Splats {
  /** All used slots are below this number. An unused slot has opacity 0. */
  slotLimit = 0;
  /** [N, 3] xyz, world units. When the number of slots grows, all arrays are replaced. */
  positions: Float32Array = new Float32Array(0);
  /** [N, 4] xyzw, unit quaternions. */
  rotations: Float32Array = new Float32Array(0);
  /** [N, 3] standard deviations along the axes of the Gaussian, world units. */
  scales: Float32Array = new Float32Array(0);
  /** [N, 3] red, green and blue in sRGB, at least 0. */
  colors: Float32Array = new Float32Array(0);
  /** [N] opacities, from 0 to 0.99. */
  opacities: Float32Array = new Float32Array(0);
  readonly #info: StreamInfo;
  #changedFlags = new Uint8Array(0);

  constructor(info: StreamInfo) {
    this.#info = info;
  }

  /** Apply the changes of a frame; return the changed slots, ascending. */
  apply(packet: FramePacket): Uint32Array {
    this.#reserve(packet.slotLimit);
    if (packet.isFull) this.#clear();
    this.slotLimit = Math.max(packet.isFull ? 0 : this.slotLimit, packet.slotLimit);
    this.#updateMotion(packet);
    this.#updateCodes(packet);
    for (const slot of packet.freedSlots) this.#markChanged(slot).opacities[slot] = 0;
    return this.#takeChangedSlots();
  }

  #updateMotion({ movedSlots, positions, rotations }: FramePacket): void {
    const latticeUnit = 2 ** -this.#info.latticeExponent;
    movedSlots.forEach((slot, row) => {
      this.#markChanged(slot);
      for (let k = 0; k < 3; k++) this.positions[3 * slot + k] = latticeUnit * positions[3 * row + k]!;
      for (let k = 0; k < 4; k++) { // wxyz in a packet, xyzw here
        this.rotations[4 * slot + k] = rotations[4 * row + ((k + 1) & 3)]! / ROTATION_ONE;
      }
    });
  }

  #updateCodes({ codedSlots, codes }: FramePacket): void {
    const { logScaleStep, opacityStep, shDcStep } = this.#info;
    const width = codes.length / Math.max(1, codedSlots.length);
    codedSlots.forEach((slot, row) => {
      this.#markChanged(slot);
      const start = width * row;
      for (let k = 0; k < 3; k++) {
        this.scales[3 * slot + k] = Math.exp(logScaleStep * codes[start + k]!);
        this.colors[3 * slot + k] = Math.max(0, 0.5 + SH_C0 * shDcStep * codes[start + 4 + k]!);
      }
      this.opacities[slot] = Math.min(MAX_OPACITY, 1 / (1 + Math.exp(-opacityStep * codes[start + 3]!)));
    });
  }

  #markChanged(slot: number): this {
    this.#changedFlags[slot] = 1;
    return this;
  }

  #clear(): void {
    this.#changedFlags.fill(1, 0, this.slotLimit);
    this.opacities.fill(0);
  }

  #takeChangedSlots(): Uint32Array {
    const slots: number[] = [];
    const flags = this.#changedFlags;
    for (let slot = flags.indexOf(1); slot >= 0; slot = flags.indexOf(1, slot + 1)) slots.push(slot);
    flags.fill(0);
    return Uint32Array.from(slots);
  }

  #reserve(count: number): void {
    const capacity = this.opacities.length;
    if (count <= capacity) return;
    const newCapacity = Math.max(count, Math.ceil(1.5 * capacity));
    const grow = (values: Float32Array, width: number): Float32Array => {
      const larger = new Float32Array(width * newCapacity);
      larger.set(values);
      return larger;
    };
    this.positions = grow(this.positions, 3);
    this.rotations = grow(this.rotations, 4);
    this.scales = grow(this.scales, 3);
    this.colors = grow(this.colors, 3);
    this.opacities = grow(this.opacities, 1);
    const changedFlags = new Uint8Array(newCapacity);
    changedFlags.set(this.#changedFlags);
    this.#changedFlags = changedFlags;
  }
}
