/**
 * Prints a summary of a stream and the changes in each frame: node examples/node.mjs FILE-OR-URL [FIRST-FRAME]
 *
 * In your own project: import { readFrames, StreamError } from "quarc-player/decode".
 */

import { readFileSync } from "node:fs";
import { readFrames, StreamError } from "../dist/quarc-decode.js";

const [location, startFrame = "0"] = process.argv.slice(2);
if (location === undefined) {
  console.error("usage: node examples/node.mjs FILE-OR-URL [FIRST-FRAME]");
  process.exit(2);
}

const isAddress = /^https?:/.test(location);
const source = isAddress ? { url: location } : { bytes: new Uint8Array(readFileSync(location)).buffer };

function onInfo({ timescale, frameTicks, frameCount, cameras }) {
  const frameRate = timescale / frameTicks;
  console.log(`${frameCount ?? "?"} frames, ${frameRate} per second, ${cameras.length} cameras`);
}

try {
  for await (const packet of readFrames(source, { from: Number(startFrame), onInfo })) {
    const { frame, count, movedSlots, codedSlots, bytes } = packet;
    const changes = `${movedSlots.length} moved, ${codedSlots.length} recoded`;
    console.log(`frame ${frame}: ${count} Gaussians, ${changes}, ${bytes} bytes`);
  }
} catch (error) {
  if (!(error instanceof StreamError)) throw error;
  const { kind, rejectId, message } = error.fault;
  console.error(`${kind}${rejectId === null ? "" : ` (${rejectId})`}: ${message}`);
  process.exitCode = 1;
}
