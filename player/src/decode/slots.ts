/** Converts states to packets: a Gaussian keeps its slot from birth to death, and packets list the changes. */

import type { FramePacket } from "../protocol.js";
import type { FrameState } from "./quarc.js";

const NO_SLOT = 0xffff_ffff;
const MOTION_PLANES = 7;

/** The fields of a packet that do not describe Gaussians. */
export type PacketMetadata = Pick<FramePacket, "run" | "bytes" | "decodeMs">;

export class SlotTracker {
  #previousIds = new Uint32Array(0);
  #slotByRow = new Uint32Array(0); // the slot of each row of the state
  #birthRows: number[] = []; // rows whose Gaussian is new
  #freeSlots: number[] = [];
  #slotLimit = 0;
  #isNextFull = true;
  // By slot: the values in the last packet, and whether the current frame changes them.
  #knownMotion = new Int32Array(0);
  #knownCodes: Int16Array[] = [];
  #movedFlags = new Uint8Array(0);
  #codedFlags = new Uint8Array(0);

  /** Make the packet of the next state; the first packet contains all Gaussians. */
  makePacket(state: FrameState, hasUpdates: boolean, metadata: PacketMetadata): FramePacket {
    const freedSlots = this.#assignSlots(state.ids);
    this.#grow(state.codes.length);
    this.#movedFlags.fill(0);
    this.#codedFlags.fill(0);
    for (const row of this.#birthRows) {
      const slot = this.#slotByRow[row] as number;
      this.#movedFlags[slot] = this.#codedFlags[slot] = 1;
    }
    updateMotion(state, this.#slotByRow, this.#knownMotion, this.#movedFlags);
    this.#updateCodes(state, hasUpdates);
    const [movedSlots, codedSlots] = [listMarkedSlots(this.#movedFlags), listMarkedSlots(this.#codedFlags)];
    const packet = {
      ...{ frame: state.frame, ...metadata, isFull: this.#isNextFull, isPreview: false },
      ...{ count: state.count, slotLimit: this.#slotLimit, isCanonical: state.phase === 0 },
      ...{ movedSlots, ...gatherMotion(this.#knownMotion, movedSlots) },
      ...{ codedSlots, codes: gatherCodes(this.#knownCodes, codedSlots), freedSlots, bornSlots: this.#listBornSlots() },
    };
    this.#isNextFull = false;
    return packet;
  }

  #listBornSlots(): Uint32Array {
    return this.#isNextFull ? new Uint32Array(0) : Uint32Array.from(this.#birthRows, (row) => this.#slotByRow[row] as number).sort();
  }

  #updateCodes({ phase, codes }: FrameState, hasUpdates: boolean): void {
    codes.forEach((plane, column) => {
      const knownCodes = this.#knownCodes[column] as Int16Array;
      if (phase === 0 || hasUpdates) updatePlane(plane, this.#slotByRow, knownCodes, this.#codedFlags);
      else for (const row of this.#birthRows) knownCodes[this.#slotByRow[row] as number] = plane[row] as number;
    });
  }

  /** Assign a slot to every row; return the slots that are no longer used. `ids` must be ascending. */
  #assignSlots(ids: Uint32Array): Uint32Array {
    const [previousIds, previousSlots] = [this.#previousIds, this.#slotByRow];
    const slotByRow = new Uint32Array(ids.length);
    const unusedSlots: number[] = [];
    const birthRows: number[] = [];
    let previousRow = 0;
    for (let row = 0; row < ids.length; row++) {
      const id = ids[row] as number;
      while (previousRow < previousIds.length && (previousIds[previousRow] as number) < id) {
        unusedSlots.push(previousSlots[previousRow++] as number);
      }
      const isKnown = previousRow < previousIds.length && previousIds[previousRow] === id;
      slotByRow[row] = isKnown ? (previousSlots[previousRow++] as number) : NO_SLOT;
      if (!isKnown) birthRows.push(row);
    }
    while (previousRow < previousIds.length) unusedSlots.push(previousSlots[previousRow++] as number);
    const freeSlots = this.#freeSlots.concat(unusedSlots);
    for (const row of birthRows) slotByRow[row] = freeSlots.pop() ?? this.#slotLimit++;
    this.#birthRows = birthRows;
    this.#freeSlots = freeSlots;
    this.#previousIds = ids.slice();
    this.#slotByRow = slotByRow;
    const freeSlotSet = new Set(unusedSlots.length > 0 ? freeSlots : []);
    return Uint32Array.from(unusedSlots.filter((slot) => freeSlotSet.has(slot))).sort();
  }

  /** Grow the arrays so that they cover all slots. */
  #grow(codePlaneCount: number): void {
    if (this.#slotLimit <= this.#movedFlags.length && this.#knownCodes.length === codePlaneCount) return;
    const capacity = Math.ceil(1.25 * this.#slotLimit);
    this.#knownMotion = enlarge(Int32Array, this.#knownMotion, MOTION_PLANES * capacity);
    this.#knownCodes = Array.from({ length: codePlaneCount }, (_, column) =>
      enlarge(Int16Array, this.#knownCodes[column], capacity),
    );
    this.#movedFlags = new Uint8Array(capacity);
    this.#codedFlags = new Uint8Array(capacity);
  }
}

/** Update the known positions and rotations, and set the flags of the slots that changed. */
function updateMotion(
  state: FrameState,
  slots: Uint32Array,
  knownMotion: Int32Array,
  changedFlags: Uint8Array,
): void {
  const [x, y, z] = state.positions as [Int32Array, Int32Array, Int32Array];
  const [w, i, j, k] = state.rotations as [Int32Array, Int32Array, Int32Array, Int32Array];
  for (let row = 0; row < slots.length; row++) {
    const slot = slots[row] as number;
    const base = MOTION_PLANES * slot;
    if (
      knownMotion[base] === x[row] &&
      knownMotion[base + 1] === y[row] &&
      knownMotion[base + 2] === z[row] &&
      knownMotion[base + 3] === w[row] &&
      knownMotion[base + 4] === i[row] &&
      knownMotion[base + 5] === j[row] &&
      knownMotion[base + 6] === k[row]
    ) {
      continue;
    }
    changedFlags[slot] = 1;
    knownMotion[base] = x[row] as number;
    knownMotion[base + 1] = y[row] as number;
    knownMotion[base + 2] = z[row] as number;
    knownMotion[base + 3] = w[row] as number;
    knownMotion[base + 4] = i[row] as number;
    knownMotion[base + 5] = j[row] as number;
    knownMotion[base + 6] = k[row] as number;
  }
}

/** Update the known codes of one plane, and set the flags of the slots that changed. */
function updatePlane(
  plane: Int16Array,
  slots: Uint32Array,
  knownCodes: Int16Array,
  changedFlags: Uint8Array,
): void {
  for (let row = 0; row < slots.length; row++) {
    const slot = slots[row] as number;
    const code = plane[row] as number;
    if (knownCodes[slot] === code) continue;
    knownCodes[slot] = code;
    changedFlags[slot] = 1;
  }
}

/** List the slots whose flags are set, ascending. */
function listMarkedSlots(changedFlags: Uint8Array): Uint32Array {
  // Without a branch: every slot is written, and the next slot overwrites it if its flag is not set.
  const slots = new Uint32Array(changedFlags.length + 1);
  let count = 0;
  for (let slot = 0; slot < changedFlags.length; slot++) {
    slots[count] = slot;
    count += changedFlags[slot] as number;
  }
  return slots.slice(0, count);
}

type Motion = Pick<FramePacket, "positions" | "rotations">;

function gatherMotion(knownMotion: Int32Array, slots: Uint32Array): Motion {
  const positions = new Int32Array(3 * slots.length);
  const rotations = new Int32Array(4 * slots.length);
  for (let index = 0; index < slots.length; index++) {
    const base = MOTION_PLANES * (slots[index] as number);
    for (let axis = 0; axis < 3; axis++) positions[3 * index + axis] = knownMotion[base + axis] as number;
    for (let component = 0; component < 4; component++) {
      rotations[4 * index + component] = knownMotion[base + 3 + component] as number;
    }
  }
  return { positions, rotations };
}

function gatherCodes(planes: readonly Int16Array[], slots: Uint32Array): Int16Array {
  const codes = new Int16Array(planes.length * slots.length);
  planes.forEach((plane, column) => {
    for (let index = 0, codeIndex = column; index < slots.length; index++, codeIndex += planes.length) {
      codes[codeIndex] = plane[slots[index] as number] as number;
    }
  });
  return codes;
}

type IntegerArray = Int32Array | Int16Array;

function enlarge<T extends IntegerArray>(
  arrayType: new (length: number) => T,
  values: T | undefined,
  capacity: number,
): T {
  const larger = new arrayType(capacity);
  if (values !== undefined) larger.set(values);
  return larger;
}
