/** Measures the processor time of the threads of a player in Chromium (Linux). */

import { readdirSync, readFileSync } from "node:fs";

/** Return the processor time so far of the page with the player, its sort worker and its decode worker, milliseconds. */
export async function measureThreads(browser) {
  const session = await browser.newBrowserCDPSession();
  const { processInfo } = await session.send("SystemInfo.getProcessInfo");
  await session.detach();
  const processTimes = processInfo.filter(({ type }) => type === "renderer").map(({ id }) => {
    const threads = readdirSync(`/proc/${id}/task`).sort((a, b) => a - b).map((thread) => {
      const readTaskFile = (name) => readFileSync(`/proc/${id}/task/${thread}/${name}`, "utf8");
      return { name: readTaskFile("comm"), ms: Number(readTaskFile("schedstat").split(" ")[0]) / 1e6 };
    });
    const workers = threads.filter(({ name }) => name.startsWith("DedicatedWorker"));
    return [threads[0], ...workers].map(({ ms }) => ms);
  });
  return processTimes.find((threads) => threads.length === 3);
}
