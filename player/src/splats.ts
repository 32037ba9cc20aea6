/** Gaussians as floats, for other renderers: SPEC 10.1 and 10.2, without view-dependent color. */

import type { FramePacket, StreamInfo } from "./protocol.js";

const SH_C0 = 0.28209479177387814;
const ROTATION_UNITY = 2 ** 22;
const OPACITY_MOST = 0.99; // SPEC 10.3

/**
 * The Gaussians of a frame. Each keeps its slot from birth to death. Packets are applied in order.
 *
 * Colors have SH degree 0, the same from all directions.
 */
export class Splats {
  /** All slots in use are below this. An unused slot has opacity 0. */
  slotLimit = 0;
  /** [n, 3] xyz, world units; the array is replaced when it grows. */
  positions = new Float32Array(0);
  /** [n, 4] xyzw, unit quaternions. */
  rotations = new Float32Array(0);
  /** [n, 3] standard deviations along the Gaussian's axes, world units. */
  scales = new Float32Array(0);
  /** [n, 3] red, green, blue, sRGB, not negative. */
  colors = new Float32Array(0);
  /** [n] from 0 to 0.99. */
  opacities = new Float32Array(0);
  readonly #info: StreamInfo;
  #isChanged = new Uint8Array(0);

  constructor(info: StreamInfo) {
    this.#info = info;
  }

  /** Apply the changes of a frame; returns the changed slots, ascending. */
  apply(packet: FramePacket): Uint32Array {
    this.#reserve(packet.slotLimit);
    if (packet.isFull) this.#clear();
    this.slotLimit = Math.max(packet.isFull ? 0 : this.slotLimit, packet.slotLimit);
    this.#move(packet);
    this.#recode(packet);
    for (const slot of packet.freedSlots) this.#mark(slot).opacities[slot] = 0;
    return this.#takeChanged();
  }

  #move({ movedSlots, positions, rotations }: FramePacket): void {
    const unit = 2 ** -this.#info.latticeExponent;
    movedSlots.forEach((slot, row) => {
      this.#mark(slot);
      for (let k = 0; k < 3; k++) this.positions[3 * slot + k] = unit * positions[3 * row + k]!;
      for (let k = 0; k < 4; k++) { // w is first in a packet
        this.rotations[4 * slot + k] = rotations[4 * row + ((k + 1) & 3)]! / ROTATION_UNITY;
      }
    });
  }

  #recode({ codedSlots, codes }: FramePacket): void {
    const { logScaleStep, opacityStep, shDcStep } = this.#info;
    const width = codes.length / Math.max(1, codedSlots.length);
    codedSlots.forEach((slot, row) => {
      this.#mark(slot);
      const at = width * row;
      for (let k = 0; k < 3; k++) {
        this.scales[3 * slot + k] = Math.exp(logScaleStep * codes[at + k]!);
        this.colors[3 * slot + k] = Math.max(0, 0.5 + SH_C0 * shDcStep * codes[at + 4 + k]!);
      }
      this.opacities[slot] = Math.min(OPACITY_MOST, 1 / (1 + Math.exp(-opacityStep * codes[at + 3]!)));
    });
  }

  #mark(slot: number): this {
    this.#isChanged[slot] = 1;
    return this;
  }

  #clear(): void {
    this.#isChanged.fill(1, 0, this.slotLimit);
    this.opacities.fill(0);
  }

  #takeChanged(): Uint32Array {
    const slots: number[] = [];
    for (let slot = this.#isChanged.indexOf(1); slot >= 0; slot = this.#isChanged.indexOf(1, slot + 1)) slots.push(slot);
    this.#isChanged.fill(0);
    return Uint32Array.from(slots);
  }

  #reserve(count: number): void {
    const room = this.opacities.length;
    if (count <= room) return;
    const size = Math.max(count, Math.ceil(1.5 * room));
    const grow = (old: Float32Array, width: number): Float32Array<ArrayBuffer> => {
      const array = new Float32Array(width * size);
      array.set(old);
      return array;
    };
    this.positions = grow(this.positions, 3);
    this.rotations = grow(this.rotations, 4);
    this.scales = grow(this.scales, 3);
    this.colors = grow(this.colors, 3);
    this.opacities = grow(this.opacities, 1);
    const isChanged = new Uint8Array(size);
    isChanged.set(this.#isChanged);
    this.#isChanged = isChanged;
  }
}
