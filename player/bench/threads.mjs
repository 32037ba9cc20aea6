/** Processor time of the threads of a player in Chromium (Linux). */

import { readdirSync, readFileSync } from "node:fs";

/** Processor time so far of the page with the player, of its sort worker and its decode worker, in milliseconds. */
export async function measureThreads(browser) {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  const times = processInfo.filter(({ type }) => type === "renderer").map(({ id }) => {
    const threads = readdirSync(`/proc/${id}/task`).sort((a, b) => a - b).map((thread) => {
      const read = (name) => readFileSync(`/proc/${id}/task/${thread}/${name}`, "utf8");
      return { name: read("comm"), ms: Number(read("schedstat").split(" ")[0]) / 1e6 };
    });
    const workers = threads.filter(({ name }) => name.startsWith("DedicatedWorker"));
    return [threads[0], ...workers].map(({ ms }) => ms);
  });
  return times.find((threads) => threads.length === 3);
}
