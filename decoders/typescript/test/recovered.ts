/** A short form of what is recovered of a stream. */

import assert from "node:assert/strict";
import { stateDigest } from "../src/digest.js";
import { recoverStream } from "../src/recover.js";
import { Rejection } from "../src/reject.js";

/** A frame as its ordinal; a gap as its offset, length, reject id and number of lost frames. */
export type Part = number | readonly [number, number, string, number | null];

/** The frames and gaps of a stream, and a gap at -1 if it is rejected; checks the digests of the frames. */
export function recovered(bytes: Uint8Array, digests?: ReadonlyMap<number, string>): Part[] {
  const parts: Part[] = [];
  try {
    for (const part of recoverStream(bytes)) {
      if ("gap" in part) {
        const { offset, bytes: count, rejectId, framesLost } = part.gap;
        parts.push([offset, count, rejectId, framesLost]);
      } else {
        const { ordinal, phase, scene } = part.frame.state;
        if (digests !== undefined) assert.equal(stateDigest(scene, phase), digests.get(ordinal));
        parts.push(ordinal);
      }
    }
  } catch (error) {
    if (!(error instanceof Rejection)) throw error;
    parts.push([-1, 0, error.rejectId, null]);
  }
  return parts;
}
