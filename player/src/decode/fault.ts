/** Converts errors to the faults that the page receives. */

import type { PlayerFault } from "../protocol.js";
import { ModuleError, QuarcError } from "./quarc.js";
import { NetworkError } from "./source.js";

/** Convert an error to a fault; `frame` is the ordinal of the frame that could not be decoded, or null. */
export function describeError(error: unknown, frame: number | null): PlayerFault {
  const message = error instanceof Error ? error.message : String(error);
  const rejectId = error instanceof QuarcError ? error.rejectId : null;
  return { kind: faultKind(error), message, rejectId, frame };
}

function faultKind(error: unknown): PlayerFault["kind"] {
  if (error instanceof NetworkError) return "network";
  if (error instanceof QuarcError) return error.rejectId === null ? "limit" : "rejected";
  return error instanceof ModuleError || error instanceof WebAssembly.RuntimeError ? "limit" : "player";
}
