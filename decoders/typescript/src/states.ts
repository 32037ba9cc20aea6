/** From chunks to states (SPEC 5.1, 7, 9.2). */

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
  /** The last CANO, in streams with snapshots; it remains valid after lost critical chunks. */
  #canonical: Canonical | null = null;

  constructor(header: StreamHeader) {
    this.#header = header;
  }

  /** The ordinal of the next frame, or null if it may have any. */
  get due(): number | null {
    return this.#due;
  }

  /** The ordinal of the frame of the last CANO, or null if a snapshot is not allowed. */
  get canonical(): number | null {
    return this.#canonical?.frame ?? null;
  }

  /** Decode a chunk: its state, after checking its CRC, or null if it has none. */
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
        // An ancillary chunk of unknown type: its CRCs and length have been checked.
        return null;
    }
  }

  /** After critical chunks were skipped, continue at a canonical frame with ordinal `due`, or at TAIL (11.4). */
  resume(due: number | null): void {
    this.#state = null;
    this.#due = due;
    this.#record.leaveOut();
  }

  /** After seeking, continue at a canonical frame, with the frames and seek points that precede it (11.2). */
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

  /** Check a state against the CRC of its chunk and return it. */
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
