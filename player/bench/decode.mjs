/**
 * Measures decoding: node bench/decode.mjs FILE [FRAMES], after npm run build.
 *
 * Prints the processor time of decoding frames to packets; the first frame is reported separately.
 */

import { readFileSync } from "node:fs";
import { readFrames } from "../dist/quarc-decode.js";

const [path, maxFrames = "Infinity"] = process.argv.slice(2);
if (path === undefined) {
  console.error("usage: node bench/decode.mjs FILE [FRAMES]");
  process.exit(2);
}

const readProcessorMs = () => {
  const { user, system } = process.cpuUsage();
  return (user + system) / 1000;
};

const frameTimes = [];
const bytes = new Uint8Array(readFileSync(path)).buffer;
let [startTime, gaussianCount, movedCount] = [readProcessorMs(), 0, 0];
for await (const packet of readFrames({ bytes })) {
  const endTime = readProcessorMs();
  frameTimes.push(endTime - startTime);
  startTime = endTime;
  gaussianCount = packet.count;
  movedCount += packet.isFull ? 0 : packet.movedSlots.length;
  if (frameTimes.length === Number(maxFrames)) break;
}
const [firstTime = 0, ...otherTimes] = frameTimes;
const meanTime = otherTimes.reduce((sum, time) => sum + time, 0) / otherTimes.length;
console.log(
  `${frameTimes.length} frames of ${gaussianCount} Gaussians, ${Math.round(movedCount / otherTimes.length)} of them moved: ` +
    `first ${firstTime.toFixed(0)} ms, then ${meanTime.toFixed(1)} ms, ${(1000 / meanTime).toFixed(1)} frames per second`,
);
