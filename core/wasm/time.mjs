/**
 * Measures decoding in Node: node time.mjs FILE [FRAMES]. Processor time of pulling frames, without
 * digests. QUARC_WASM names another module than quarc.wasm.
 */

import { readFileSync } from "node:fs";
import { Quarc } from "./quarc.mjs";

const [path, most] = process.argv.slice(2);
const stream = readFileSync(path);
const file = process.env.QUARC_WASM ?? new URL("quarc.wasm", import.meta.url);
const quarc = await Quarc.load(readFileSync(file));
const decoder = quarc.open();
decoder.push(stream);
decoder.finish();

const milliseconds = () => process.cpuUsage().user / 1000 + process.cpuUsage().system / 1000;
const times = [];
let [begin, gaussians] = [milliseconds(), 0];
for (let { state } = decoder.pull(); state; { state } = decoder.pull()) {
  gaussians = state.count;
  const end = milliseconds();
  times.push(end - begin);
  begin = end;
  if (times.length === Number(most)) break;
}
if (times.length === 0) throw new Error(`${path} has no frames`);
const digest = decoder.digest();
const [first, ...others] = times;
others.sort((a, b) => a - b);
const mean = others.reduce((sum, time) => sum + time, 0) / others.length;
const median = others[others.length >> 1];
const later =
  others.length > 0 ? `then mean ${mean.toFixed(1)} ms, median ${median.toFixed(1)} ms; ` : "";
console.log(
  `${times.length} frames, ${gaussians} Gaussians, ${digest.slice(0, 16)}: first ${first.toFixed(0)} ms, ` +
    `${later}memory ${(quarc.memoryBytes / 2 ** 20).toFixed(0)} MiB`,
);
