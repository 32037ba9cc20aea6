/** The bytes of a stream in a data URL. */

import assert from "node:assert/strict";
import { test } from "node:test";
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
