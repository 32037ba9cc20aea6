import type { PlayerFault } from "./protocol.js";

/** A stream that cannot be received or decoded; `fault` says why. */
export class StreamError extends Error {
  override readonly name = "StreamError";
  constructor(readonly fault: PlayerFault) {
    super(fault.message);
  }
}
