import type { PlayerFault } from "./protocol.js";

/** Make a fault that concerns neither a rule of SPEC 3.3 nor a single frame. */
export function makeFault(kind: PlayerFault["kind"], message: string): PlayerFault {
  return { kind, message, rejectId: null, frame: null };
}

/** A stream cannot be received or decoded; `fault` gives the reason. */
export class StreamError extends Error {
  override readonly name = "StreamError";
  constructor(readonly fault: PlayerFault) {
    super(fault.message);
  }
}
