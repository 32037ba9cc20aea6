/** Output about a stream: one line per frame, and a last line if the stream is not decoded to its end. */

import { decodeStream } from "./decode.js";
import type { Frame } from "./decode.js";
import { numbersDigest } from "./dequantize.js";
import { stateDigest } from "./digest.js";
import { recoverStream } from "./recover.js";
import type { Gap } from "./recover.js";
import { Declined, Rejection } from "./reject.js";
import { seekStream } from "./seek.js";
import type { Source } from "./source.js";

export type Line = Readonly<Record<string, unknown>>;

/** The lines of a stream; each is produced before the next frame is decoded. */
export function answerStream(source: Source, withNumbers = false): Generator<Line, void, undefined> {
  return answerFrames(() => decodeStream(source), withNumbers);
}

/** The lines of the frames from `start` on. */
export function answerSeek(bytes: Uint8Array, start: number, withNumbers = false): Generator<Line, void, undefined> {
  return answerFrames(() => seekStream(bytes, start), withNumbers);
}

function* answerFrames(frames: () => Iterable<Frame>, withNumbers: boolean): Generator<Line, void, undefined> {
  try {
    for (const frame of frames()) {
      const numbers = withNumbers ? { numbers_sha256: numbersDigest(frame.state.scene, frame.header) } : {};
      yield { ...answerFrame(frame), ...numbers };
    }
  } catch (error) {
    yield answerError(error);
  }
}

/** The lines of a stream decoded with recovery: frames and gaps in order. */
export function* answerRecovery(bytes: Uint8Array): Generator<Line, void, undefined> {
  try {
    for (const part of recoverStream(bytes)) {
      yield "frame" in part ? answerFrame(part.frame) : answerGap(part.gap);
    }
  } catch (error) {
    yield answerError(error);
  }
}

function answerFrame({ state: { ordinal, phase, scene } }: Frame): Line {
  return { frame: ordinal, gaussians: scene.ids.length, sha256: stateDigest(scene, phase) };
}

function answerGap({ offset, bytes, rejectId, framesLost }: Gap): Line {
  return { gap: { offset, bytes, refused: rejectId, frames_lost: framesLost } };
}

/** The line of a rejection, or of a stream that is declined. */
export function answerError(error: unknown): Line {
  if (error instanceof Rejection) return { refused: error.rejectId };
  if (error instanceof Declined) return { declined: error.message };
  throw error;
}
