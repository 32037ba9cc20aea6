/** Frames of a stream, decoded directly or received through a source, and the faults that tests expect. */

import assert from "node:assert/strict";
import { readFrames, StreamError } from "../src/decode/index.js";
import { QuarcModule, type FrameState } from "../src/decode/quarc.js";
import type { StreamSource } from "../src/protocol.js";
import { digestState, FrameRebuilder } from "./frame-rebuilder.js";

export interface DecodedFrame {
  readonly frame: number;
  readonly digest: string;
}

/** Digest the states that the decoder returns. The tests of core/ compare its states with the conformance suite. */
export function decodeDirectly(stream: Uint8Array): Promise<DecodedFrame[]> {
  return mapStates(stream, (state) => ({ frame: state.frame, digest: digestState(state) }));
}

/** Decode a stream, and return the results of a function for all states, which are only valid during its call. */
export async function mapStates<T>(stream: Uint8Array, describe: (state: FrameState) => T): Promise<T[]> {
  const decoder = (await QuarcModule.load()).open(0);
  decoder.put(0, stream);
  decoder.setLength(stream.length);
  const results: T[] = [];
  for (let state = decoder.decodeNext(); state !== "end" && state !== null; state = decoder.decodeNext()) {
    results.push(describe(state));
  }
  decoder.close();
  return results;
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
