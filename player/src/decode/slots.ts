/** States to packets: a slot to each Gaussian for as long as it lives, and what changed of it. */

import type { FramePacket } from "../protocol.js";
import type { State } from "./quarc.js";

const NO_SLOT = 0xffff_ffff;
const POSITION_PLANES = 3;
const MOTION_PLANES = 7;

/** What a packet tells beside the Gaussians. */
export type Extras = Pick<FramePacket, "run" | "bytes" | "decodeMs">;

export class Slots {
  #ids = new Uint32Array(0);
  #rows = new Uint32Array(0); // the slot of each row of the state
  #free: number[] = [];
  #limit = 0;
  #isFull = true;
  // By slot: what is known of it, and what this frame did to it.
  #motion: Int32Array[] = [];
  #codes: Int16Array[] = [];
  #isMoved = new Uint8Array(0);
  #isCoded = new Uint8Array(0);

  /** The packet of the next state; that of the first one is full. */
  take(state: State, extras: Extras): FramePacket {
    const freed = this.#assign(state.ids);
    this.#grow(state.codes.length);
    this.#isMoved.fill(0);
    this.#isCoded.fill(0);
    const [births, known] = [this.#births, this.#rows];
    for (const slot of births) this.#isMoved[slot] = this.#isCoded[slot] = 1;
    const motion = [...state.positions, ...state.rotations];
    motion.forEach((plane, row) => update(plane, known, at(this.#motion, row), this.#isMoved));
    state.codes.forEach((plane, row) => update(plane, known, at(this.#codes, row), this.#isCoded));
    const [movedSlots, codedSlots] = [list(this.#isMoved), list(this.#isCoded)];
    const packet = {
      ...{ frame: state.frame, ...extras, isFull: this.#isFull },
      ...{ count: state.count, slotLimit: this.#limit, isCanonical: state.phase === 0 },
      movedSlots,
      positions: gather(Int32Array, this.#motion.slice(0, POSITION_PLANES), movedSlots),
      rotations: gather(Int32Array, this.#motion.slice(POSITION_PLANES), movedSlots),
      codedSlots,
      codes: gather(Int16Array, this.#codes, codedSlots),
      freedSlots: freed,
    };
    this.#isFull = false;
    return packet;
  }

  #births: number[] = [];

  /** Give every row its slot; returns the slots that nobody has any longer. Ids ascend. */
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
    this.#births = births.map((row) => (rows[row] = free.pop() ?? this.#limit++));
    this.#free = free;
    this.#ids = ids.slice();
    this.#rows = rows;
    const isFree = new Set(left.length > 0 ? free : []);
    return Uint32Array.from(left.filter((slot) => isFree.has(slot))).sort();
  }

  /** Make room for all slots. */
  #grow(codePlanes: number): void {
    if (this.#limit <= this.#isMoved.length && this.#codes.length === codePlanes) return;
    const room = Math.ceil(1.25 * this.#limit);
    this.#motion = Array.from({ length: MOTION_PLANES }, (_, at) =>
      enlarge(Int32Array, this.#motion[at], room),
    );
    this.#codes = Array.from({ length: codePlanes }, (_, at) =>
      enlarge(Int16Array, this.#codes[at], room),
    );
    this.#isMoved = new Uint8Array(room);
    this.#isCoded = new Uint8Array(room);
  }
}

type Numbers = Int32Array | Int16Array;

/** Bring what is known of a plane up to date, and mark the slots where it was not. */
function update(plane: Numbers, slots: Uint32Array, known: Numbers, marks: Uint8Array): void {
  for (let row = 0; row < plane.length; row++) {
    const slot = slots[row] as number;
    const number = plane[row] as number;
    if (known[slot] !== number) {
      known[slot] = number;
      marks[slot] = 1;
    }
  }
}

/** The slots that are marked, ascending. */
function list(marks: Uint8Array): Uint32Array {
  const slots = new Uint32Array(marks.length);
  let count = 0;
  for (let slot = 0; slot < marks.length; slot++) {
    slots[count] = slot;
    count += marks[slot] as number;
  }
  return slots.slice(0, count);
}

/** A row to each of some slots. */
function gather<T extends Numbers>(type: new (length: number) => T, planes: T[], slots: Uint32Array): T {
  const width = planes.length;
  const rows = new type(slots.length * width);
  planes.forEach((plane, column) => {
    for (let at = 0, place = column; at < slots.length; at++, place += width) {
      rows[place] = plane[slots[at] as number] as number;
    }
  });
  return rows;
}

function enlarge<T extends Numbers>(type: new (length: number) => T, known: T | undefined, room: number): T {
  const larger = new type(room);
  if (known !== undefined) larger.set(known);
  return larger;
}

function at<T>(planes: readonly T[], at: number): T {
  return planes[at] as T;
}
