/** What is said of a stream: a line for every frame, and one for a stream that is not decoded to its end. */

import { decodeStream } from "./decode.js";
import { numbersDigest } from "./dequantize.js";
import { stateDigest } from "./digest.js";
import { Declined, Rejection } from "./reject.js";
import type { Source } from "./source.js";

export type Line = Readonly<Record<string, unknown>>;

/** The lines of a stream, of which one is written before the next frame is decoded. */
export function* answerStream(source: Source, withNumbers = false): Generator<Line, void, undefined> {
  try {
    for (const { header, state } of decodeStream(source)) {
      const { ordinal, phase, scene } = state;
      const numbers = withNumbers ? { numbers_sha256: numbersDigest(scene, header) } : {};
      yield { frame: ordinal, gaussians: scene.ids.length, sha256: stateDigest(scene, phase), ...numbers };
    }
  } catch (error) {
    yield answerError(error);
  }
}

/** The line of a rejection, or of a stream that is declined. */
export function answerError(error: unknown): Line {
  if (error instanceof Rejection) return { refused: error.rejectId };
  if (error instanceof Declined) return { declined: error.message };
  throw error;
}
