/** Tests what the decoder does when a server has no range requests, fails, stalls or changes, and when a stream is live. */

import assert from "node:assert/strict";
import { createServer } from "node:http";
import type { AddressInfo } from "node:net";
import { test, type TestContext } from "node:test";
import { HttpSource } from "../src/decode/source.js";
import { decodeDirectly, expectFault, readSource } from "./decoded-frames.js";
import { readVector, StreamServer } from "./server.js";

type Headers = Readonly<Record<string, string>>;

test("a server without range requests is read sequentially, even after a seek", async () => {
  const stream = readVector("streams/journey");
  const expectedFrames = await decodeDirectly(stream);
  await using server = await StreamServer.start(stream, { supportsRanges: false });
  assert.deepEqual(await readSource({ url: server.url }), expectedFrames);
  assert.deepEqual(await readSource({ url: server.url }, 4), expectedFrames.slice(4));
});

/** Shorten the pauses and the time limits of requests to a thirtieth. */
function shortenPauses(context: TestContext): void {
  const { setTimeout } = globalThis;
  context.mock.method(globalThis, "setTimeout", (callback: () => void, delay = 0, ...parameters: []) =>
    setTimeout(callback, delay < 100 ? delay : delay / 30, ...parameters),
  );
}

test("after a connection breaks, the missing bytes are requested", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  for (const supportsRanges of [true, false]) {
    const breakAfterBytes = supportsRanges ? 200 : stream.length - 1; // 200: more breaks than consecutive failures are allowed
    await using server = await StreamServer.start(stream, { supportsRanges, breakAfterBytes });
    if (supportsRanges) assert.deepEqual(await readSource({ url: server.url }), await decodeDirectly(stream));
    else await assert.rejects(readSource({ url: server.url }), expectFault("network", null));
    assert.ok(server.requests.length > 3);
  }
});

test("the reason for which a server cannot be reached is part of the error", async (context) => {
  shortenPauses(context);
  const server = await StreamServer.start(new Uint8Array(0));
  const { url } = server;
  await server[Symbol.asyncDispose]();
  await assert.rejects(readSource({ url }), /fetch failed: connect ECONNREFUSED/);
});

test("a server that fails before its first answer is then read with range requests", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  await using server = await StreamServer.start(stream);
  const { fetch } = globalThis;
  const refuse = (): Promise<Response> => Promise.reject(new TypeError("refused"));
  for (const fail of [refuse, () => Promise.resolve(new Response(null, { status: 503 }))]) {
    for (const failureCount of [1, 2, 3, 4]) {
      let requestCount = 0;
      const mock = context.mock.method(globalThis, "fetch", (...request: Parameters<typeof fetch>) =>
        ++requestCount > failureCount ? fetch(...request) : fail(),
      );
      const source = new HttpSource({ url: server.url });
      for await (const { offset } of source.read(600, new AbortController().signal)) assert.ok(offset >= 600);
      assert.deepEqual([source.hasRanges, source.size], [true, stream.length]);
      mock.mock.restore();
    }
  }
});

test("a connection that stalls counts as broken", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  const expectedFrames = await decodeDirectly(stream);
  for (const isLive of [false, true]) {
    await using server = await StreamServer.start(stream, { stallAfterBytes: stream.length / 2 });
    assert.deepEqual(await readSource({ url: server.url, isLive }), expectedFrames);
    assert.equal(server.requests.filter((range) => range !== "bytes=0-").length, 1);
  }
  await using server = await StreamServer.start(stream, { stallAfterBytes: 0 }); // not even a header
  await assert.rejects(readSource({ url: server.url }), /no byte arrived for 15 s/);
  assert.equal(server.requests.length, 5);
});

test("a response for a live stream may wait for bytes that have not been written", async (context) => {
  shortenPauses(context);
  const { setTimeout } = globalThis;
  const stream = readVector("streams/journey");
  let requests = 0;
  const server = createServer((_, response) => {
    requests += 1;
    setTimeout(() => response.write(stream.subarray(0, 900)), 20_000);
    setTimeout(() => response.end(stream.subarray(900)), 40_000);
  });
  await new Promise<void>((resolve) => server.listen(0, "127.0.0.1", resolve));
  try {
    const url = `http://127.0.0.1:${(server.address() as AddressInfo).port}/`;
    assert.deepEqual(await readSource({ url, isLive: true }), await decodeDirectly(stream));
    assert.equal(requests, 1);
  } finally {
    server.close();
  }
});

test("an address that is invalid is reported without a retry", async (context) => {
  const fetched = context.mock.method(globalThis, "fetch");
  await assert.rejects(readSource({ url: "stream.quarc" }), /the address is invalid/);
  assert.equal(fetched.mock.callCount(), 0);
});

/** Read a file whose connection breaks, and change it on the server after the first piece; return the bytes read. */
async function readChanging(headers: Headers, change: (server: StreamServer) => void, isLive = false): Promise<number> {
  await using server = await StreamServer.start(readVector("streams/journey"), { breakAfterBytes: 700, headers });
  const abortController = new AbortController();
  let end = 0;
  for await (const { offset, bytes } of new HttpSource({ url: server.url, isLive }).read(0, abortController.signal)) {
    if (end === 0) change(server);
    end = offset + bytes.length;
    if (end === readVector("streams/journey").length) break; // a live stream has no end
  }
  return end;
}

test("a file that is replaced while it is read is a network error", async (context) => {
  shortenPauses(context);
  const other = Uint8Array.from(readVector("streams/journey")).fill(0, 600);
  const [shorter, longer] = [other.subarray(0, 1500), new Uint8Array(other.length + 1)];
  const expectChange = { name: "NetworkError", message: /the file on the server has changed$/ };
  for (const [name, before, after] of [
    ["ETag", '"1"', '"2"'],
    ["Last-Modified", "Tue, 24 Nov 2026 10:00:00 GMT", "Tue, 24 Nov 2026 10:00:01 GMT"],
  ] as const) {
    const replace = (server: StreamServer): void => {
      server.grow(other);
      server.setOptions({ headers: { [name]: after } });
    };
    await assert.rejects(readChanging({ [name]: before }, replace), expectChange, name);
  }
  for (const replacement of [shorter, longer]) {
    await assert.rejects(readChanging({}, (server) => server.grow(replacement)), expectChange);
  }
  await assert.rejects(readChanging({}, (server) => server.grow(shorter.subarray(0, 800)), true), expectChange);
});

test("weak ETags, missing ETags and those of a live stream do not show that a file was replaced", async (context) => {
  shortenPauses(context);
  const modified = "Tue, 24 Nov 2026 10:00:00 GMT";
  const length = readVector("streams/journey").length;
  const laterHeaders: Headers[] = [{ ETag: 'W/"2"' }, { "Last-Modified": modified }, {}];
  for (const after of laterHeaders) {
    const change = (server: StreamServer): void => server.setOptions({ headers: after });
    assert.equal(await readChanging({ ETag: 'W/"1"', "Last-Modified": modified }, change), length);
  }
  const change = (server: StreamServer): void => server.setOptions({ headers: { ETag: '"2"' } });
  assert.equal(await readChanging({ ETag: '"1"' }, change, true), length);
});

test("a server need not tell the size of a stream", async () => {
  const stream = readVector("streams/journey");
  for (const unknownSizePartBytes of [stream.length, 1000]) {
    await using server = await StreamServer.start(stream, { unknownSizePartBytes });
    assert.deepEqual(await readSource({ url: server.url }), await decodeDirectly(stream));
    assert.deepEqual((await readSource({ url: server.url }, 4)).length, 5);
  }
});

test("a live stream is followed to its end", async () => {
  const stream = readVector("streams/journey");
  const expectedFrames = await decodeDirectly(stream);
  await using server = await StreamServer.start(stream.subarray(0, 900));
  const growthTimers = [1200, 1800, stream.length].map((size, index) =>
    setTimeout(() => server.grow(stream.subarray(0, size)), 300 * (index + 1)),
  );
  assert.deepEqual(await readSource({ url: server.url, isLive: true }), expectedFrames);
  growthTimers.forEach(clearTimeout);
});

test("a live stream that is played at its newest frame survives an outage", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  await using server = await StreamServer.start(stream.subarray(0, 900));
  const waitForRequests = async (count: number): Promise<void> => {
    const end = server.requests.length + count;
    for (let waits = 0; server.requests.length < end; waits++) {
      assert.ok(waits < 3000, "no more requests come");
      await new Promise((resolve) => setTimeout(resolve, 10));
    }
  };
  const frames = readSource({ url: server.url, isLive: true });
  await waitForRequests(2);
  for (const status of [503, 429, 408]) {
    server.setOptions({ status });
    await waitForRequests(3);
  }
  server.setOptions({ status: null });
  server.grow(stream);
  assert.deepEqual(await frames, await decodeDirectly(stream));
});

test("failures of requests for a live stream do not add up while other requests succeed", async (context) => {
  shortenPauses(context);
  const stream = readVector("streams/journey");
  await using server = await StreamServer.start(stream.subarray(0, 900));
  const { fetch } = globalThis;
  let requestCount = 0;
  context.mock.method(globalThis, "fetch", (...request: Parameters<typeof fetch>) => {
    if (++requestCount === 13) server.grow(stream);
    return requestCount % 2 === 0 ? Promise.reject(new TypeError("offline")) : fetch(...request);
  });
  assert.deepEqual(await readSource({ url: server.url, isLive: true }), await decodeDirectly(stream));
});
