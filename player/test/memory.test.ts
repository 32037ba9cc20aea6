/** Memory does not grow over many frames, nor over many insertions and removals of the component. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { setTimeout } from "node:timers/promises";
import { browserTest, launch, PlayerPage, type PlayerElement } from "./browser.js";

const MAX_GROWTH_MIB = 48; // pools of the graphics process
const MAX_INSERTION_GROWTH_MIB = 32;
const MAX_PRIVATE_GROWTH_MIB = 8;
const SETTLING_TIME_MS = 1000; // for the processes to return freed memory

/** Measure the memory of the browser, MiB: resident memory of all processes, or private memory of the renderers. */
async function measureMemory(scope: "all" | "private"): Promise<number> {
  const session = await (await launch()).newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  const processes = processInfo.filter(({ type }) => scope === "all" || type === "renderer");
  const fieldPattern = scope === "all" ? /VmRSS:\s*(\d+)/ : /RssAnon:\s*(\d+)/;
  const sizes = processes.map(({ id }) => {
    const status = readFileSync(`/proc/${id}/status`, "utf8");
    return Number(fieldPattern.exec(status)?.[1] ?? 0) / 1024;
  });
  return sizes.reduce((sum, size) => sum + size, 0);
}

/** Collect the garbage of the page and its workers, of which some may be ending. */
async function collectGarbage({ page }: PlayerPage): Promise<void> {
  const script = "new Promise((resolve) => setTimeout(() => resolve(gc()), 100))";
  const requireEnded = ({ message }: Error): void => assert.match(message, /has been closed/);
  for (const worker of page.workers()) await worker.evaluate(script).catch(requireEnded);
  await page.evaluate(script);
  await setTimeout(SETTLING_TIME_MS);
}

/** Wait until `count` more frames have been shown. Runs on the page. */
function waitForFrames(player: PlayerElement, count: number): Promise<void> {
  return new Promise((resolve) => {
    let shownCount = 0;
    const countFrame = (): void => {
      if (++shownCount < count) return;
      player.removeEventListener("frame", countFrame);
      resolve();
    };
    player.addEventListener("frame", countFrame);
  });
}

/** Start counting WebGL objects. Runs on the page, before a player is created. */
function countGraphicsObjects(): void {
  const prototype = WebGL2RenderingContext.prototype as unknown as Record<string, (...args: unknown[]) => unknown>;
  const counter = globalThis as unknown as { graphicsObjects: number };
  counter.graphicsObjects = 0;
  for (const kind of ["Buffer", "Texture", "Framebuffer", "Renderbuffer", "VertexArray", "Program", "Shader"]) {
    for (const [operation, count] of [["create", 1], ["delete", -1]] as const) {
      const originalMethod = prototype[operation + kind]!;
      prototype[operation + kind] = function (...args) {
        counter.graphicsObjects += count;
        return originalMethod.apply(this, args);
      };
    }
  }
}

// Heaps, workers and modules are in the private memory of the renderer. The buffers that it shares with the graphics
// process grow by 8 MiB at a time, so WebGL objects are counted instead.
browserTest("memory does not grow over a thousand frames", async (context) => {
  await using page = await PlayerPage.open({ attributes: null, width: 160, height: 200 });
  await page.page.evaluate(countGraphicsObjects);
  await page.page.evaluate(() => {
    const player = document.createElement("quarc-player");
    for (const [name, value] of Object.entries({ src: "stream.quarc", loop: "", speed: "16" })) {
      player.setAttribute(name, value);
    }
    document.body.append(player);
  });
  const measureAfter = async (frames: number): Promise<Record<string, number>> => {
    await page.run((player) => player.play());
    await page.run(waitForFrames, frames);
    await page.run((player) => player.pause());
    await collectGarbage(page);
    const objects = (await page.page.evaluate("graphicsObjects")) as number;
    return { private: await measureMemory("private"), all: await measureMemory("all"), objects };
  };
  const memoryBefore = await measureAfter(600);
  const memoryAfter = await measureAfter(1000);
  const computeGrowth = (name: string): number => memoryAfter[name]! - memoryBefore[name]!;
  for (const name of ["private", "all"]) {
    context.diagnostic(`${name}: ${memoryBefore[name]!.toFixed(0)} MiB, then ${computeGrowth(name).toFixed(1)} MiB more`);
  }
  assert.ok(memoryBefore["objects"]! > 0);
  assert.equal(computeGrowth("objects"), 0, "WebGL objects were created and not deleted");
  assert.ok(computeGrowth("private") < MAX_PRIVATE_GROWTH_MIB, `${computeGrowth("private")} MiB`);
  assert.ok(computeGrowth("all") < MAX_GROWTH_MIB, `${computeGrowth("all")} MiB`);
});

browserTest("memory does not grow when the component is inserted and removed twenty times", async (context) => {
  await using page = await PlayerPage.open({ attributes: null, width: 160, height: 200 });
  const insertAndRemove = (repetitions: number): Promise<void> =>
    page.page.evaluate(async (count) => {
      for (let index = 0; index < count; index++) {
        const player = document.createElement("quarc-player");
        player.setAttribute("src", "stream.quarc");
        document.body.append(player);
        await new Promise((resolve) => player.addEventListener("frame", resolve, { once: true }));
        player.remove();
      }
    }, repetitions);
  await insertAndRemove(10);
  await collectGarbage(page);
  const memoryBefore = await measureMemory("all");
  await insertAndRemove(20);
  await collectGarbage(page);
  const computeGrowth = (await measureMemory("all")) - memoryBefore;
  context.diagnostic(`${memoryBefore.toFixed(0)} MiB, then ${computeGrowth.toFixed(1)} MiB more`);
  assert.ok(computeGrowth < MAX_INSERTION_GROWTH_MIB, `${computeGrowth} MiB`);
  for (let tries = 0; page.page.workers().length > 0 && tries < 100; tries++) await setTimeout(100);
  assert.equal(page.page.workers().length, 0, "workers are still running");
});
