/** Decodes chunks to states (SPEC 5.1, 7, 9.2). */

import { checkCameras, checkMetadata } from "./ancillary.js";
import { parseCanonical } from "./canonical.js";
import type { Chunk } from "./chunks.js";
import { computeStateCrc } from "./digest.js";
import { decodeFrame, parseFrame } from "./frame.js";
import type { StreamHeader } from "./header.js";
import { demand } from "./reject.js";
import { parseSnapshot, decodeSnapshot } from "./snapshots.js";
import type { Canonical } from "./snapshots.js";
import { makeCanonicalState, decodeCanonical } from "./state.js";
import type { State } from "./state.js";
import { StreamRecord } from "./tail.js";
import type { SeekPoint } from "./tail.js";

export class StateDecoder {
  readonly #header: StreamHeader;
  #record = new StreamRecord();
  #state: State | null = null;
  #due: number | null = null;
  /** The last decoded CANO, in streams with snapshots; it remains valid after critical chunks are lost. */
  #canonical: Canonical | null = null;

  constructor(header: StreamHeader) {
    this.#header = header;
  }

  /** The expected ordinal of the next frame; null if any ordinal is allowed. */
  get due(): number | null {
    return this.#due;
  }

  /** The ordinal of the last decoded CANO; null if no snapshot can be decoded. */
  get canonical(): number | null {
    return this.#canonical?.frame ?? null;
  }

  /** Decode a chunk; return its state, whose CRC has been checked, or null if the chunk has no state. */
  decode(chunk: Chunk): State | null {
    switch (chunk.type) {
      case "CANO":
        return this.#setState(this.#decodeCanonical(chunk));
      case "SNAP":
        return this.#setState(this.#decodeSnapshot(chunk));
      case "FRAM":
        return this.#setState(this.#decodeFrame(chunk));
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
        // An ancillary chunk of unknown type; its CRCs and length have already been checked.
        return null;
    }
  }

  /** Continue, after skipped critical chunks, at a canonical frame with ordinal `due`, or at TAIL (11.4). */
  resume(due: number | null): void {
    this.#state = null;
    this.#due = due;
    this.#record.noteSkippedChunks();
  }

  /** Continue, after a seek, at a canonical frame that `frameCount` frames and `points` precede (11.2). */
  seek(frameCount: number, points: readonly SeekPoint[]): void {
    this.#state = null;
    this.#due = null;
    this.#record = new StreamRecord(frameCount, points);
  }

  #decodeCanonical(chunk: Chunk): State {
    const canonical = parseCanonical(chunk.payload);
    const gaussians = decodeCanonical(canonical, this.#due, this.#header);
    const state = this.#checkState(makeCanonicalState(canonical.frame, gaussians, this.#header), canonical.stateCrc);
    if (this.#header.hasSnapshots) this.#canonical = { frame: canonical.frame, gaussians };
    this.#record.addCanonical(chunk, state.ordinal);
    return state;
  }

  #decodeSnapshot(chunk: Chunk): State {
    demand(this.#canonical !== null, "chunk-order", "SNAP comes before the first CANO");
    const snapshot = parseSnapshot(chunk.payload);
    const gaussians = decodeSnapshot(snapshot, this.#canonical, this.#due, this.#header);
    const state = this.#checkState(makeCanonicalState(snapshot.frame, gaussians, this.#header), snapshot.stateCrc);
    this.#record.addCanonical(chunk, state.ordinal);
    return state;
  }

  #decodeFrame(chunk: Chunk): State {
    demand(this.#state !== null, "chunk-order", "FRAM comes before the first CANO");
    const frame = parseFrame(chunk.payload, this.#header);
    const state = this.#checkState(decodeFrame(frame, this.#state, this.#header), frame.stateCrc);
    this.#record.addFrame();
    return state;
  }

  /** Check a state against the state CRC of its chunk, and return it. */
  #checkState(state: State, crc: number): State {
    const computedCrc = computeStateCrc(state.scene, state.phase, state.phase % this.#header.fullCrcInterval === 0);
    demand(computedCrc === crc, "state-crc", `the state of frame ${state.ordinal} does not match its CRC`);
    return state;
  }

  #setState(state: State): State {
    this.#state = state;
    this.#due = state.ordinal + 1;
    return state;
  }
}
