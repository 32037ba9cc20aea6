import type { PlayerFault } from "./protocol.js";

/** A stream cannot be received or decoded; `fault` gives the reason. */
export class StreamError extends Error {
  override readonly name = "StreamError";
  constructor(readonly fault: PlayerFault) {
    super(fault.message);
  }
}
