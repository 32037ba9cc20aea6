/** Converts states to packets: every Gaussian keeps a slot as long as it lives, and packets list the changes. */

import type { FramePacket } from "../protocol.js";
import type { State } from "./quarc.js";

const NO_SLOT = 0xffff_ffff;
const MOTION_PLANES = 7;

/** The fields of a packet that are not about Gaussians. */
export type Extras = Pick<FramePacket, "run" | "bytes" | "decodeMs">;

export class Slots {
  #ids = new Uint32Array(0);
  #rows = new Uint32Array(0); // the slot of each row of the state
  #births: number[] = []; // rows whose Gaussian is new
  #free: number[] = [];
  #limit = 0;
  #isFull = true;
  // Indexed by slot: the last known values, and what this frame changed.
  #motion = new Int32Array(0);
  #codes: Int16Array[] = [];
  #isMoved = new Uint8Array(0);
  #isCoded = new Uint8Array(0);

  /** The packet of the next state; the first one is complete. */
  take(state: State, hasUpdates: boolean, extras: Extras): FramePacket {
    const freedSlots = this.#assign(state.ids);
    this.#grow(state.codes.length);
    this.#isMoved.fill(0);
    this.#isCoded.fill(0);
    for (const row of this.#births) {
      const slot = this.#rows[row] as number;
      this.#isMoved[slot] = this.#isCoded[slot] = 1;
    }
    updateMotion(state, this.#rows, this.#motion, this.#isMoved);
    this.#updateCodes(state, hasUpdates);
    const [movedSlots, codedSlots] = [list(this.#isMoved), list(this.#isCoded)];
    const packet = {
      ...{ frame: state.frame, ...extras, isFull: this.#isFull, isPreview: false },
      ...{ count: state.count, slotLimit: this.#limit, isCanonical: state.phase === 0 },
      ...{ movedSlots, ...gatherMotion(this.#motion, movedSlots) },
      ...{ codedSlots, codes: gatherCodes(this.#codes, codedSlots), freedSlots },
    };
    this.#isFull = false;
    return packet;
  }

  #updateCodes({ phase, codes }: State, hasUpdates: boolean): void {
    codes.forEach((plane, at) => {
      const known = this.#codes[at] as Int16Array;
      if (phase === 0 || hasUpdates) updatePlane(plane, this.#rows, known, this.#isCoded);
      else for (const row of this.#births) known[this.#rows[row] as number] = plane[row] as number;
    });
  }

  /** Give every row its slot; returns the slots that are no longer used. Ids ascend. */
  #assign(ids: Uint32Array): Uint32Array {
    const [before, known] = [this.#ids, this.#rows];
    const rows = new Uint32Array(ids.length);
    const left: number[] = [];
    const births: number[] = [];
    let old = 0;
    for (let row = 0; row < ids.length; row++) {
      const id = ids[row] as number;
      while (old < before.length && (before[old] as number) < id) left.push(known[old++] as number);
      const isKnown = old < before.length && before[old] === id;
      rows[row] = isKnown ? (known[old++] as number) : NO_SLOT;
      if (!isKnown) births.push(row);
    }
    while (old < before.length) left.push(known[old++] as number);
    const free = this.#free.concat(left);
    for (const row of births) rows[row] = free.pop() ?? this.#limit++;
    this.#births = births;
    this.#free = free;
    this.#ids = ids.slice();
    this.#rows = rows;
    const isFree = new Set(left.length > 0 ? free : []);
    return Uint32Array.from(left.filter((slot) => isFree.has(slot))).sort();
  }

  /** Grow the arrays to all slots. */
  #grow(codePlanes: number): void {
    if (this.#limit <= this.#isMoved.length && this.#codes.length === codePlanes) return;
    const room = Math.ceil(1.25 * this.#limit);
    this.#motion = enlarge(Int32Array, this.#motion, MOTION_PLANES * room);
    this.#codes = Array.from({ length: codePlanes }, (_, at) =>
      enlarge(Int16Array, this.#codes[at], room),
    );
    this.#isMoved = new Uint8Array(room);
    this.#isCoded = new Uint8Array(room);
  }
}

/** Update the known positions and rotations, and mark the slots that changed. */
function updateMotion(state: State, slots: Uint32Array, known: Int32Array, marks: Uint8Array): void {
  const [x, y, z] = state.positions as [Int32Array, Int32Array, Int32Array];
  const [w, i, j, k] = state.rotations as [Int32Array, Int32Array, Int32Array, Int32Array];
  for (let row = 0; row < slots.length; row++) {
    const slot = slots[row] as number;
    const at = MOTION_PLANES * slot;
    if (
      known[at] === x[row] &&
      known[at + 1] === y[row] &&
      known[at + 2] === z[row] &&
      known[at + 3] === w[row] &&
      known[at + 4] === i[row] &&
      known[at + 5] === j[row] &&
      known[at + 6] === k[row]
    ) {
      continue;
    }
    marks[slot] = 1;
    known[at] = x[row] as number;
    known[at + 1] = y[row] as number;
    known[at + 2] = z[row] as number;
    known[at + 3] = w[row] as number;
    known[at + 4] = i[row] as number;
    known[at + 5] = j[row] as number;
    known[at + 6] = k[row] as number;
  }
}

/** Update the known codes of one plane, likewise. */
function updatePlane(plane: Int16Array, slots: Uint32Array, known: Int16Array, marks: Uint8Array): void {
  for (let row = 0; row < slots.length; row++) {
    const slot = slots[row] as number;
    const code = plane[row] as number;
    if (known[slot] === code) continue;
    known[slot] = code;
    marks[slot] = 1;
  }
}

/** The marked slots, ascending. */
function list(marks: Uint8Array): Uint32Array {
  const slots = new Uint32Array(marks.length + 1); // each slot is written before it is known whether it counts
  let count = 0;
  for (let slot = 0; slot < marks.length; slot++) {
    slots[count] = slot;
    count += marks[slot] as number;
  }
  return slots.slice(0, count);
}

type Motion = Pick<FramePacket, "positions" | "rotations">;

function gatherMotion(known: Int32Array, slots: Uint32Array): Motion {
  const positions = new Int32Array(3 * slots.length);
  const rotations = new Int32Array(4 * slots.length);
  for (let place = 0; place < slots.length; place++) {
    const at = MOTION_PLANES * (slots[place] as number);
    for (let axis = 0; axis < 3; axis++) positions[3 * place + axis] = known[at + axis] as number;
    for (let part = 0; part < 4; part++) rotations[4 * place + part] = known[at + 3 + part] as number;
  }
  return { positions, rotations };
}

function gatherCodes(planes: readonly Int16Array[], slots: Uint32Array): Int16Array {
  const codes = new Int16Array(planes.length * slots.length);
  planes.forEach((plane, column) => {
    for (let at = 0, place = column; at < slots.length; at++, place += planes.length) {
      codes[place] = plane[slots[at] as number] as number;
    }
  });
  return codes;
}

type Numbers = Int32Array | Int16Array;

function enlarge<T extends Numbers>(type: new (length: number) => T, known: T | undefined, room: number): T {
  const larger = new type(room);
  if (known !== undefined) larger.set(known);
  return larger;
}
