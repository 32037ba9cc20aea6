/** The four streams of Annex G. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { decodeStream } from "../src/decode.js";
import { stateDigest } from "../src/digest.js";
import { MemorySource } from "../src/source.js";
import type { State } from "../src/state.js";
import { integers, streamBytes, table } from "./spec.js";

for (const name of ["A", "B", "C", "D"]) {
  test(`the states of stream ${name} have the digests of Annex G`, () => {
    const states = [...decodeStream(new MemorySource(streamBytes(name)))].map(({ state }) => state);

    assert.deepEqual(
      states.map(describe),
      table(`digests ${name}`).map((row) => row.filter((_, i) => i !== 3 && i !== 4)),
    );
  });

  test(`the states of stream ${name} match Annex G`, () => {
    for (const { state } of decodeStream(new MemorySource(streamBytes(name)))) {
      const rows = table(`state ${name}${state.ordinal}`).map((row) => row.map(integers));

      assert.deepEqual(gaussians(state), rows);
    }
  });
}

function describe({ ordinal, phase, scene }: State): string[] {
  return [`${ordinal}`, `${phase}`, `${scene.ids.length}`, stateDigest(scene, phase)];
}

function gaussians({ scene }: State): number[][][] {
  return Array.from(scene.ids, (id, i) => [
    [id],
    scene.positions.map((column) => column[i]),
    scene.rotations.map((column) => column[i]),
    scene.codes.map((row) => row[i]),
  ]);
}
