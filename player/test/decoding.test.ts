/** Requests and replies: decoding ahead, quick seeks, memory. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { Decoding } from "../src/decode/decoding.js";
import type { DecodeReply, FramePacket } from "../src/protocol.js";
import { Rebuilt } from "./rebuild.js";
import { readVector, StreamServer } from "./server.js";

const LAPS = 120; // of nine frames

/** A page: stores the replies, and waits for those it wants. */
class Page {
  readonly replies: DecodeReply[] = [];
  readonly decoding = new Decoding((reply) => {
    this.replies.push(reply);
    this.#look();
  });
  #look = (): void => undefined;

  get frames(): FramePacket[] {
    return this.replies.flatMap((reply) => (reply.kind === "frame" ? [reply.packet] : []));
  }

  async until(holds: () => boolean): Promise<void> {
    await new Promise<void>((resolve) => {
      this.#look = () => (holds() ? resolve() : undefined);
      this.#look();
    });
  }

  has(kind: DecodeReply["kind"], run: number): boolean {
    return this.replies.some((reply) => reply.kind === kind && "run" in reply && reply.run === run);
  }

  open(name: string): void {
    const bytes = Uint8Array.from(readVector(`streams/${name}`)).buffer;
    this.decoding.take({ kind: "open", source: { bytes }, run: 0 });
  }
}

const quiet = (milliseconds: number): Promise<void> =>
  new Promise((resolve) => setTimeout(resolve, milliseconds));

test("only the allowed number of frames is sent", async () => {
  const page = new Page();
  page.open("journey");
  page.decoding.take({ kind: "more", frames: 2, run: 0 });
  await page.until(() => page.frames.length === 2);
  await quiet(100);
  assert.deepEqual(page.frames.map(({ frame }) => frame), [0, 1]);
  page.decoding.take({ kind: "more", frames: 3, run: 0 });
  await page.until(() => page.frames.length === 5);
  await quiet(100);
  assert.equal(page.frames.length, 5);
  page.decoding.take({ kind: "close" });
});

test("of several quick seeks the last one is done, and its frames carry its number", async () => {
  const page = new Page();
  page.open("journey");
  for (let run = 1; run <= 20; run++) {
    page.decoding.take({ kind: "seek", frame: (3 * run) % 9, run });
    page.decoding.take({ kind: "more", frames: 9, run });
  }
  page.decoding.take({ kind: "seek", frame: 5, run: 21 });
  page.decoding.take({ kind: "more", frames: 9, run: 21 });
  await page.until(() => page.has("end", 21));
  const frames = page.frames.filter(({ run }) => run === 21);
  assert.deepEqual(frames.map(({ frame }) => frame), [5, 6, 7, 8]);
  assert.deepEqual(frames.map(({ isFull }) => isFull), [true, false, false, false]);
});

test("playing a stream repeatedly takes no more memory, and gives the same frames", async () => {
  const page = new Page();
  page.open("snapshots-updates");
  page.decoding.take({ kind: "more", frames: 100, run: 0 });
  await page.until(() => page.has("end", 0));
  const lap = async (run: number): Promise<string> => {
    page.replies.length = 0;
    page.decoding.take({ kind: "seek", frame: 0, run });
    page.decoding.take({ kind: "more", frames: 100, run });
    await page.until(() => page.has("end", run));
    const rebuilt = new Rebuilt();
    return page.frames.map((packet) => rebuilt.take(packet)).join();
  };
  const due = await lap(1);
  const rss = (): number => process.memoryUsage().rss / 2 ** 20;
  let settled = 0;
  for (let run = 2; run < LAPS; run++) {
    assert.equal(await lap(run), due);
    if (run === LAPS >> 1) settled = rss();
  }
  assert.ok(rss() < settled + 32, `${settled.toFixed()} MiB, then ${rss().toFixed()}`);
});

test("a seek does not request available bytes", async () => {
  await using server = await StreamServer.start(readVector("streams/journey"));
  const page = new Page();
  page.decoding.take({ kind: "open", source: { url: server.url }, run: 0 });
  page.decoding.take({ kind: "more", frames: 1, run: 0 });
  await page.until(() => page.frames.length === 1);
  const asked = server.requests.length;
  page.decoding.take({ kind: "seek", frame: 7, run: 1 });
  page.decoding.take({ kind: "more", frames: 9, run: 1 });
  await page.until(() => page.has("end", 1));
  assert.deepEqual(page.frames.map(({ frame }) => frame), [0, 7, 8]);
  assert.equal(server.requests.length, asked, "a stream of one piece is already available");
});
