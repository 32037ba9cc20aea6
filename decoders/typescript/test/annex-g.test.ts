/** The four streams of Annex G decode to the states of Annex G. */

import assert from "node:assert/strict";
import { test } from "node:test";
import { decodeStream } from "../src/decode.js";
import { digestState } from "../src/digest.js";
import { MemorySource } from "../src/source.js";
import type { State } from "../src/state.js";
import { parseIntegers, readStream, readTable } from "./spec.js";

for (const name of ["A", "B", "C", "D"]) {
  test(`the states of stream ${name} have the digests of Annex G`, () => {
    const states = [...decodeStream(new MemorySource(readStream(name)))].map(({ state }) => state);

    assert.deepEqual(
      states.map(listStateFields),
      readTable(`digests ${name}`).map((row) => row.filter((_, i) => i !== 3 && i !== 4)),
    );
  });

  test(`the states of stream ${name} match Annex G`, () => {
    for (const { state } of decodeStream(new MemorySource(readStream(name)))) {
      const rows = readTable(`state ${name}${state.ordinal}`).map((row) => row.map(parseIntegers));

      assert.deepEqual(listGaussians(state), rows);
    }
  });
}

function listStateFields({ ordinal, phase, scene }: State): string[] {
  return [`${ordinal}`, `${phase}`, `${scene.ids.length}`, digestState(scene, phase)];
}

function listGaussians({ scene }: State): number[][][] {
  return Array.from(scene.ids, (id, i) => [
    [id],
    scene.positions.map((column) => column[i]),
    scene.rotations.map((column) => column[i]),
    scene.codes.map((row) => row[i]),
  ]);
}
