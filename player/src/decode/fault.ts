/** Errors as the page receives them. */

import type { PlayerFault } from "../protocol.js";
import { QuarcError } from "./quarc.js";
import { NetworkError } from "./source.js";

/** Describe an error; `frame` is the ordinal of the frame that could not be decoded. */
export function describe(error: unknown, frame: number | null): PlayerFault {
  const message = error instanceof Error ? error.message : String(error);
  const rejectId = error instanceof QuarcError ? error.rejectId : null;
  return { kind: kindOf(error), message, rejectId, frame };
}

function kindOf(error: unknown): PlayerFault["kind"] {
  if (error instanceof NetworkError) return "network";
  if (error instanceof QuarcError) return error.rejectId === null ? "limit" : "rejected";
  return error instanceof WebAssembly.RuntimeError ? "limit" : "player";
}
