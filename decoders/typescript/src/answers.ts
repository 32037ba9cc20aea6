/** The output lines for a stream: one line per frame, and a last line if the stream is rejected or declined. */

import { decodeStream } from "./decode.js";
import type { Frame } from "./decode.js";
import { digestNumbers } from "./dequantize.js";
import { digestState } from "./digest.js";
import { recoverStream } from "./recover.js";
import type { Gap } from "./recover.js";
import { Declined, Rejection } from "./reject.js";
import { seekStream } from "./seek.js";
import type { Source } from "./source.js";

export type Line = Readonly<Record<string, unknown>>;

/** Generate the lines of a stream; each line is generated before the next frame is decoded. */
export function answerStream(source: Source, includesNumbers = false): Generator<Line, void, undefined> {
  return answerFrames(() => decodeStream(source), includesNumbers);
}

/** Generate the lines of the frames from ordinal `start` onwards. */
export function answerSeek(
  bytes: Uint8Array,
  start: number,
  includesNumbers = false,
): Generator<Line, void, undefined> {
  return answerFrames(() => seekStream(bytes, start), includesNumbers);
}

function* answerFrames(frames: () => Iterable<Frame>, includesNumbers: boolean): Generator<Line, void, undefined> {
  try {
    for (const frame of frames()) {
      const numbersField = includesNumbers ? { numbers_sha256: digestNumbers(frame.state.scene, frame.header) } : {};
      yield { ...answerFrame(frame), ...numbersField };
    }
  } catch (error) {
    yield answerError(error);
  }
}

/** Generate the lines of a damaged stream: its recovered frames and its gaps, in order. */
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
  return { frame: ordinal, gaussians: scene.ids.length, sha256: digestState(scene, phase) };
}

function answerGap({ offset, bytes, rejectId, framesLost }: Gap): Line {
  return { gap: { offset, bytes, refused: rejectId, frames_lost: framesLost } };
}

/** Return the line for a rejected or declined stream; throw any other error again. */
export function answerError(error: unknown): Line {
  if (error instanceof Rejection) return { refused: error.rejectId };
  if (error instanceof Declined) return { declined: error.message };
  throw error;
}
