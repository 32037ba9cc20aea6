/** Lists the recovered frames and the gaps of a stream in a short form. */

import assert from "node:assert/strict";
import { digestState } from "../src/digest.js";
import { recoverStream } from "../src/recover.js";
import { Rejection } from "../src/reject.js";

/** A frame as its ordinal; a gap as its offset, length, reject id and number of lost frames. */
export type RecoveredItem = number | readonly [number, number, string, number | null];

/** Recover a stream; return its frames and gaps, and a gap at -1 if it is rejected. Checks digests if they are given. */
export function listRecoveredParts(bytes: Uint8Array, digests?: ReadonlyMap<number, string>): RecoveredItem[] {
  const parts: RecoveredItem[] = [];
  try {
    for (const part of recoverStream(bytes)) {
      if ("gap" in part) {
        const { offset, bytes: count, rejectId, framesLost } = part.gap;
        parts.push([offset, count, rejectId, framesLost]);
      } else {
        const { ordinal, phase, scene } = part.frame.state;
        if (digests !== undefined) assert.equal(digestState(scene, phase), digests.get(ordinal));
        parts.push(ordinal);
      }
    }
  } catch (error) {
    if (!(error instanceof Rejection)) throw error;
    parts.push([-1, 0, error.rejectId, null]);
  }
  return parts;
}
