/** The scene in a headset: the placement of its eyes, and playback in an emulated headset. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { eyeAxis, eyeCenter, type Eye, type Vector } from "../src/draw/eye.js";
import { type Pose } from "../src/view/pose.js";
import { eyeFromView, moveHeadset, placeHeadset, turnHeadset } from "../src/vr/placement.js";
import { browserTest, PlayerPage, type PlayerElement } from "./browser.js";
import { makeEmulatorScript, SIZE } from "./emulator.js";
import { type Pixels } from "./png.js";

const UP: Vector = [0, 1, 0];
const VIEWPORT = { x: 0, y: 0, width: 800, height: 600 };
/** A view along +z from (1, 2, 3), tilted down: WebXR's -z is the world's +z, and its +x is the world's -x. */
const POSE: Pose = {
  ...{ center: [1, 2, 3], right: [-1, 0, 0], down: [0, -0.8, -0.6], ahead: [0, -0.6, 0.8] },
  distance: 4,
};

function makeTransform(matrix: readonly number[]): XRRigidTransform {
  return { matrix: Float32Array.from(matrix) } as XRRigidTransform;
}
/** A transform to a position in meters, without a rotation. */
const moveTo = (x: number, y: number, z: number): XRRigidTransform =>
  makeTransform([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, x, y, z, 1]);
/** A transform that turns to the right by 90 degrees. */
const turnRight = (x: number, y: number, z: number): XRRigidTransform =>
  makeTransform([0, 0, 1, 0, 0, 1, 0, 0, -1, 0, 0, 0, x, y, z, 1]);

function makeView(transform: XRRigidTransform): Pick<XRView, "transform" | "projectionMatrix"> {
  return { transform, projectionMatrix: Float32Array.from([1.5, 0, 0, 0, 0, 2, 0, 0, 0.1, -0.2, -1, -1, 0, 0, -0.2, 0]) };
}

/** Project a world point to its pixel, as in SPEC 5.6. */
function project(eye: Eye, [x, y, z]: Vector): [number, number] {
  const [right = 0, down = 0, ahead = 0] = [0, 1, 2].map((row) => {
    const [a, b, c] = eyeAxis(eye, row as 0 | 1 | 2);
    return a * x + b * y + c * z + (eye.translation[row] ?? 0);
  });
  return [(eye.fx * right) / ahead + eye.cx, (eye.fy * down) / ahead + eye.cy];
}

function assertClose(values: readonly number[], expectedValues: readonly number[]): void {
  const message = `${values.join(", ")} instead of ${expectedValues.join(", ")}`;
  assert.equal(values.length, expectedValues.length);
  assert.ok(values.every((value, index) => Math.abs(value - (expectedValues[index] ?? NaN)) < 1e-5), message);
}

test("a headset starts at the view, upright, with the pivot 2 m away", () => {
  const placement = placeHeadset(POSE, UP, 0);
  assert.equal(placement.unitsPerMeter, 2);
  const eye = eyeFromView(makeView(moveTo(0, 0, 0)), VIEWPORT, placement);
  assertClose(eyeCenter(eye), [1, 2, 3]);
  assertClose([...eyeAxis(eye, 0), ...eyeAxis(eye, 1), ...eyeAxis(eye, 2)], [-1, 0, 0, 0, -1, 0, 0, 0, 1]);
});

test("a headset has the scale of the stream, if the stream states it", () => {
  const placement = placeHeadset(POSE, UP, 0.5);
  const eye = eyeFromView(makeView(moveTo(0.1, 1, -2)), VIEWPORT, placement);
  assertClose(eyeCenter(eye), [1 - 0.2, 2 + 2, 3 + 4]);
  assertClose([eye.near], [0.2]);
});

test("the picture of an eye is that of its projection matrix", () => {
  const view = makeView(moveTo(0, 0, 0));
  const eye = eyeFromView(view, VIEWPORT, placeHeadset(POSE, UP, 1));
  const [x, y, z] = [0.3, -0.4, -2]; // in the space of the headset
  const clip = [0, 1, 3].map((row) =>
    [x, y, z, 1].reduce((sum, value, column) => sum + value * (view.projectionMatrix[4 * column + row] ?? 0), 0),
  );
  const [clipX = 0, clipY = 0, clipW = 1] = clip;
  const expectedPixel = [400 * (1 + clipX / clipW), 300 * (1 - clipY / clipW)];
  assertClose(project(eye, [1 - x, 2 + y, 3 - z]), expectedPixel);
});

test("in a left-handed world, what is on the right in the view is on the right in the headset", () => {
  const mirrored: Pose = { ...POSE, right: [1, 0, 0] };
  const eye = eyeFromView(makeView(moveTo(0.5, 0, 0)), VIEWPORT, placeHeadset(mirrored, UP, 1));
  assertClose(eyeCenter(eye), [1.5, 2, 3]);
  assertClose([...eyeAxis(eye, 0), ...eyeAxis(eye, 2)], [1, 0, 0, 0, 0, 1]);
});

test("a view that is rolled or upside down is upright in the headset, with the same direction", () => {
  const upsideDown: Pose = { ...POSE, right: [1, 0, 0], down: [0, 0.8, 0.6] };
  const portrait: Pose = { ...POSE, right: [0, -0.8, -0.6], down: [1, 0, 0] };
  const level: Pose = { ...POSE, right: [0, 1, 0], down: [-1, 0, 0], ahead: [0, 0, 1] };
  for (const pose of [upsideDown, portrait, level]) {
    const eye = eyeFromView(makeView(moveTo(0, 0, 0)), VIEWPORT, placeHeadset(pose, UP, 1));
    assertClose([...eyeAxis(eye, 0), ...eyeAxis(eye, 1), ...eyeAxis(eye, 2)], [-1, 0, 0, 0, -1, 0, 0, 0, 1]);
  }
});

test("what is above in a view straight down, or below in a view straight up, is ahead in the headset", () => {
  const down: Pose = { ...POSE, down: [0, 0, -1], ahead: [0, -1, 0] };
  const up: Pose = { ...POSE, down: [0, 0, 1], ahead: [0, 1, 0] };
  for (const pose of [down, up, { ...down, right: [1, 0, 0] }, { ...up, right: [1, 0, 0] }] as const) {
    const eye = eyeFromView(makeView(moveTo(0, 0, 0)), VIEWPORT, placeHeadset(pose, UP, 1));
    assertClose([...eyeAxis(eye, 0), ...eyeAxis(eye, 1), ...eyeAxis(eye, 2)], [...pose.right, 0, -1, 0, 0, 0, 1]);
  }
});

test("moving follows the direction of the head", () => {
  const placement = placeHeadset(POSE, UP, 1);
  assertClose(moveHeadset(placement, moveTo(5, 5, 5), 1, 2, 3).origin, [1 - 1, 2 + 2, 3 + 3]);
  assertClose(moveHeadset(placement, turnRight(5, 5, 5), 1, 2, 3).origin, [1 - 3, 2 + 2, 3 - 1]);
});

test("turning leaves the head where it is", () => {
  const placement = placeHeadset(POSE, UP, 0.5);
  const head = moveTo(1, 2, 3);
  const [before, after] = [placement, turnHeadset(placement, head, Math.PI / 2)].map((place) =>
    eyeFromView(makeView(head), VIEWPORT, place),
  ) as [Eye, Eye];
  assertClose(eyeCenter(after), eyeCenter(before));
  assertClose(eyeAxis(after, 2), [1, 0, 0]); // +z turned to the left, where -x is on the right
});

browserTest("without a headset, there is no button for it, and entering fails", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  assert.equal(await page.page.locator("quarc-player #headset").isVisible(), false);
  const error = await page.run(({ player }) => player?.enterHeadset().catch((reason: Error) => reason.name));
  assert.equal(error, "NotSupportedError");
});

browserTest("a headset shows the scene to two eyes, its trigger plays, and its sticks move", async () => {
  await using page = await PlayerPage.open({ ...SIZE, initScript: makeEmulatorScript() });
  await page.waitUntil((player) => player.frame === 0);
  const camera = await page.run(({ player }) => player?.camera);
  await page.page.locator("quarc-player #headset").click();
  await page.waitUntil(({ player }) => player?.isInHeadset === true);
  // What is near is further to the right for the left eye than for the right eye.
  const [{ count }] = await waitForBalls(page, (left, right) => left.count > 80 && right.count > 80 && left.x > right.x + 3);

  await press(page, "left", "trigger");
  await page.waitUntil((player) => player.isPlaying && (player.frame ?? 0) > 1);
  await press(page, "left", "trigger");
  await page.waitUntil((player) => !player.isPlaying);
  await page.run((player) => player.setFrame(0));

  await deflect(page, "left", 0, 1); // back
  const [{ x }] = await waitForBalls(page, (left) => left.count < 0.8 * count);
  await deflect(page, "left", 0, 0);
  await deflect(page, "right", -0.9, 0); // turn to the left
  await waitForBalls(page, (left) => left.count === 0 || left.x > x + 20);
  await deflect(page, "right", 0, 0);

  // A camera and the up vector can also be chosen in the headset.
  await page.run(({ player }) => (player!.camera = "front"));
  const [{ x: upright }] = await waitForBalls(page, (left) => Math.abs(left.count - count) < 0.05 * count);
  const changes = [
    ({ player }: PlayerElement) => (player!.up = "y"), // the up axis of the stream is -y
    ({ player }: PlayerElement) => (player!.up = null),
    ({ player }: PlayerElement) => player!.flip(),
    ({ player }: PlayerElement) => player!.flip(),
  ];
  for (const [index, change] of changes.entries()) {
    await page.run(change);
    await waitForBalls(page, (left) => (index % 2 === 0 ? left.x < upright - 10 : Math.abs(left.x - upright) < 1));
  }
  await page.run(({ player }) => (player!.camera = "front"));

  await page.run(({ player }) => player?.leaveHeadset());
  await page.waitUntil(({ player }) => player?.isInHeadset === false);
  assert.equal(await page.run(({ player }) => player?.camera), camera);
});

browserTest("a headset can be left and entered at any time", async () => {
  await using page = await PlayerPage.open({ ...SIZE, initScript: makeEmulatorScript() });
  await page.waitUntil((player) => player.frame === 0);
  const results = await page.run(async ({ player }) => {
    if (player === null) return [];
    const changes: boolean[] = [];
    player.addEventListener("headset", ({ detail }) => changes.push(detail.isInHeadset));
    const readError = (promise: Promise<void>): Promise<string> => promise.then(() => "none", (error: Error) => error.message);
    const enterAndLeave = readError(player.enterHeadset());
    await player.leaveHeadset();
    const leftError = await enterAndLeave;
    const errors = await Promise.all([player.enterHeadset(), player.enterHeadset()].map(readError));
    const isInHeadset = player.isInHeadset;
    await player.leaveHeadset();
    const enterAgain = readError(player.enterHeadset());
    void player.leaveHeadset();
    void player.enterHeadset();
    const againError = await enterAgain;
    void player.leaveHeadset();
    await player.enterHeadset();
    return [leftError, ...errors, isInHeadset, againError, player.isInHeadset, changes.join()];
  });
  assert.deepEqual(results, ["the headset was left", "none", "none", true, "none", true, "true,false,true,false,true"]);
  // The player is removed while the headset draws, and while it is entered.
  const error = await page.run(async (playerElement) => {
    const { player } = playerElement;
    playerElement.remove();
    document.body.append(playerElement);
    const entering = playerElement.player?.enterHeadset();
    return [await player?.enterHeadset().catch(({ message }: Error) => message), await entering?.catch(({ message }: Error) => message)];
  });
  assert.deepEqual(error, ["the player was disposed", "no frame is shown"]);
  await page.waitUntil((player) => player.frame === 0);
  const disposedError = await page.run((playerElement) => {
    const entering = playerElement.player?.enterHeadset();
    playerElement.remove();
    return entering?.then(() => "none", () => "rejected");
  });
  assert.equal(disposedError, "rejected");
});

browserTest("the canvas is drawn again after a session that ends while it is entered", async () => {
  const endSession = `
    const requestSession = navigator.xr.requestSession.bind(navigator.xr);
    navigator.xr.requestSession = async (mode) => (window.session = await requestSession(mode));
    const compatible = { value: () => session.end(), configurable: true };
    Object.defineProperty(WebGL2RenderingContext.prototype, "makeXRCompatible", compatible);`;
  await using page = await PlayerPage.open({ ...SIZE, initScript: makeEmulatorScript() + endSession });
  await page.waitUntil((player) => player.frame === 0);
  const error = await page.run(({ player }) => player?.enterHeadset().catch(({ name }: Error) => name));
  assert.notEqual(error, undefined);
  const before = await page.takeScreenshot();
  await page.run(({ player }) => player?.flip());
  const sample = (pixels: Pixels): string => Array.from({ length: 40 }, (_, row) => pixels.pixelAt(240, 5 * row).join()).join(" ");
  while (sample(await page.takeScreenshot()) === sample(before)); // until the time limit of the test
});

browserTest("in a headset, its position, the stream and the graphics context may be lost", async () => {
  const expectedErrors = /onDeviceFrame/; // of the emulator, without a context
  await using page = await PlayerPage.open({ ...SIZE, initScript: makeEmulatorScript(), expectedErrors });
  await page.waitUntil((player) => player.frame === 0);
  await page.page.evaluate(`
    const { shadowRoot } = document.querySelector("quarc-player");
    window.extension = shadowRoot.querySelector("canvas").getContext("webgl2").getExtension("WEBGL_lose_context")`);
  await page.run(({ player }) => player?.enterHeadset()); // the emulator then moves the canvas
  const [{ count }] = await waitForBalls(page, (left, right) => left.count > 80 && right.count > 80);
  await page.page.evaluate(`{
    const original = XRFrame.prototype.getViewerPose;
    let lost = 0;
    XRFrame.prototype.getViewerPose = function (space) { return lost++ < 5 ? null : original.call(this, space); };
    window.isLost = () => lost < 5;
  }`);
  await page.page.waitForFunction("!isLost()");

  await deflect(page, "left", 0, 1); // back
  await waitForBalls(page, (left) => left.count < 0.8 * count);
  await deflect(page, "left", 0, 0);
  await page.run((player) => player.setAttribute("src", "stream.quarc?again"));
  await waitForBalls(page, (left) => Math.abs(left.count - count) < 0.05 * count);

  await page.page.evaluate("extension.loseContext(); setTimeout(() => extension.restoreContext(), 200)");
  await page.waitUntil(({ player }) => player?.isInHeadset === false);
  await waitForPixels(page);
});

/** Wait until the page shows a picture. */
async function waitForPixels(page: PlayerPage): Promise<void> {
  for (;;) { // until the time limit of the test
    const { width, height, pixelAt } = await page.takeScreenshot();
    if (pixelAt(Math.floor(width / 2), Math.floor(height / 3)).some((value) => value > 40)) return;
  }
}

interface Ball {
  /** Number of pixels. */
  readonly count: number;
  /** Mean column in the picture of the eye, pixels. */
  readonly x: number;
}

/** Wait until the ball in the pictures of the left and of the right eye satisfies a condition. */
async function waitForBalls(page: PlayerPage, condition: (left: Ball, right: Ball) => boolean): Promise<[Ball, Ball]> {
  for (;;) { // until the time limit of the test
    const balls = await findBalls(page);
    if (condition(...balls)) return balls;
  }
}

async function findBalls(page: PlayerPage): Promise<[Ball, Ball]> {
  const { width, height, pixelAt } = await page.takeScreenshot();
  const findBall = (start: number): Ball => {
    const columns: number[] = [];
    for (let x = 0; x < width / 2; x++) {
      for (let y = 0; y < height; y++) {
        const [red, green, blue] = pixelAt(start + x, y);
        if (red > 180 && green < 160 && blue < 100) columns.push(x);
      }
    }
    return { count: columns.length, x: columns.reduce((sum, x) => sum + x, 0) / columns.length };
  };
  return [findBall(0), findBall(width / 2)];
}

type Hand = "left" | "right";

async function press(page: PlayerPage, hand: Hand, button: string): Promise<void> {
  for (const value of [1, 0]) {
    await page.page.evaluate(`headset.controllers.${hand}.updateButtonValue("${button}", ${value})`);
    await page.page.waitForTimeout(100); // the emulator compares the states of two frames
  }
}

async function deflect(page: PlayerPage, hand: Hand, x: number, y: number): Promise<void> {
  await page.page.evaluate(`headset.controllers.${hand}.updateAxes("thumbstick", ${x}, ${y})`);
}
