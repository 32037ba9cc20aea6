/** The statistics of playback, and their texts. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { describeLoaded, formatBytes, listStatistics } from "../src/component/format.js";
import type { FramePacket, StreamInfo } from "../src/protocol.js";
import { Recorder } from "../src/statistics.js";

const PACKET = {
  ...{ count: 12345, movedSlots: new Uint32Array(7), codedSlots: new Uint32Array(9) },
  ...{ bytes: 2048, isCanonical: true, decodeMs: 1.25 },
} as FramePacket;
const COST = { sortMs: 2, uploadMs: 3 };
const COUNTS = { bufferedFrames: 1, lateFrames: 0, framesBehind: null };

test("statistics describe the last frame, and count the frames of the last second", (context) => {
  let time = 0;
  context.mock.method(performance, "now", () => time);
  const recorder = new Recorder();
  assert.equal(recorder.read(COUNTS), null);
  for (time = 0; time < 3000; time += 100) recorder.add({ ...PACKET, count: time } as FramePacket, COST);
  const { gaussians, changed, frameBytes, sortMs, uploadMs, framesPerSecond } = recorder.read(COUNTS)!;
  assert.deepEqual([gaussians, changed, frameBytes, sortMs, uploadMs, framesPerSecond], [2900, 9, 2048, 2, 3, 10]);
  time += 500;
  assert.equal(recorder.read(COUNTS)?.framesPerSecond, 5);
});

test("the panel lists every value, and the frames behind live only in a live stream", () => {
  const recorder = new Recorder();
  recorder.add(PACKET, COST);
  const info = { timescale: 30000, frameTicks: 1001 } as StreamInfo;
  const rows = listStatistics(recorder.read(COUNTS)!, info).map(([name, value]) => `${name}: ${value}`);
  assert.deepEqual(rows, [
    ...["Gaussians: 12,345", "changed: 9", "frame: 2.0 KB, canonical", "decode: 1.3 ms", "sort: 2.0 ms", "upload: 3.0 ms"],
    ...["buffer: 1 frame", "shown: 1 of 30 per second", "late: 0 frames"],
  ]);
  const live = listStatistics(recorder.read({ ...COUNTS, framesBehind: 2 })!, info);
  assert.deepEqual(live.at(-1), ["behind live", "2 frames"]);
});

test("a KB is 1024 bytes", () => {
  const texts = ["size unknown", "0 bytes", "1023 bytes", "1.0 KB", "1023.0 KB", "1.0 MB", "10.0 MB"];
  assert.deepEqual([null, 0, 1023, 1024, 1023 * 1024, 2 ** 20, 10 * 2 ** 20].map(formatBytes), texts);
  assert.deepEqual([describeLoaded(0, 5), describeLoaded(512, 1024), describeLoaded(512, null)], ["", "512 bytes of 1.0 KB", "512 bytes"]);
});
