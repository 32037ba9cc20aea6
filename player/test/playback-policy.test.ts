/** When frames are requested, shown and dropped, with a decode worker, a screen and a clock that the tests drive. */

import assert from "node:assert/strict";
import { afterEach, beforeEach, mock, test } from "node:test";
import { Playback } from "../src/playback.js";
import type { PlaybackEvents, Screen } from "../src/playback-events.js";
import type { DecodeReply, DecodeRequest, FramePacket, PlayerFault, StreamInfo } from "../src/protocol.js";
import { makeFault } from "../src/stream-error.js";

const FRAME_MS = 100;
const INFO = { timescale: 10, frameTicks: 1, firstFrame: 0, frameCount: null } as StreamInfo;

class FakeWorker {
  static last: FakeWorker;
  readonly requests: DecodeRequest[] = [];
  isTerminated = false;
  onmessage: ((event: { data: DecodeReply }) => void) | null = null;
  onerror: ((event: { message: string }) => void) | null = null;

  constructor() {
    FakeWorker.last = this;
  }

  postMessage(request: DecodeRequest): void {
    this.requests.push(request);
  }

  terminate(): void {
    this.isTerminated = true;
  }
}

let time = 0;
const document = { createElement: () => ({ href: "" }) };
Object.assign(globalThis, { Worker: FakeWorker, document, window: { setTimeout: (...rest: Parameters<typeof setTimeout>) => setTimeout(...rest) } });
beforeEach(() => {
  mock.timers.enable({ apis: ["setTimeout"] });
  mock.method(performance, "now", () => time);
});
afterEach(() => {
  mock.timers.reset();
  mock.restoreAll();
});

function advance(milliseconds: number): void {
  for (let elapsed = 0; elapsed < milliseconds; elapsed++) {
    time += 1;
    mock.timers.tick(1);
  }
}

/** Playback of a stream whose screen shows a packet at once; `shown` lists frames, times and durations of motion. */
class Rig {
  readonly shown: [frame: number, time: number, motionMs: number][] = [];
  readonly faults: PlayerFault[] = [];
  endCount = 0;
  finishedMotions = 0;
  readonly screen = { isBusy: false, isInHeadset: false, begin: () => undefined, finishMotion: () => void (this.finishedMotions += 1), show: this.#show.bind(this) };
  readonly playback: Playback;
  /** Whether a packet is shown only by `finishShowing`. */
  isSlow = false;
  #busyPacket: FramePacket | null = null;

  constructor() {
    const ignored = ["onInfo", "onState", "onLiveEdge", "onProgress", "onDecoded"].map((name) => [name, () => undefined]);
    const events = { ...Object.fromEntries(ignored), onEnded: () => (this.endCount += 1), onError: (fault: PlayerFault) => this.faults.push(fault) };
    this.playback = new Playback(this.screen as unknown as Screen, events as unknown as PlaybackEvents);
  }

  /** Open a stream and reply with its description and its first frames. */
  static open(frameCount: number, info: Partial<StreamInfo> = {}, startFrame: number | null = null): Rig {
    const rig = new Rig();
    rig.playback.open({ url: "a.quarc" }, startFrame);
    rig.reply({ kind: "info", info: { ...INFO, ...info }, run: 1 });
    rig.send(1, ...Array.from({ length: frameCount }, (_, frame) => frame));
    return rig;
  }

  get frames(): number[] {
    return this.shown.map(([frame]) => frame);
  }

  reply(data: DecodeReply): void {
    FakeWorker.last.onmessage?.({ data });
  }

  send(run: number, ...frames: number[]): void {
    for (const frame of frames) this.reply({ kind: "frame", packet: { frame, run, isPreview: false } as FramePacket });
  }

  /** Return the requests since the last call: "seek FRAME", or the number of frames that may be sent. */
  takeRequests(): (string | number)[] {
    const requests = FakeWorker.last.requests.splice(0);
    return requests.map((request) => (request.kind === "more" ? request.frames : request.kind === "seek" ? `seek ${request.frame}` : request.kind));
  }

  #show(packet: FramePacket, motionMs = 0): void {
    this.shown.push([packet.frame, time, motionMs]);
    this.#busyPacket = packet;
    if (this.isSlow) this.screen.isBusy = true;
    else this.finishShowing();
  }

  finishShowing(): void {
    this.screen.isBusy = false;
    if (this.#busyPacket !== null) this.playback.noteShown(this.#busyPacket);
  }
}

test("frames are shown when they are due, and a change of the speed applies to the frame that is due next", () => {
  const rig = Rig.open(6);
  const start = time;
  rig.playback.play();
  advance(FRAME_MS + 50);
  rig.playback.speed = 0.5; // the other half of the frame takes twice as long
  advance(100 + 200);
  rig.playback.speed = 2;
  advance(25);
  rig.playback.pause();
  advance(1000);
  const due = [[0, 0, 0], [1, 1, 0], [2, 100, 0], [3, 250, 200], [4, 450, 200]];
  assert.deepEqual(rig.shown.map(([frame, at, motionMs]) => [frame, at - start, motionMs]), due);
  assert.deepEqual([rig.playback.bufferedFrames, rig.playback.bufferedTo, rig.finishedMotions], [1, 6, 1]);
});

test("no frame is skipped after a late frame, which is counted if it is more than its duration late", () => {
  const rig = Rig.open(2);
  rig.playback.play();
  advance(FRAME_MS + 1 + 90);
  assert.equal(rig.playback.isWaiting, true);
  rig.send(1, 2); // 91 ms late
  assert.deepEqual([rig.playback.lateFrames, rig.playback.isWaiting], [0, false]);
  advance(FRAME_MS + 150);
  const lateTime = time;
  rig.send(1, 3, 4, 5);
  advance(FRAME_MS + 1);
  assert.equal(rig.playback.lateFrames, 1);
  assert.deepEqual(rig.shown.slice(-2).map(([frame, at]) => [frame, at - lateTime]), [[3, 1], [4, FRAME_MS + 1]]);
  rig.playback.setFrame(20);
  advance(10 * FRAME_MS);
  rig.send(2, 20);
  rig.playback.pause();
  rig.playback.step(1);
  advance(10 * FRAME_MS);
  rig.send(2, 21);
  assert.equal(rig.playback.lateFrames, 1, "neither seeks nor steps are late");
  rig.playback.open({ url: "b.quarc" });
  assert.equal(rig.playback.lateFrames, 0);
});

test("twelve frames are decoded ahead, and another one for every frame that is shown", () => {
  const rig = Rig.open(3);
  assert.deepEqual(rig.takeRequests(), ["open", 12, 1]);
  rig.playback.step(1);
  assert.deepEqual([rig.frames, rig.takeRequests()], [[0, 1], [1]]);
  rig.playback.step(-1);
  assert.deepEqual(rig.takeRequests(), ["seek 0", 12]);
  assert.equal(rig.playback.bufferedFrames, 0);
  rig.playback.isLooping = true;
  rig.send(2, 0, 1, 2);
  rig.takeRequests();
  rig.reply({ kind: "end", frameCount: 3, run: 2 });
  assert.deepEqual(rig.takeRequests(), ["seek 0", 10], "two frames are still in the buffer");
});

test("steps add up until their frames are decoded, and playback replaces them", () => {
  const rig = Rig.open(1);
  rig.playback.play();
  for (let count = 0; count < 2; count++) rig.playback.step(1);
  assert.deepEqual([rig.playback.isPlaying, rig.playback.isSeeking, rig.playback.isWaiting], [false, true, true]);
  rig.takeRequests();
  rig.playback.step(-1);
  assert.deepEqual(rig.takeRequests(), ["seek 1", 12]);
  rig.send(2, 1);
  for (let count = 0; count < 2; count++) rig.playback.step(1);
  rig.playback.play();
  rig.send(2, 2, 3);
  advance(1);
  assert.deepEqual(rig.frames, [0, 1, 2]);
});

test("a step ends if there is no further frame", () => {
  const rig = Rig.open(1);
  rig.playback.step(1);
  rig.reply({ kind: "end", frameCount: 1, run: 1 });
  assert.deepEqual([rig.playback.isSeeking, rig.endCount], [false, 0]);
});

test("replies to a replaced run are dropped, but a description of the same stream is not", () => {
  const rig = Rig.open(1);
  rig.playback.setFrame(7);
  rig.send(1, 1, 2);
  rig.reply({ kind: "end", frameCount: 3, run: 1 });
  rig.reply({ kind: "error", error: makeFault("network", ""), run: 1 });
  rig.reply({ kind: "info", info: { ...INFO, frameCount: 50 }, run: 1 });
  assert.deepEqual([rig.frames, rig.faults, rig.playback.extent.endFrame, rig.playback.target], [[0], [], 50, 7]);
  rig.playback.open({ url: "b.quarc" });
  rig.reply({ kind: "info", info: INFO, run: 2 });
  assert.equal(rig.playback.extent.info, null);
});

test("quick seeks are replaced by later ones, but one of them is shown every 150 ms", () => {
  const rig = Rig.open(1);
  rig.takeRequests();
  rig.playback.setFrame(10);
  rig.playback.setFrame(20);
  advance(149);
  assert.deepEqual([rig.takeRequests(), rig.playback.target], [["seek 10", 12], 20]);
  advance(1);
  assert.deepEqual(rig.takeRequests(), ["seek 20", 12]);
  rig.isSlow = true;
  rig.playback.setFrame(30);
  rig.send(3, 20);
  rig.finishShowing();
  assert.deepEqual([rig.frames, rig.takeRequests()], [[0, 20], [1, "seek 30", 12]], "at once after the frame");
  rig.send(4, 30);
  rig.finishShowing();
  assert.deepEqual([rig.frames, rig.playback.isSeeking], [[0, 20, 30], false]);
});

test("a frame that was being sorted when a seek began does not end the seek", () => {
  const rig = Rig.open(2);
  rig.isSlow = true;
  rig.playback.step(1);
  rig.playback.setFrame(9);
  rig.finishShowing();
  assert.deepEqual([rig.playback.frame, rig.playback.target, rig.playback.isSeeking], [1, 9, true]);
  rig.send(2, 9);
  rig.finishShowing();
  assert.deepEqual([rig.playback.frame, rig.playback.target, rig.playback.isSeeking], [9, 9, false]);
});

test("an error is reported after the frames before it, and a seek forgets it", () => {
  const rig = Rig.open(3);
  const fault = makeFault("network", "");
  rig.reply({ kind: "error", error: fault, run: 1 });
  rig.playback.step(1);
  rig.playback.step(1);
  assert.deepEqual(rig.faults, []);
  rig.playback.step(1);
  assert.deepEqual([rig.faults, rig.playback.isSeeking], [[fault], false]);
  rig.playback.setFrame(1);
  assert.equal(rig.playback.isWaiting, true);
  rig.send(2, 1);
  assert.deepEqual([rig.faults.length, rig.playback.frame], [1, 1]);
  rig.playback.setFrame(9);
  rig.reply({ kind: "error", error: fault, run: 3 });
  assert.equal(rig.playback.isWaiting, false);
});

test("a step at the last frame changes nothing, and playback starts again there", () => {
  const rig = Rig.open(2, { firstFrame: 0, frameCount: 2 });
  rig.reply({ kind: "end", frameCount: 2, run: 1 });
  rig.playback.step(1);
  rig.playback.step(1);
  assert.equal(rig.endCount, 0, "only playback ends");
  rig.send(2, 1);
  assert.deepEqual([rig.playback.frame, rig.playback.isSeeking], [1, false]);
  rig.reply({ kind: "end", frameCount: 2, run: 2 });
  rig.takeRequests();
  rig.playback.play();
  assert.deepEqual(rig.takeRequests(), ["seek 0", 12]);
  rig.send(3, 0, 1);
  rig.reply({ kind: "end", frameCount: 2, run: 3 });
  advance(FRAME_MS + 1);
  assert.deepEqual([rig.playback.frame, rig.playback.isPlaying, rig.playback.isWaiting], [1, true, false]);
  advance(FRAME_MS);
  assert.deepEqual([rig.endCount, rig.playback.isPlaying, rig.playback.frame], [1, false, 1]);
});

test("the frames of the next lap are dropped if the loop is disabled before them", () => {
  const rig = Rig.open(3);
  rig.playback.isLooping = true;
  rig.playback.play();
  rig.reply({ kind: "end", frameCount: 3, run: 1 });
  rig.send(2, 0, 1);
  advance(1);
  assert.equal(rig.playback.bufferedTo, 3, "the frames of the next lap do not follow the shown frame");
  rig.playback.isLooping = false;
  advance(5 * FRAME_MS);
  assert.deepEqual([rig.frames, rig.playback.isPlaying, rig.playback.bufferedFrames], [[0, 1, 2], false, 0]);
  rig.send(2, 2);
  assert.equal(rig.playback.bufferedFrames, 0);
  rig.takeRequests();
  rig.playback.play();
  assert.deepEqual(rig.takeRequests(), ["seek 0", 12]);
});

test("a loop shows the next lap without a gap", () => {
  const rig = Rig.open(2);
  rig.playback.isLooping = true;
  rig.playback.play();
  rig.reply({ kind: "end", frameCount: 2, run: 1 });
  rig.send(2, 0, 1);
  const start = time;
  advance(2 * FRAME_MS + 1);
  assert.deepEqual(rig.shown.map(([frame, at]) => [frame, at - start]), [[0, 0], [1, 1], [0, FRAME_MS], [1, 2 * FRAME_MS]]);
  rig.reply({ kind: "end", frameCount: 2, run: 2 });
  advance(3 * FRAME_MS);
  assert.deepEqual([rig.playback.isWaiting, rig.playback.isPlaying, rig.endCount], [true, true, 0], "waits for the next lap");
  rig.playback.pause();
  rig.send(3, 0, 1);
  rig.takeRequests();
  rig.playback.play();
  advance(1);
  assert.deepEqual([rig.playback.frame, rig.takeRequests()], [0, [1]]);
  rig.playback.step(1);
  rig.reply({ kind: "end", frameCount: 2, run: 3 });
  rig.send(4, 0);
  assert.equal(rig.playback.bufferedFrames, 1);
  rig.playback.isLooping = false;
  rig.send(4, 1);
  assert.equal(rig.playback.bufferedFrames, 0, "the next lap is dropped at once");
});

test("a loop also begins its next lap after a seek to the last frame", () => {
  const rig = Rig.open(1);
  rig.playback.isLooping = true;
  rig.playback.play();
  rig.playback.setFrame(2);
  rig.isSlow = true;
  rig.send(2, 2);
  rig.reply({ kind: "end", frameCount: 3, run: 2 }); // while frame 2 is being sorted
  rig.finishShowing();
  rig.takeRequests();
  advance(FRAME_MS);
  assert.deepEqual([rig.takeRequests(), rig.playback.isPlaying, rig.endCount], [["seek 0", 12], true, 0]);
});

test("a stream of one frame ends, also in a loop", () => {
  const rig = Rig.open(1);
  rig.playback.isLooping = true;
  rig.takeRequests();
  rig.reply({ kind: "end", frameCount: 1, run: 1 });
  assert.deepEqual(rig.takeRequests(), []);
});

test("only a headset and slow motion show pictures between two frames", () => {
  const rig = Rig.open(4);
  rig.screen.isInHeadset = true;
  rig.playback.step(1);
  rig.playback.play();
  advance(1);
  assert.deepEqual(rig.shown.map(([, , motionMs]) => motionMs), [0, 0, FRAME_MS]);
});

test("a stream that is opened at a frame shows neither another frame nor its preview", () => {
  const rig = Rig.open(2, {}, 5);
  rig.reply({ kind: "frame", packet: { frame: 0, run: 1, isPreview: true } as FramePacket });
  assert.deepEqual([rig.frames, rig.takeRequests(), rig.playback.target], [[], ["open", 12, "seek 5", 12], 5]);
  rig.send(2, 5);
  assert.deepEqual(rig.frames, [5]);
});

test("a stream that is opened at its first frame is not decoded again, and its previews precede its first frame", () => {
  const rig = new Rig();
  rig.isSlow = true;
  rig.playback.open({ url: "a.quarc" }, 0);
  rig.reply({ kind: "info", info: INFO, run: 1 });
  const sendPreview = (): void => rig.reply({ kind: "frame", packet: { frame: 0, run: 1, isPreview: true } as FramePacket });
  for (let count = 0; count < 2; count++) sendPreview(); // the second arrives while the first is being sorted
  rig.finishShowing();
  assert.deepEqual([rig.frames, rig.playback.frame, rig.playback.isSeeking], [[0], null, true]);
  rig.send(1, 0);
  rig.finishShowing();
  sendPreview();
  assert.deepEqual([rig.frames, rig.playback.frame, rig.takeRequests()], [[0, 0], 0, ["open", 12, 1]]);
});

test("the newest frame of a live stream is the target of a seek to infinity", () => {
  const rig = Rig.open(1);
  assert.equal(rig.playback.framesBehind, null);
  rig.reply({ kind: "edge", frame: 6, run: 1 });
  assert.equal(rig.playback.framesBehind, 6);
  rig.playback.setFrame(Infinity);
  assert.deepEqual([rig.takeRequests().slice(-2), rig.playback.target], [["seek Infinity", 12], 6]);
  rig.send(2, 6);
  rig.reply({ kind: "end", frameCount: 7, run: 2 });
  assert.deepEqual([rig.playback.framesBehind, rig.playback.extent.endFrame], [null, 7]);
  rig.playback.setFrame(99.6);
  assert.equal(rig.playback.target, 6);
});

test("a seek goes to the nearest frame of a stream that begins at frame 7", () => {
  const rig = Rig.open(0, { firstFrame: 7, frameCount: 5 });
  rig.send(1, 7);
  const targets = [0, 8.4, 8.6, 11.4, 12].map((frame) => (rig.playback.setFrame(frame), rig.playback.target));
  assert.deepEqual(targets, [7, 8, 9, 11, 11]);
  assert.equal(rig.playback.extent.endFrame, 12);
  advance(150);
  rig.reply({ kind: "end", frameCount: 4, run: 3 });
  assert.equal(rig.playback.extent.endFrame, 11);
});

test("a worker that has failed is replaced when the next stream is opened", () => {
  const rig = Rig.open(1);
  const failed = FakeWorker.last;
  failed.onerror?.({ message: "out of memory" });
  rig.playback.play();
  advance(1);
  assert.deepEqual(rig.faults.map(({ kind }) => kind), ["player"]);
  rig.playback.open({ url: "a.quarc" });
  assert.ok(failed.isTerminated && FakeWorker.last !== failed);
  rig.reply({ kind: "end", frameCount: 0, run: 2 });
  assert.deepEqual(rig.faults.map(({ kind }) => kind), ["player", "empty"]);
});
