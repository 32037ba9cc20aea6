/** The component's keys, and the focus that they need. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage } from "./browser.js";


/** Name of the selected camera; null after the view has been moved. */
const readCamera = (page: PlayerPage): Promise<string | null> => page.run((player) => player.player?.camera ?? null);

browserTest("keys play, step, loop, choose a camera, change the speed and flip", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  const { keyboard } = page.page;
  await page.page.locator("quarc-player canvas.view").focus();
  await keyboard.press(".");
  await page.waitUntil((player) => player.frame === 1);
  await keyboard.press(",");
  await page.waitUntil((player) => player.frame === 0);
  await keyboard.press("Space");
  await page.waitUntil((player) => player.isPlaying && (player.frame ?? 0) > 0);
  await keyboard.press("k");
  await page.waitUntil((player) => !player.isPlaying);
  for (const key of ["l", "2", ">", "i"]) await keyboard.press(key);
  const state = await page.run(({ player }) => [player?.loop, player?.camera, player?.speed]);
  assert.deepEqual(state, [true, "side", 2]);
  await page.page.locator("quarc-player dl.statistics").waitFor();
  await keyboard.press("u");
  assert.equal(await readCamera(page), null);
  await keyboard.press("0");
  assert.equal(await readCamera(page), "side");
  await keyboard.press("End");
  await page.waitUntil((player) => player.frame === 23);
});

browserTest("attributes that are set again, and properties, change what keys have changed", async () => {
  await using page = await PlayerPage.open({ attributes: 'loop speed="2"' });
  await page.waitUntil((player) => player.frame === 0);
  await page.page.locator("quarc-player canvas.view").focus();
  for (const key of ["l", ">", "m"]) await page.page.keyboard.press(key);
  const states = await page.run((element) => {
    const player = element.player!;
    const states = [[player.loop, player.speed, player.muted, element.hasAttribute("loop")]];
    for (const name of ["loop", "speed"]) element.setAttribute(name, element.getAttribute(name)!);
    player.muted = false;
    return [...states, [player.loop, player.speed, player.muted, element.hasAttribute("muted")]];
  });
  assert.deepEqual(states, [[false, 4, true, true], [true, 2, false, false]]);
});

browserTest("the focus of the view can be seen on its picture", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  await page.page.keyboard.press("Tab");
  assert.deepEqual((await page.takeScreenshot()).pixelAt(1, 100).slice(0, 3), [0x6a, 0xa8, 0xff]);
});

browserTest("the focus can be seen in high contrast, which has no shadows", async () => {
  await using page = await PlayerPage.open();
  await page.page.emulateMedia({ forcedColors: "active" });
  await page.waitUntil((player) => player.frame === 0);
  for (const selector of ["canvas.view", ".timeline"]) {
    await page.page.keyboard.press("Tab"); // focuses the view, then the slider in the timeline
    const outline = await page.run((player, focused) => {
      const { outlineStyle, outlineWidth } = getComputedStyle(player.shadowRoot!.querySelector(focused)!);
      return `${outlineStyle} ${outlineWidth}`;
    }, selector);
    assert.equal(outline, "solid 2px", selector);
  }
});

browserTest("the keys that fly are released when the key Meta is, because macOS does not tell it", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  await page.page.locator("quarc-player canvas.view").focus();
  for (const key of ["w", "Meta"]) await page.page.keyboard.down(key);
  await page.page.keyboard.up("Meta");
  const moves = await page.run(async (player) => {
    let moves = 0;
    const nextDrawing = (): Promise<number> => new Promise((resolve) => requestAnimationFrame(resolve));
    for (let count = 0; count < 2; count++) await nextDrawing();
    player.addEventListener("view", () => (moves += 1));
    for (let count = 0; count < 3; count++) await nextDrawing();
    return moves;
  });
  assert.equal(moves, 0);
});

browserTest("keys change a speed that is not in the list to the next speed of the list", async () => {
  await using page = await PlayerPage.open();
  await page.waitUntil((player) => player.frame === 0);
  await page.page.locator("quarc-player canvas.view").focus();
  for (const [speed, key, expectedSpeed] of [["3", ">", 4], ["3", "<", 2], ["8", ">", 8], ["8", "<", 4], ["0.1", "<", 0.1]] as const) {
    await page.run((player, text) => player.setAttribute("speed", text), speed);
    await page.page.keyboard.press(key);
    assert.equal(await page.run(({ player }) => player?.speed), expectedSpeed, `${key} at ${speed}`);
  }
});

browserTest("a key that is held repeats steps and changes of the speed, but no other action", async () => {
  await using page = await PlayerPage.open({ attributes: 'speed="0.25"' });
  await page.waitUntil((player) => player.frame === 0);
  const { keyboard } = page.page;
  const hold = async (key: string): Promise<void> => {
    for (let count = 0; count < 4; count++) await keyboard.down(key); // the second and the later events are repeats
    await keyboard.up(key);
  };
  const readState = (): Promise<unknown[]> =>
    page.run(({ player, isPlaying }) => [isPlaying, player?.loop, player?.speed, player?.targetFrame]);
  await page.page.locator("quarc-player canvas.view").focus();
  for (const key of ["l", ">"]) await hold(key);
  assert.deepEqual(await readState(), [false, true, 4, 0]);
  await hold(".");
  await page.waitUntil((player) => player.frame === 4);
  await hold(",");
  assert.deepEqual(await readState(), [false, true, 4, 0]);
  await hold("Space");
  assert.equal((await readState())[0], true);
  for (const key of ["Enter", "Space"]) {
    await page.page.locator("quarc-player #play").focus();
    const wasPlaying = (await readState())[0];
    await hold(key);
    assert.equal((await readState())[0], !wasPlaying, key);
  }
  await page.page.locator("quarc-player #forward").focus();
  await page.run((player) => player.pause());
  await page.setFrame(0);
  await hold("Enter");
  await page.waitUntil((player) => player.frame === 4);
});
