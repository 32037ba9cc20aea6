/** Memory over many frames, and over many lives of the component. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { browserTest, launch, PlayerPage, type PlayerElement } from "./browser.js";

const MOST_GROWTH_MIB = 32;

/** Resident memory of the browser's processes, MiB. */
async function measureMemory(): Promise<number> {
  const session = await (await launch()).newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  const sizes = processInfo.map(({ id }) => {
    const status = readFileSync(`/proc/${id}/status`, "utf8");
    return Number(/VmRSS:\s*(\d+)/.exec(status)?.[1] ?? 0) / 1024;
  });
  return sizes.reduce((sum, size) => sum + size, 0);
}

/** What the page and its workers no longer use does not count. */
async function collectGarbage({ page }: PlayerPage): Promise<void> {
  const collect = "new Promise((resolve) => setTimeout(() => resolve(gc()), 100))";
  for (const worker of page.workers()) await worker.evaluate(collect);
  await page.evaluate(collect);
}

/** Wait until so many more frames have been shown. Runs on the page. */
function playOn(player: PlayerElement, count: number): Promise<void> {
  return new Promise((resolve) => {
    let shown = 0;
    const look = (): void => {
      if (++shown < count) return;
      player.removeEventListener("frame", look);
      resolve();
    };
    player.addEventListener("frame", look);
  });
}

browserTest("memory stays flat over a thousand frames", async (context) => {
  await using page = await PlayerPage.open({ attributes: 'autoplay loop speed="16"', width: 160, height: 200 });
  await page.run(playOn, 1000);
  await page.run((player) => player.pause());
  await collectGarbage(page);
  const before = await measureMemory();
  await page.run((player) => player.play());
  await page.run(playOn, 1000);
  await page.run((player) => player.pause());
  await collectGarbage(page);
  const growth = (await measureMemory()) - before;
  context.diagnostic(`${before.toFixed(0)} MiB, then ${growth.toFixed(1)} MiB more`);
  assert.ok(growth < MOST_GROWTH_MIB, `${growth} MiB`);
});

browserTest("the component is put on a page and removed fifty times", async (context) => {
  await using page = await PlayerPage.open({ attributes: null, width: 160, height: 200 });
  const live = (times: number): Promise<void> =>
    page.page.evaluate(async (lives) => {
      for (let life = 0; life < lives; life++) {
        const player = document.createElement("quarc-player");
        player.setAttribute("src", "stream.quarc");
        document.body.append(player);
        await new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
        player.remove();
      }
    }, times);
  await live(20);
  await collectGarbage(page);
  const before = await measureMemory();
  await live(30);
  await collectGarbage(page);
  const growth = (await measureMemory()) - before;
  context.diagnostic(`${before.toFixed(0)} MiB, then ${growth.toFixed(1)} MiB more`);
  assert.ok(growth < MOST_GROWTH_MIB, `${growth} MiB`);
  assert.equal(page.page.workers().length, 0, "workers are left");
});
