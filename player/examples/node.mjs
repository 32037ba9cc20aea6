/**
 * Prints a summary of a stream and the changes in each frame: node examples/node.mjs FILE-OR-URL [FROM]
 *
 * In your own project: import { readFrames, StreamError } from "quarc-player/decode".
 */

import { readFileSync } from "node:fs";
import { readFrames, StreamError } from "../dist/quarc-decode.js";

const [place, from = "0"] = process.argv.slice(2);
if (place === undefined) {
  console.error("usage: node examples/node.mjs FILE-OR-URL [FROM]");
  process.exit(2);
}

const isAddress = /^https?:/.test(place);
const source = isAddress ? { url: place } : { bytes: new Uint8Array(readFileSync(place)).buffer };

function onInfo({ timescale, frameTicks, frameCount, cameras }) {
  const rate = timescale / frameTicks;
  console.log(`${frameCount ?? "?"} frames, ${rate} a second, ${cameras.length} cameras`);
}

try {
  for await (const packet of readFrames(source, { from: Number(from), onInfo })) {
    const { frame, count, movedSlots, codedSlots, bytes } = packet;
    const changed = `${movedSlots.length} moved, ${codedSlots.length} recoded`;
    console.log(`frame ${frame}: ${count} Gaussians, ${changed}, ${bytes} bytes`);
  }
} catch (error) {
  if (!(error instanceof StreamError)) throw error;
  const { kind, rejectId, message } = error.fault;
  console.error(`${kind}${rejectId === null ? "" : ` (${rejectId})`}: ${message}`);
  process.exitCode = 1;
}
