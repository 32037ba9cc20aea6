/** The chart under the slider. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { Timeline } from "../src/component/timeline.js";

const WIDTH = 480;
const HEIGHT = 34;

interface Rectangle {
  readonly color: string;
  readonly left: number;
  readonly height: number;
}

/** Draw a timeline on a canvas that only records rectangles. */
function drawRectangles(timeline: (canvas: HTMLCanvasElement) => Timeline, endFrame: number): Rectangle[] {
  Object.assign(globalThis, { devicePixelRatio: 1 });
  const rectangles: Rectangle[] = [];
  const context = {
    fillStyle: "",
    clearRect: () => undefined,
    fillRect(left: number, _top: number, _width: number, height: number) {
      rectangles.push({ color: this.fillStyle, left, height });
    },
  };
  const canvas = { clientWidth: WIDTH, clientHeight: HEIGHT, width: 0, height: 0, getContext: () => context };
  timeline(canvas as unknown as HTMLCanvasElement).draw({ firstFrame: 0, endFrame, shownFrame: 0, bufferedTo: 0, frameMs: 33 });
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
