/** The component's controls: keys, pointers, touch, cameras, and the layout of the picture on the page. */

import assert from "node:assert/strict";
import { browserTest, PIXEL_RATIO, PlayerPage, type PlayerElement } from "./browser.js";

/** Return the first and the last column of a screen row that are not black. */
async function findPictureEdges(page: PlayerPage, y: number): Promise<[number, number]> {
  const { width, pixelAt } = await page.takeScreenshot();
  const isVisible = (x: number): boolean => pixelAt(x, y).reduce((sum, value) => sum + value, 0) > 12;
  const visibleColumns = Array.from({ length: width }, (_, x) => x).filter(isVisible);
  return [visibleColumns[0] ?? width, visibleColumns.at(-1) ?? 0];
}

browserTest("keys and touch move the view on the canvas of a program, until its player is disposed", async () => {
  await using page = await PlayerPage.open({ attributes: null, isTouch: true });
  const cameras: string[] = await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    document.body.style.height = "3000px"; // could be scrolled
    const canvas = document.body.appendChild(document.createElement("canvas"));
    canvas.style.cssText = "width: 300px; height: 150px";
    const player = new Player(canvas);
    await player.open({ url: "stream.quarc" });
    Object.assign(window, { canvas, player });
    return player.cameras.map(({ name }: { name: string }) => name);
  });
  const isMoved = (): Promise<boolean> => page.page.evaluate("player.camera === null");
  await page.page.mouse.click(50, 50);
  await page.page.keyboard.press("ArrowLeft");
  assert.equal(await isMoved(), true, "by a key");
  const session = await page.page.context().newCDPSession(page.page);
  await page.page.evaluate((name) => Reflect.set(Reflect.get(window, "player"), "camera", name), cameras[0]);
  for (const y of [120, 90, 60, 30]) {
    const type = y === 120 ? "touchStart" : "touchMove";
    await session.send("Input.dispatchTouchEvent", { type, touchPoints: [{ x: 50, y }] });
  }
  await session.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
  assert.deepEqual([await isMoved(), await page.page.evaluate("scrollY")], [true, 0], "by touch");
  const left = await page.page.evaluate("player.dispose(), [canvas.style.touchAction, canvas.hasAttribute('tabindex')]");
  assert.deepEqual(left, ["", false]);
});

browserTest("a canvas to which the page gives no size keeps its size", async () => {
  await using page = await PlayerPage.open({ attributes: null }); // with less than one screen pixel per CSS pixel
  const sizes = await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const canvas = document.body.appendChild(document.createElement("canvas"));
    const player = new Player(canvas);
    await player.open({ url: "stream.quarc" });
    for (let count = 0; count < 5; count++) {
      player.camera = player.cameras[0].name;
      await new Promise((resolve) => requestAnimationFrame(resolve));
    }
    return [canvas.clientWidth, canvas.clientHeight, canvas.width, canvas.height];
  });
  assert.deepEqual(sizes, [300, 150, 300 * PIXEL_RATIO, 150 * PIXEL_RATIO]);
});

browserTest("a canvas that is not on the page keeps its resolution", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  const sizes = await page.page.evaluate(async () => {
    const { Player } = await import(`${location.origin}/quarc-player.js`);
    const canvas = Object.assign(document.createElement("canvas"), { width: 320, height: 240 });
    const player = new Player(canvas);
    await player.open({ url: "stream.quarc" });
    for (let count = 0; count < 2; count++) await new Promise((resolve) => requestAnimationFrame(resolve));
    return [canvas.width, canvas.height];
  });
  assert.deepEqual(sizes, [320, 240]);
});

browserTest("the list of speeds shows a speed that is not one of its own", async () => {
  await using page = await PlayerPage.open({ attributes: 'speed="3"' });
  await page.waitUntil((player) => player.frame === 0);
  const readList = (): Promise<[string, number]> =>
    page.run(async (player) => {
      await new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve)));
      const list = player.shadowRoot?.querySelector<HTMLSelectElement>("#speed");
      return [list?.selectedOptions[0]?.text ?? "", list?.options.length ?? 0];
    });
  assert.deepEqual(await readList(), ["3×", 6]);
  await page.run(({ player }) => Object.assign(player!, { speed: 1 / 3 }));
  assert.deepEqual(await readList(), ["0.333×", 6]);
  await page.page.locator("quarc-player #speed").selectOption("2");
  assert.deepEqual(await readList(), ["2×", 6]);
  assert.equal(await page.run(({ player }) => player?.speed), 2);
});

browserTest("dragging, the wheel and arrow keys move the view, and the list returns to a camera", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const { mouse } = page.page;
  const select = page.page.locator("quarc-player #camera");
  for (const moveView of [
    async () => {
      await mouse.move(200, 150);
      await mouse.down();
      await mouse.move(240, 160, { steps: 3 });
      await mouse.up();
    },
    () => mouse.wheel(0, 200),
    () => page.page.keyboard.press("ArrowLeft"),
  ]) {
    const cameraBefore = await page.run((player) => player.takePicture(0).then(() => player.player?.camera));
    assert.equal(cameraBefore, "front");
    await moveView();
    await page.waitUntil((player) => player.player?.camera === null);
    await page.page.waitForFunction(`document.querySelector("quarc-player").shadowRoot.querySelector("#camera").value === ""`);
    await select.selectOption("front");
    assert.equal(await page.run(({ player }) => player?.camera), "front");
  }
});

browserTest("with Shift, drags and arrow keys pan instead of orbiting", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  // The last direction that was sent to the sort worker is the direction of the view.
  await page.page.evaluate(() => {
    const { postMessage } = Worker.prototype as { postMessage: (...args: unknown[]) => void };
    Worker.prototype.postMessage = function (...args: [{ forward?: number[] }]) {
      if (args[0].forward !== undefined) document.body.dataset["direction"] = String(args[0].forward);
      postMessage.apply(this, args);
    };
    document.body.appendChild(document.createElement("quarc-player")).setAttribute("src", "stream.quarc");
  });
  await page.waitUntil((player) => player.frame === 0);
  const { mouse, keyboard } = page.page;
  await page.page.locator("quarc-player canvas.view").focus();
  const readDirection = (): Promise<string | undefined> => page.run(async ({ player }) => {
    await new Promise((resolve) => setTimeout(resolve, 200)); // for the sort of the new view
    return player?.camera === null ? document.body.dataset["direction"] : undefined;
  });
  const press = (): Promise<void> => keyboard.press("ArrowLeft");
  const drag = async (): Promise<void> => {
    await mouse.move(200, 150);
    await mouse.down();
    await mouse.move(240, 150);
    await mouse.up();
  };
  for (const moveView of [press, drag]) {
    await moveView();
    const direction = await readDirection();
    assert.ok(direction !== undefined);
    await keyboard.down("Shift");
    await moveView();
    assert.equal(await readDirection(), direction);
    await keyboard.up("Shift");
    await moveView();
    assert.notEqual(await readDirection(), direction);
  }
});

browserTest("on a phone, fingers orbit, zoom and scrub", async () => {
  await using page = await PlayerPage.open({ width: 390, height: 700, isTouch: true });
  await page.waitUntil((player) => player.frame === 0);
  const session = await page.page.context().newCDPSession(page.page);
  const touch = async (kind: string, points: readonly (readonly [number, number])[]): Promise<void> => {
    const touchPoints = points.map(([x, y], id) => ({ x, y, id }));
    await session.send("Input.dispatchTouchEvent", { type: kind as "touchStart", touchPoints });
  };
  await touch("touchStart", [[100, 200]]);
  await touch("touchMove", [[140, 220]]);
  await touch("touchEnd", []);
  await page.waitUntil((player) => player.player?.camera === null);
  await page.run((player) => player.lookThrough("front"));
  await touch("touchStart", [[100, 200], [200, 200]]);
  await touch("touchMove", [[60, 200], [260, 200]]);
  await touch("touchEnd", []);
  await page.waitUntil((player) => player.player?.camera === null);
  const slider = page.page.locator("quarc-player input[type=range]");
  const box = await slider.boundingBox();
  assert.ok(box !== null);
  await page.page.touchscreen.tap(box.x + box.width / 2, box.y + box.height / 2);
  await page.waitUntil((player) => Math.abs((player.frame ?? 0) - 12) <= 1);
  const buttons = await page.page.locator("quarc-player button:visible").all();
  for (const button of buttons) {
    const size = await button.boundingBox();
    assert.ok(size !== null && size.width >= 40 && size.height >= 40 && size.x + size.width <= 390);
  }
});

browserTest("a camera's picture keeps its aspect ratio, and a moved view fills the canvas", async () => {
  await using page = await PlayerPage.open({ width: 640, height: 480, attributes: 'camera="upright"' });
  await page.waitUntil((player) => player.frame === 0);
  const height = await page.run((player) => player.shadowRoot?.querySelector("canvas")?.clientHeight ?? 0);
  const width = (height * 90) / 160;
  const floorRow = Math.floor(0.8 * height);
  const [left, right] = await findPictureEdges(page, floorRow);
  assert.ok(left >= (640 - width) / 2 - 1 && right <= (640 + width) / 2, `${left} to ${right}`);
  assert.ok(right - left > 0.9 * width, `${left} to ${right} of ${width}`);
  await page.page.locator("quarc-player canvas.view").focus();
  await page.page.keyboard.press("ArrowLeft");
  await page.waitUntil((player) => player.player?.camera === null);
  const [wideLeft, wideRight] = await findPictureEdges(page, floorRow);
  assert.ok(wideRight - wideLeft > 1.3 * width);
});

for (const attributes of ['controls="none"', "hidden"]) {
  browserTest(`a player with ${attributes}, whose timeline has no width, plays`, async () => {
    await using page = await PlayerPage.open({ attributes: `${attributes} autoplay speed="8"` });
    await page.waitUntil((player) => player.frame === 23);
    await page.run(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  });
}

browserTest("full screen can be left in a shadow root, too", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  await page.page.evaluate(() => {
    const player = document.createElement("quarc-player");
    player.setAttribute("src", "stream.quarc");
    document.body.appendChild(document.createElement("div")).attachShadow({ mode: "open" }).append(player);
  });
  await page.page.locator("quarc-player canvas.view").focus();
  await page.page.keyboard.press("f");
  await page.page.waitForFunction("document.fullscreenElement !== null");
  await page.page.keyboard.press("f");
  await page.page.waitForFunction("document.fullscreenElement === null");
});

browserTest("without permission for full screen, there is no button for it, and its key does nothing", async () => {
  const html = '<script type="module" src="quarc-player.js"></script><quarc-player src="stream.quarc"></quarc-player>';
  await using page = await PlayerPage.open({ attributes: null, files: { "/frame": html } });
  await page.page.evaluate(() => {
    const frame = document.createElement("iframe");
    frame.setAttribute("allow", "fullscreen 'none'");
    frame.src = "/frame";
    document.body.append(frame);
  });
  const frame = page.page.frameLocator("iframe");
  await frame.locator("quarc-player canvas.view").press("f");
  assert.equal(await frame.locator("quarc-player #statistics").isVisible(), true);
  assert.equal(await frame.locator("quarc-player #fullscreen").isVisible(), false);
});

browserTest("on a page that is written from right to left, the slider matches the timeline", async () => {
  await using page = await PlayerPage.open();
  await page.run(() => void (document.documentElement.dir = "rtl"));
  await page.waitUntil((player) => player.frame === 0 && player.info?.frameCount === 24);
  const slider = page.page.locator("quarc-player input[type=range]");
  const { width, height } = (await slider.boundingBox())!;
  await slider.click({ position: { x: 0.8 * width, y: height / 2 } });
  await page.waitUntil((player) => Math.abs((player.frame ?? 0) - 19) <= 1);
  await page.page.waitForFunction((text) => {
    const input = document.querySelector("quarc-player")?.shadowRoot?.querySelector("input");
    return new RegExp(text).test(input?.ariaValueText ?? "");
  }, "^0\\.\\d\\d s · frame \\d+ of 23$");
});

browserTest("on a screen with another resolution, the view and the timeline are drawn again", async () => {
  await using page = await PlayerPage.open({ attributes: null });
  // Chromium does not notify media queries when it emulates another resolution, so the test does.
  await page.page.evaluate(() => {
    const queries: EventTarget[] = [];
    window.matchMedia = () => {
      const query = new EventTarget();
      queries.push(query);
      return query as MediaQueryList;
    };
    const changeRatio = (value: number): void => {
      Object.defineProperty(window, "devicePixelRatio", { value, configurable: true });
      for (const query of queries.splice(0)) query.dispatchEvent(new Event("change"));
    };
    Object.assign(window, { changeRatio });
    changeRatio(1);
    const player = document.createElement("quarc-player");
    player.setAttribute("src", "stream.quarc");
    document.body.append(player);
  });
  await page.waitUntil((player) => player.frame === 0);
  const readWidths = (player: PlayerElement): number[] =>
    Array.from(player.shadowRoot?.querySelectorAll("canvas") ?? [], (canvas) => canvas.width);
  const widths = await page.run(readWidths);
  for (const ratio of [2, 3]) {
    await page.page.evaluate(`changeRatio(${ratio})`);
    const expected = JSON.stringify(widths.map((width) => ratio * width));
    const shown = `JSON.stringify((${String(readWidths)})(document.querySelector("quarc-player")))`;
    await page.page.waitForFunction(`${shown} === '${expected}'`);
  }
});
