/** The panels over the picture: loading, waiting and errors. */

import assert from "node:assert/strict";
import { browserTest, PlayerPage } from "./browser.js";
import { readRoom } from "./server.js";

const BREAKS = /ERR_(CONTENT_LENGTH_MISMATCH|INCOMPLETE_CHUNKED_ENCODING|CONNECTION_RESET|EMPTY_RESPONSE)|404/;
const room = readRoom();
const heldFrom = room.length >> 1; // in frame 12, after the frames before it

const findPanel = (page: PlayerPage, name: string) => page.page.locator(`quarc-player .${name}`);

for (const [width, height] of [[200, 240], [320, 240], [640, 240]] as const) {
  browserTest(`an error can be read in a player of ${width} x ${height} pixels`, async () => {
    await using page = await PlayerPage.open({ status: 404, width, height, expectedErrors: /404/ });
    const panel = findPanel(page, "fault");
    await panel.locator("h2").waitFor();
    const panelBox = (await panel.boundingBox())!;
    assert.ok(panelBox.height >= 90, `${panelBox.height} pixels for the message`);
    for (const part of await panel.locator("h2, p, button").all()) {
      await part.scrollIntoViewIfNeeded();
      const box = (await part.boundingBox())!;
      const isVisible = box.y >= panelBox.y && box.y + box.height <= panelBox.y + panelBox.height;
      assert.ok(isVisible && box.x >= 0 && box.x + box.width <= width, await part.innerText());
    }
    for (const button of await page.page.locator("quarc-player .bar button:visible").all()) {
      await button.scrollIntoViewIfNeeded();
      const box = (await button.boundingBox())!;
      assert.ok(box.y + box.height <= height && box.x + box.width <= width, "buttons are not cut off");
    }
  });
}

browserTest("in a small player, the statistics can be scrolled", async () => {
  await using page = await PlayerPage.open({ width: 320, height: 240 });
  await page.waitUntil((player) => player.frame === 0);
  await page.page.locator("quarc-player canvas.view").press("i");
  const [panel, lastRow] = [findPanel(page, "statistics"), findPanel(page, "statistics dd").last()];
  await lastRow.waitFor();
  await panel.hover();
  await page.page.mouse.wheel(0, 500);
  const panelBox = (await panel.boundingBox())!;
  await page.page.waitForFunction((bottom) => {
    const row = document.querySelector("quarc-player")?.shadowRoot?.querySelector(".statistics dd:last-child");
    return (row?.getBoundingClientRect().bottom ?? Infinity) <= bottom;
  }, panelBox.y + panelBox.height);
  const pictureBox = (await findPanel(page, "picture").boundingBox())!;
  assert.ok(panelBox.y + panelBox.height <= pictureBox.height);
});

browserTest("screen readers announce that a stream is loading, but not every number of bytes", async () => {
  await using page = await PlayerPage.open({ heldFrom: 4000 });
  const amount = findPanel(page, "amount");
  await amount.filter({ hasText: /KB of/ }).waitFor();
  assert.equal(await findPanel(page, "loading").getByRole("status").innerText(), "Loading");
  const isAnnounced = await amount.evaluate((element) => element.closest("[role=status], [aria-live]") !== null);
  assert.equal(isAnnounced, false);
});

browserTest("another try after a failed seek goes to the frame of the seek", async () => {
  await using page = await PlayerPage.open({ heldFrom, supportsRanges: false, expectedErrors: BREAKS });
  await page.waitUntil((player) => player.frame === 0);
  await page.setFrame(3);
  const failed = page.run((player) => player.setFrame(20).then(() => "shown", () => "failed"));
  page.server.setOptions({ status: 404 });
  page.server.breakConnections();
  assert.equal(await failed, "failed");
  page.server.setOptions({ status: null, heldFrom: Infinity });
  await findPanel(page, "fault").locator("button").click();
  await page.waitUntil((player) => player.frame !== null && player.frame !== 3);
  assert.equal(await page.run((player) => player.frame), 20);
  await page.page.keyboard.press("."); // the view has the focus
  await page.waitUntil((player) => player.frame === 21);
});

browserTest("the waiting indicator is visible while playback, a seek or a step waits, and never over another panel", async () => {
  await using page = await PlayerPage.open({ heldFrom, supportsRanges: false, attributes: 'autoplay speed="8"' });
  const waiting = findPanel(page, "waiting");
  const resume = async (isShown: (frame: number) => boolean): Promise<void> => {
    page.server.setOptions({ heldFrom: Infinity });
    await page.page.waitForFunction(`(${String(isShown)})(document.querySelector("quarc-player").frame)`);
    await waiting.waitFor({ state: "hidden" });
  };
  await waiting.waitFor(); // after the frames before the held bytes
  await resume((frame) => frame === 23);
  const reopen = (from: number): Promise<void> => {
    page.server.setOptions({ heldFrom: from });
    return page.run((player) => {
      player.removeAttribute("autoplay");
      player.setAttribute("src", "stream.quarc?again"); // not from the cache of the browser
    });
  };
  await reopen(0);
  await findPanel(page, "loading").waitFor();
  await page.page.waitForTimeout(600);
  assert.equal(await waiting.isVisible(), false, "the loading panel is enough");
  page.server.setOptions({ heldFrom });
  await page.waitUntil((player) => player.frame === 0);
  await page.setFrame(11);
  await page.run((player) => void player.step());
  await waiting.waitFor();
  await reopen(heldFrom); // while the indicator is visible
  await page.waitUntil((player) => player.frame === 0);
  assert.equal(await waiting.isVisible(), false);
  await page.run((player) => void player.setFrame(20));
  await waiting.waitFor();
  await resume((frame) => frame === 20);
});

browserTest("the waiting indicator appears if playback waits directly after the first frame", async () => {
  await using page = await PlayerPage.open({ heldFrom: 32_000, attributes: "autoplay" });
  await findPanel(page, "waiting").waitFor();
  assert.equal(await findPanel(page, "loading").isVisible(), false);
});

browserTest("the waiting indicator can be seen in front of a white page or scene", async () => {
  await using page = await PlayerPage.open({ attributes: 'transparent controls="none"' });
  await page.waitUntil((player) => player.frame === 0);
  await page.run((player) => {
    document.body.style.background = "#fff";
    player.shadowRoot!.querySelector<HTMLElement>("canvas.view")!.style.opacity = "0";
    player.shadowRoot!.querySelector<HTMLElement>(".waiting")!.hidden = false;
  });
  const { width, height, pixelAt } = await page.takeScreenshot();
  const levels = Array.from({ length: width * height }, (_, index) => pixelAt(index % width, Math.floor(index / width))[1]);
  assert.ok(levels.filter((level) => level < 225).length > 80);
});
