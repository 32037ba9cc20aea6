/** Memory over many frames, and over many insertions and removals of the component. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { setTimeout } from "node:timers/promises";
import { browserTest, launch, PlayerPage, type PlayerElement } from "./browser.js";

const MOST_GROWTH_MIB = 48;
const MOST_PRIVATE_GROWTH_MIB = 8;
const SETTLING_MS = 1000; // until the processes have returned freed memory

/** Resident memory of the browser's processes in MiB; "private": only that of the renderers. */
async function measureMemory(what: "all" | "private"): Promise<number> {
  const session = await (await launch()).newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  const counted = processInfo.filter(({ type }) => what === "all" || type === "renderer");
  const field = what === "all" ? /VmRSS:\s*(\d+)/ : /RssAnon:\s*(\d+)/;
  const sizes = counted.map(({ id }) => {
    const status = readFileSync(`/proc/${id}/status`, "utf8");
    return Number(field.exec(status)?.[1] ?? 0) / 1024;
  });
  return sizes.reduce((sum, size) => sum + size, 0);
}

/** Collect the garbage of the page and its workers. */
async function collectGarbage({ page }: PlayerPage): Promise<void> {
  const collect = "new Promise((resolve) => setTimeout(() => resolve(gc()), 100))";
  for (const worker of page.workers()) await worker.evaluate(collect);
  await page.evaluate(collect);
  await setTimeout(SETTLING_MS);
}

/** Wait until a number of further frames has been shown. Runs on the page. */
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

/** Count the WebGL objects created from now on. Runs on the page, before there is a player. */
function countGraphicsObjects(): void {
  const prototype = WebGL2RenderingContext.prototype as unknown as Record<string, (...given: unknown[]) => unknown>;
  const counter = globalThis as unknown as { graphicsObjects: number };
  counter.graphicsObjects = 0;
  for (const kind of ["Buffer", "Texture", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader"]) {
    for (const [verb, count] of [["create", 1], ["delete", -1]] as const) {
      const act = prototype[verb + kind]!;
      prototype[verb + kind] = function (...given) {
        counter.graphicsObjects += count;
        return act.apply(this, given);
      };
    }
  }
}

// Heaps, workers and modules are in the renderer's private memory. The browser's buffers to the graphics driver's
// process grow by 8 MiB at a time, and count in both; for that process, WebGL objects are counted instead.
browserTest("memory stays flat over a thousand frames", async (context) => {
  await using page = await PlayerPage.open({ attributes: null, width: 160, height: 200 });
  await page.page.evaluate(countGraphicsObjects);
  await page.page.evaluate(() => {
    const player = document.createElement("quarc-player");
    for (const [name, value] of Object.entries({ src: "stream.quarc", loop: "", speed: "16" })) {
      player.setAttribute(name, value);
    }
    document.body.append(player);
  });
  const measure = async (): Promise<Record<string, number>> => {
    await page.run((player) => player.play());
    await page.run(playOn, 1000);
    await page.run((player) => player.pause());
    await collectGarbage(page);
    const objects = (await page.page.evaluate("graphicsObjects")) as number;
    return { private: await measureMemory("private"), all: await measureMemory("all"), objects };
  };
  const before = await measure();
  const after = await measure();
  const growth = (name: string): number => after[name]! - before[name]!;
  for (const name of ["private", "all"]) {
    context.diagnostic(`${name}: ${before[name]!.toFixed(0)} MiB, then ${growth(name).toFixed(1)} MiB more`);
  }
  assert.ok(before["objects"]! > 0);
  assert.equal(growth("objects"), 0, "objects of WebGL are left");
  assert.ok(growth("private") < MOST_PRIVATE_GROWTH_MIB, `${growth("private")} MiB`);
  assert.ok(growth("all") < MOST_GROWTH_MIB, `${growth("all")} MiB`);
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
  const before = await measureMemory("all");
  await live(30);
  await collectGarbage(page);
  const growth = (await measureMemory("all")) - before;
  context.diagnostic(`${before.toFixed(0)} MiB, then ${growth.toFixed(1)} MiB more`);
  assert.ok(growth < MOST_GROWTH_MIB, `${growth} MiB`);
  assert.equal(page.page.workers().length, 0, "workers are left");
});
