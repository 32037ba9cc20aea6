/** The chart under the slider. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { Timeline, type TimelineExtent } from "../src/component/timeline.js";

const WIDTH = 480;
const HEIGHT = 34;

interface Rectangle {
  readonly color: string;
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

/** Draw a timeline on a canvas that only records rectangles. */
function drawRectangles(timeline: (canvas: HTMLCanvasElement) => Timeline, endFrame: number, more: Partial<TimelineExtent> = {}): Rectangle[] {
  Object.assign(globalThis, { devicePixelRatio: 1 });
  const rectangles: Rectangle[] = [];
  const context = {
    fillStyle: "",
    clearRect: () => undefined,
    fillRect(left: number, top: number, width: number, height: number) {
      rectangles.push({ color: this.fillStyle, left, top, width, height });
    },
  };
  const canvas = { clientWidth: WIDTH, clientHeight: HEIGHT, width: 0, height: 0, getContext: () => context };
  const extent = { firstFrame: 0, endFrame, shownFrame: 0, bufferedTo: 0, frameMs: 33, ...more };
  timeline(canvas as unknown as HTMLCanvasElement).draw(extent);
  return rectangles;
}

function makeTimeline(canvas: HTMLCanvasElement): Timeline {
  const timeline = new Timeline(canvas);
  const bars = [[0, 900, true], [1, 10, false], [2, 100, false], [3, 40, false]] as const;
  for (const [frame, bytes, isCanonical] of bars) timeline.add(frame, { bytes, decodeMs: 1, isCanonical });
  return timeline;
}

test("frames that share a pixel are drawn as the largest of them", () => {
  const [first, , second] = drawRectangles(makeTimeline, 2 * WIDTH); // after each bar, its decode time
  assert.deepEqual([first?.left, first?.height], [0, HEIGHT]);
  assert.deepEqual([second?.left, second?.height], [1, 0.85 * HEIGHT]);
});

test("the work does not grow with the number of frames that an index claims", (context) => {
  const { get } = Map.prototype;
  let lookups = 0;
  context.mock.method(Map.prototype, "get", function (this: Map<unknown, unknown>, key: unknown) {
    if (++lookups > 10 * WIDTH) throw new Error("too many frames are looked up");
    return get.call(this, key);
  });
  assert.ok(drawRectangles(makeTimeline, 2 ** 32 - 1).length > WIDTH);
});

test("bars show bytes, decode times and the position of playback", () => {
  const [frameWidth, extent] = [WIDTH / 6, { firstFrame: 1, shownFrame: 2, bufferedTo: 4, frameMs: 4 }];
  const rectangles = drawRectangles((canvas) => {
    const timeline = new Timeline(canvas);
    const bars = [[1, 9999, true, 1], [2, 25, false, 2], [3, 100, false, 9], [4, null, false, 0], [5, 81, false, 0]] as const;
    for (const [frame, bytes, isCanonical, decodeMs] of bars) timeline.add(frame, { bytes, decodeMs, isCanonical });
    timeline.add(5, { bytes: null, decodeMs: 0, isCanonical: false }); // decoded again after a seek
    return timeline;
  }, 7, extent);
  const playhead = rectangles.pop();
  assert.equal(playhead && playhead.left + playhead.width / 2, 1.5 * frameWidth);
  const bars = rectangles.filter(({ color }) => color !== "#ffb454");
  assert.deepEqual(bars.map(({ left }) => left), [0, 1, 2, 3, 4, 5].map((index) => index * frameWidth));
  const heights = [1, 0.85 / 2, 0.85, 0, 0.85 * 0.9, 0].map((height) => Math.max(2, height * HEIGHT));
  assert.deepEqual(bars.map(({ height }) => height), heights);
  const [canonical, played, buffered, known, empty] = ["#e6ebf2", "#6aa8ff", "#5b6675", "#3d4550", "#2b313a"];
  assert.deepEqual(bars.map(({ color }) => color), [canonical, played, buffered, known, known, empty]);
  const times = rectangles.filter(({ color }) => color === "#ffb454").map(({ top }) => HEIGHT - 1 - top);
  assert.deepEqual(times, [0.25, 0.5, 1, 0, 0].map((time) => time * (HEIGHT - 1)));
});

test("the bars of another stream do not depend on those of the stream before it", () => {
  const rectangles = drawRectangles((canvas) => {
    const timeline = makeTimeline(canvas);
    timeline.clear();
    timeline.add(1, { bytes: 25, decodeMs: 1, isCanonical: false });
    return timeline;
  }, 3);
  assert.deepEqual(rectangles.filter(({ color }) => color !== "#ffb454").map(({ height }) => height), [2, 0.85 * HEIGHT, 2, HEIGHT]);
});

test("the tooltip describes a frame that has been decoded", () => {
  const timeline = makeTimeline(null as unknown as HTMLCanvasElement);
  timeline.add(4, { bytes: null, decodeMs: 0.25, isCanonical: false });
  const texts = ["frame 0 · 900 bytes, canonical · decoded in 1.0 ms", "frame 4 · size unknown · decoded in 0.3 ms", "frame 9"];
  assert.deepEqual([0, 4, 9].map((frame) => timeline.describe(frame)), texts);
});
