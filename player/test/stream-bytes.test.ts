/** The bytes of a stream: from a data URL, or received in pieces and kept. */

import assert from "node:assert/strict";
import { test, type TestContext } from "node:test";
import { makeStreamBytes } from "../src/decode/stream-bytes.js";

test("a data URL of 150 MB is decoded", () => {
  const stream = Buffer.alloc(150_000_000);
  stream.writeUInt32LE(0xfedcba98, stream.length - 4);
  const bytes = makeStreamBytes({ url: `data:application/octet-stream;base64,${stream.toString("base64")}` });
  assert.deepEqual([bytes.size, bytes.isSeekable], [stream.length, true]);
  assert.deepEqual([...(bytes.findAvailable(stream.length - 4) ?? [])], [0x98, 0xba, 0xdc, 0xfe]);
});

test("a data URL that is not valid base64 is requested", () => {
  for (const url of ["data:;base64,a", "data:,abcd", "data:;base64,AA%3D%3D"]) assert.equal(makeStreamBytes({ url }).isSeekable, false);
});

/** Replace `fetch` by a server of `size` bytes whose responses stop after some pieces of `pieceBytes`; list its requests. */
function serve(context: TestContext, size: number, pieceBytes: number, pieceCount = 1): RequestInit[] {
  const requests: RequestInit[] = [];
  context.mock.method(globalThis, "fetch", async (_: string, request: RequestInit) => {
    requests.push(request);
    const begin = Number(/\d+/.exec((request.headers as Record<string, string>)["Range"] ?? "")?.[0]);
    let count = 0;
    const body = new ReadableStream({ pull: (controller) => void (count++ < pieceCount && controller.enqueue(new Uint8Array(pieceBytes))) });
    return new Response(body, { status: 206, headers: { "Content-Range": `bytes ${begin}-${size - 1}/${size}` } });
  });
  return requests;
}

const { signal } = new AbortController();

test("requests have the headers of the source, and a live stream does not come from the browser's cache", async (context) => {
  const requests = serve(context, 1000, 100);
  const headers = { Authorization: "Bearer 1" };
  for (const isLive of [false, true]) {
    const bytes = makeStreamBytes({ url: "http://a/a.quarc", isLive, headers });
    await bytes.readPiece(5, signal);
    bytes.close();
  }
  assert.deepEqual(requests.map((request) => request.headers), Array(2).fill({ ...headers, Range: "bytes=5-" }));
  assert.deepEqual(requests.map(({ cache }) => cache), ["no-cache", "no-store"]);
  assert.ok(requests.every((request) => request.signal?.aborted), "closing ends the downloads");
});

test("only bytes that have arrived are available, also if there is a gap between two pieces", async (context) => {
  const requests = serve(context, 1_000_000, 100);
  const bytes = makeStreamBytes({ url: "http://a/a.quarc" });
  for (const offset of [0, 500_000, 50_000, 49_900, 30_000]) await bytes.readPiece(offset, signal);
  assert.equal(requests.length, 5);
  const availableCounts = [30_000, 30_100, 200, 500_000].map((offset) => bytes.findAvailable(offset)?.length ?? null);
  assert.deepEqual(availableCounts, [100, null, null, 100]);
  await bytes.readPiece(29_900, signal);
  assert.equal(bytes.findAvailable(29_900)?.length, 200, "adjacent pieces are joined");
  bytes.close();
});

test("a download is continued if it soon reaches the bytes that are needed", async (context) => {
  const requests = serve(context, 1_000_000, 50_000, 4);
  const bytes = makeStreamBytes({ url: "http://a/a.quarc" });
  for (const offset of [0, 50_000 + 120_000]) await bytes.readPiece(offset, signal);
  assert.equal(requests.length, 1);
  await bytes.readPiece(200_000 + 140_000, signal);
  assert.equal(requests.length, 2);
  bytes.close();
});

test("the last 64 MiB that have been received are kept", async (context) => {
  const mebibyte = 1 << 20;
  const requests = serve(context, 66 * mebibyte, mebibyte, 66);
  const bytes = makeStreamBytes({ url: "http://a/a.quarc" });
  for (let count = 0; count < 66; count++) await bytes.readPiece(count * mebibyte, signal);
  assert.deepEqual([bytes.receivedBytes, requests.length], [66 * mebibyte, 1]);
  const isKept = [0, 2 * mebibyte - 1, 2 * mebibyte, 66 * mebibyte - 1].map((offset) => bytes.findAvailable(offset) !== null);
  assert.deepEqual(isKept, [false, false, true, true]);
  bytes.close();
});
