/** From chunks to states: what each chunk makes of the state before (SPEC 5.1, 7, 9.2). */

import { checkCameras, checkMetadata } from "./ancillary.js";
import { parseCanonical } from "./canonical.js";
import type { Chunk } from "./chunks.js";
import { stateCrc } from "./digest.js";
import { decodeFrame, parseFrame } from "./frame.js";
import type { StreamHeader } from "./header.js";
import { demand } from "./reject.js";
import { parseSnapshot, decodeSnapshot } from "./snapshots.js";
import type { Canonical } from "./snapshots.js";
import { canonicalState, decodeCanonical } from "./state.js";
import type { State } from "./state.js";
import { StreamRecord } from "./tail.js";
import type { SeekPoint } from "./tail.js";

export class StateDecoder {
  readonly #header: StreamHeader;
  #record = new StreamRecord();
  #state: State | null = null;
  #due: number | null = null;
  /** The last CANO, in streams with snapshots; it stays where critical chunks are left out. */
  #canonical: Canonical | null = null;

  constructor(header: StreamHeader) {
    this.#header = header;
  }

  /** The ordinal of the next frame, or null where it may have any. */
  get due(): number | null {
    return this.#due;
  }

  /** The ordinal of the frame of the last CANO, or null where no snapshot may come. */
  get canonical(): number | null {
    return this.#canonical?.frame ?? null;
  }

  /** The state that a chunk makes, compared with its CRC, or null of a chunk that makes none. */
  decode(chunk: Chunk): State | null {
    switch (chunk.type) {
      case "CANO":
        return this.#keep(this.#proveCanonical(chunk));
      case "SNAP":
        return this.#keep(this.#proveSnapshot(chunk));
      case "FRAM":
        return this.#keep(this.#proveFrame(chunk));
      case "INDX":
        this.#record.checkIndex(chunk);
        return null;
      case "TAIL":
        this.#record.checkTail(chunk);
        return null;
      case "came":
        checkCameras(chunk.payload);
        return null;
      case "meta":
        checkMetadata(chunk.payload);
        return null;
      default:
        // An ancillary chunk of a type that is not known: its CRCs and its length were checked.
        return null;
    }
  }

  /** Go on at a canonical frame whose ordinal is `due`, or at TAIL, past critical chunks that were left out (11.4). */
  resume(due: number | null): void {
    this.#state = null;
    this.#due = due;
    this.#record.leaveOut();
  }

  /** Go on at a canonical frame that INDX, or who counted, has led to, behind so many frames and seek points (11.2). */
  seek(frameCount: number, points: readonly SeekPoint[]): void {
    this.#state = null;
    this.#due = null;
    this.#record = new StreamRecord(frameCount, points);
  }

  #proveCanonical(chunk: Chunk): State {
    const canonical = parseCanonical(chunk.payload);
    const gaussians = decodeCanonical(canonical, this.#due, this.#header);
    const state = this.#prove(canonicalState(canonical.frame, gaussians, this.#header), canonical.stateCrc);
    if (this.#header.snapshots) this.#canonical = { frame: canonical.frame, gaussians };
    this.#record.addCanonical(chunk, state.ordinal);
    return state;
  }

  #proveSnapshot(chunk: Chunk): State {
    demand(this.#canonical !== null, "chunk-order", "SNAP comes before the first CANO");
    const snapshot = parseSnapshot(chunk.payload);
    const gaussians = decodeSnapshot(snapshot, this.#canonical, this.#due, this.#header);
    const state = this.#prove(canonicalState(snapshot.frame, gaussians, this.#header), snapshot.stateCrc);
    this.#record.addCanonical(chunk, state.ordinal);
    return state;
  }

  #proveFrame(chunk: Chunk): State {
    demand(this.#state !== null, "chunk-order", "FRAM comes before the first CANO");
    const frame = parseFrame(chunk.payload, this.#header);
    const state = this.#prove(decodeFrame(frame, this.#state, this.#header), frame.stateCrc);
    this.#record.addFrame();
    return state;
  }

  /** A state, once it is compared with the CRC of its chunk. */
  #prove(state: State, crc: number): State {
    const found = stateCrc(state.scene, state.phase, state.phase % this.#header.fullCrcInterval === 0);
    demand(found === crc, "state-crc", `the state of frame ${state.ordinal} does not match its CRC`);
    return state;
  }

  #keep(state: State): State {
    this.#state = state;
    this.#due = state.ordinal + 1;
    return state;
  }
}
