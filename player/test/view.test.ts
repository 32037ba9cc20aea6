/** How drags, fingers, the wheel and keys move the view, on a canvas and a stage that only record. */

import assert from "node:assert/strict";
import { after, test } from "node:test";
import { fitArea, widenEye, type Eye, type Vector } from "../src/draw/eye.js";
import type { Stage } from "../src/draw/stage.js";
import type { CaptureCamera, FramePacket, StreamInfo } from "../src/protocol.js";
import { Controls } from "../src/view/controls.js";
import { findDistance, makeCamera, samplePositions } from "../src/view/scene.js";
import { Viewer } from "../src/view/viewer.js";

const WIDTH = 800; // of the canvas
const PIVOT: Vector = [0, 0, 0];
const NEAR_POINT: Vector = [0, 0, -1]; // between the camera and the pivot
const CAMERA: CaptureCamera = {
  ...{ name: "front", isHeldOut: false, width: 400, height: 300, fx: 500, fy: 500, cx: 200, cy: 150, near: 0.1 },
  ...{ rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1], translation: [0, 0, 4] }, // at z = -4, looking at the pivot
};
/** In a left-handed world, the camera's right is the world's left. */
const MIRRORED: CaptureCamera = { ...CAMERA, rotation: [-1, 0, 0, 0, 1, 0, 0, 0, 1] };

const frameRequests: ((now: number) => void)[] = [];
let time = 0;
Object.assign(globalThis, {
  requestAnimationFrame: (callback: (now: number) => void) => frameRequests.push(callback),
  cancelAnimationFrame: () => frameRequests.splice(0),
  WheelEvent: { DOM_DELTA_LINE: 1 },
});
const { now: realNow } = performance;
performance.now = () => time;
after(() => void (performance.now = realNow));

class FakeCanvas extends EventTarget {
  readonly clientWidth = WIDTH;
  readonly style = { touchAction: "" };
  tabIndex = -1;
  hasAttribute = (): boolean => true;
  focus(): void {}
  setPointerCapture(): void {}

  send(type: string, fields: object): void {
    this.dispatchEvent(Object.assign(new Event(type, { cancelable: true }), { pointerId: 1, buttons: 1 }, fields));
  }
}

/** Make a view of a stream with one camera; the pivot is at the median depth of the Gaussians, which is the origin. */
function makeView({ camera = CAMERA, upAxis = 4 } = {}): {
  canvas: FakeCanvas;
  controls: Controls;
  viewer: Viewer;
  locate: (point: Vector) => Vector;
  framing: () => string;
} {
  let [eye, framing]: [Eye, string] = [camera, ""];
  const stage = { setView: (newEye: Eye, newFraming: string) => ([eye, framing] = [newEye, newFraming]) };
  const viewer = new Viewer(stage as unknown as Stage, () => undefined);
  const info = { cameras: [camera], upAxis, metadata: {}, latticeExponent: 0 } as unknown as StreamInfo;
  viewer.begin(info, null);
  viewer.measure({ positions: Int32Array.from([...PIVOT, ...PIVOT, 0, 0, -1]) } as FramePacket, info);
  const canvas = new FakeCanvas();
  const controls = new Controls(canvas as unknown as HTMLCanvasElement, viewer);
  /** Return the pixel of a point on a canvas whose width is filled, and its depth. */
  const locate = ([x, y, z]: Vector): Vector => {
    const dot = (row: number): number =>
      [x, y, z].reduce((sum, value, axis) => sum + value * eye.rotation[3 * row + axis]!, eye.translation[row]!);
    const scale = WIDTH / camera.width;
    return [(scale * eye.fx * dot(0)) / dot(2), (scale * eye.fy * dot(1)) / dot(2), dot(2)];
  };
  return { canvas, controls, viewer, locate, framing: () => framing };
}

function drag(canvas: FakeCanvas, [right, down]: readonly [number, number], more: object = {}): void {
  canvas.send("pointerdown", { clientX: 100, clientY: 100, ...more });
  canvas.send("pointermove", { clientX: 100 + right, clientY: 100 + down, ...more });
  canvas.send("pointerup", more);
}

const assertNear = (actual: readonly number[], expected: readonly number[]): void =>
  assert.ok(actual.every((value, axis) => Math.abs(value - expected[axis]!) < 1e-6), `${actual}; expected ${expected}`);

/** Check that a change moves a point right and down in the picture, or not, by the signs of `direction`. */
function expectMotion(view: ReturnType<typeof makeView>, change: () => void, direction: readonly [number, number]): void {
  const [x, y] = view.locate(NEAR_POINT);
  change();
  const [newX, newY] = view.locate(NEAR_POINT);
  assert.deepEqual([newX - x, newY - y].map((value) => Math.sign(Math.round(1e6 * value)) + 0), direction);
}

/** Views in right- and left-handed worlds, upright and upside down. */
const VIEWS = [{}, { camera: MIRRORED }, { upAxis: 3 }, { camera: MIRRORED, upAxis: 3 }];

test("what is in front of the pivot follows every kind of drag", () => {
  for (const options of VIEWS) {
    for (const more of [{}, { buttons: 2 }, { shiftKey: true }, { buttons: 4 }]) {
      for (const motion of [[1, 0], [-1, 0], [0, 1], [0, -1]] as const) {
        const view = makeView(options);
        expectMotion(view, () => drag(view.canvas, motion, more), motion);
        view.viewer.flip();
        expectMotion(view, () => drag(view.canvas, motion, more), motion);
      }
    }
  }
});

test("the pivot stays where it is during an orbit, and follows the pointer exactly during a pan", () => {
  for (const options of VIEWS) {
    const { canvas, locate } = makeView(options);
    drag(canvas, [123, 45]);
    assertNear(locate(PIVOT), [0, 0, 4]);
    drag(canvas, [30, -20], { shiftKey: true });
    drag(canvas, [-10, 5], { buttons: 4 }); // the middle button
    assertNear(locate(PIVOT), [20, -15, 4]);
  }
});

test("an orbit ends before the view is straight down or up", () => {
  for (const down of [1e4, -1e4]) {
    const view = makeView();
    drag(view.canvas, [0, down]);
    expectMotion(view, () => drag(view.canvas, [0, Math.sign(down)]), [0, 0]);
    const above: Vector = [0, -1, 0];
    const [, y] = view.locate(above);
    assert.ok(y < 0 && Math.abs(y) < 100, `${y}`); // above is still up, but almost in the line of sight
  }
});

test("the wheel, the keys + and -, and two fingers zoom, and never beyond the pivot", () => {
  const { canvas, locate } = makeView();
  const readDepth = (): number => locate(PIVOT)[2];
  canvas.send("wheel", { deltaMode: 0, deltaY: 100 });
  assertNear([readDepth()], [4 * Math.exp(0.1)]);
  canvas.send("wheel", { deltaMode: 1, deltaY: -5 }); // lines
  assertNear([readDepth()], [4]);
  canvas.send("wheel", { deltaMode: 2, deltaY: 1 }); // a page
  canvas.send("wheel", { deltaMode: 1, deltaY: -20 });
  assertNear([readDepth()], [4]);
  canvas.send("keydown", { key: "+" });
  assertNear([readDepth()], [3.6]);
  canvas.send("keydown", { key: "-" });
  canvas.send("pointerdown", { pointerId: 1, clientX: 100, clientY: 100 });
  canvas.send("pointerdown", { pointerId: 2, clientX: 100, clientY: 200 });
  canvas.send("pointermove", { pointerId: 2, clientX: 100, clientY: 300 });
  assertNear(locate(PIVOT), [0, 50, 2]); // the point between the fingers has moved by half as much
  canvas.send("pointerup", { pointerId: 2 });
  canvas.send("pointermove", { pointerId: 1, clientX: 140, clientY: 100 });
  assertNear([readDepth()], [2]); // one finger orbits again
  canvas.send("wheel", { deltaMode: 0, deltaY: -1e5 });
  assert.ok(readDepth() > 0);
});

test("arrow keys move like drags, with and without Shift", () => {
  const motions = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] } as const;
  for (const [code, motion] of Object.entries(motions)) {
    for (const shiftKey of [false, true]) {
      const view = makeView();
      expectMotion(view, () => view.canvas.send("keydown", { code, key: code, shiftKey }), motion);
    }
  }
});

test("letters fly while they are pressed: 0.8 times the distance to the pivot per second", () => {
  const motions = { KeyW: [0, 0, 1], KeyS: [0, 0, -1], KeyA: [-1, 0, 0], KeyD: [1, 0, 0], KeyQ: [0, 1, 0], KeyE: [0, -1, 0] };
  const drawFrame = (): void => frameRequests.splice(0).forEach((request) => request((time += 50)));
  for (const [code, [right = 0, down = 0, ahead = 0]] of Object.entries(motions)) {
    const { canvas, locate } = makeView();
    const step = 4 * 0.8 * 0.1;
    canvas.send("keydown", { code, key: code });
    for (let count = 0; count < 2; count++) drawFrame();
    canvas.send("keyup", { code, key: code });
    const depth = 4 - ahead * step;
    assertNear(locate(PIVOT), [(-right * step * 1000) / depth, (-down * step * 1000) / depth, depth]);
    drawFrame();
    assert.equal(frameRequests.length, 0, "no frame is requested after the flight");
  }
});

test("the pressed keys are forgotten when the canvas loses the focus, and nothing moves the view after its disposal", () => {
  const { canvas, controls, locate } = makeView();
  canvas.send("keydown", { code: "KeyW", key: "w" });
  canvas.send("blur", {});
  frameRequests.splice(0).forEach((request) => request((time += 50)));
  assertNear(locate(PIVOT), [0, 0, 4]);
  canvas.send("keydown", { code: "KeyW", key: "w" });
  controls.dispose();
  assert.equal(frameRequests.length, 0);
  drag(canvas, [10, 10]);
  canvas.send("wheel", { deltaMode: 0, deltaY: 100 });
  canvas.send("keydown", { code: "ArrowLeft", key: "ArrowLeft" });
  assertNear(locate(PIVOT), [0, 0, 4]);
});

test("a flip rotates the picture by 180 degrees, and turns a headset upside down", () => {
  const { viewer, locate } = makeView();
  assert.deepEqual(viewer.placeHeadset()?.up, [0, -1, 0]);
  const [x, y, depth] = locate([1, 0.5, 1]);
  viewer.flip();
  assertNear(locate([1, 0.5, 1]), [-x, -y, depth]);
  assert.deepEqual(viewer.placeHeadset()?.up.map((value) => value + 0), [0, 1, 0]);
});

test("a view is that of its camera until it is moved, and again when the camera is selected", () => {
  const { canvas, viewer, framing } = makeView();
  assert.deepEqual([viewer.isAtCamera, framing()], [true, "picture"]);
  drag(canvas, [10, 0]);
  assert.deepEqual([viewer.isAtCamera, framing()], [false, "wide"]);
  viewer.lookThrough(1); // there is no such camera
  assert.equal(viewer.isAtCamera, false);
  viewer.lookThrough(0);
  assert.deepEqual([viewer.isAtCamera, framing()], [true, "picture"]);
});

test("the pivot is at the median depth of the points in the picture", () => {
  const inside: readonly Vector[] = [[0, 0, -3], [1.9, 0, 1], [0, 1.7, 2], [0, 0, 9], [-0.9, -0.7, -1.5]];
  const outside: readonly Vector[] = [[8.5, 0, 16], [0, 6.5, 16], [-8.5, 0, 16], [0, -6.5, 16], [0, 0, -5], [0, 0, -3.95]];
  assert.equal(findDistance(CAMERA, Float32Array.from([...inside, ...outside].flat())), 5);
  assert.equal(findDistance(CAMERA, null), 0.2);
});

test("the camera that the player makes sees the scene upright, also in a left-handed world", () => {
  const points = [[0, 0, 0], [1, 2, 3], [-1, -2, -3], [2, 0, 1], [-2, 0, -1]].map(([x = 0, y = 0, z = 0]) => [x + 9, y, z]);
  for (const isRightHanded of [true, false]) {
    for (const up of [[0, 1, 0], [-1, 0, 0], [0, 0, -1]] as const) {
      const { rotation, ...camera } = makeCamera(Float32Array.from(points.flat()), up, isRightHanded);
      const [a = 0, b = 0, c = 0, d = 0, e = 0, f = 0, g = 0, h = 0, i = 0] = rotation;
      assertNear([d, e, f], up.map((value) => -value));
      assertNear([a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)], [isRightHanded ? 1 : -1]);
      const depth = g * 9 + camera.translation[2]!;
      assert.ok(depth > 0);
      assert.ok(Math.abs(findDistance({ rotation, ...camera }, Float32Array.from([9, 0, 0])) - depth) < 1e-5);
    }
  }
});

test("a scene is measured with a sample of at least 20 000 whole positions", () => {
  const positions = Int32Array.from({ length: 3 * 50_001 }, (_, index) => 8 * (index % 3));
  const sample = samplePositions({ positions } as FramePacket, { latticeExponent: 2 } as StreamInfo);
  assert.equal(sample.length, 3 * 25_000);
  assert.ok(sample.every((value, index) => value === 2 * (index % 3)));
});

test("a picture of another aspect ratio is centered, or is extended around its center", () => {
  assert.deepEqual(fitArea(CAMERA, 1000, 600), { left: 100, top: 0, width: 800, height: 600 });
  assert.deepEqual(fitArea(CAMERA, 400, 500), { left: 0, top: 100, width: 400, height: 300 });
  const { width, height, fx, fy, cx, cy } = widenEye(CAMERA, 1000, 600);
  assert.deepEqual([width, height, fx, fy, cx, cy], [1000, 600, 1000, 1000, 500, 300]);
  assert.equal(widenEye(CAMERA, 400, 500).cy, 250);
});
