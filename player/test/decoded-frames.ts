/** Frames of a stream, decoded directly or received through a source, and the faults that tests expect. */

import assert from "node:assert/strict";
import { readFrames, StreamError } from "../src/decode/index.js";
import { QuarcModule } from "../src/decode/quarc.js";
import type { StreamSource } from "../src/protocol.js";
import { digestState, FrameRebuilder } from "./frame-rebuilder.js";

export interface DecodedFrame {
  readonly frame: number;
  readonly digest: string;
}

/** Digest the states that the decoder returns. The tests of core/ compare its states with the conformance suite. */
export async function decodeDirectly(stream: Uint8Array): Promise<DecodedFrame[]> {
  const decoder = (await QuarcModule.load()).open(0);
  decoder.put(0, stream);
  decoder.setLength(stream.length);
  const frames: DecodedFrame[] = [];
  for (let state = decoder.decodeNext(); state !== "end" && state !== null; state = decoder.decodeNext()) {
    frames.push({ frame: state.frame, digest: digestState(state) });
  }
  decoder.close();
  return frames;
}

export async function readSource(source: StreamSource, startFrame = 0): Promise<DecodedFrame[]> {
  const rebuilt = new FrameRebuilder();
  const frames: DecodedFrame[] = [];
  for await (const packet of readFrames(source, { from: startFrame })) {
    frames.push({ frame: packet.frame, digest: rebuilt.apply(packet) });
  }
  return frames;
}

/** Check that an error is a `StreamError` of a kind, with a reject id or null. */
export function expectFault(kind: string, rejectId: string | null): (error: unknown) => boolean {
  return (error) => {
    assert.ok(error instanceof StreamError, String(error));
    assert.deepEqual([error.fault.kind, error.fault.rejectId], [kind, rejectId], error.message);
    return true;
  };
}
