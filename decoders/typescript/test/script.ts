/** Simulated sections: a script gives the bits of each plane, and the expected model and contexts. */

import assert from "node:assert/strict";
import type { Model, Section } from "../src/planes.js";

/** The model of a plane, the contexts of its elements and their bits. */
export type Plane = readonly [Model, number[], number[]];

/** Make a section that returns the bits of a script, and checks the requested models and contexts. */
export function makeScriptedSection(script: readonly Plane[]): Section {
  let planeIndex = 0;
  const decodePlane = (model: Model, contexts: Int32Array) => {
    if (contexts.length === 0) return new Uint8Array(0);
    const [expected, expectedContexts, bits] = script[planeIndex++];
    const description = `plane ${planeIndex - 1}`;
    assert.equal(model, expected, description);
    assert.deepEqual(Array.from(contexts), expectedContexts, description);
    return Uint8Array.from(bits);
  };
  const finish = () => assert.equal(planeIndex, script.length);
  return { decodePlane, finish } as unknown as Section;
}

/** Make the four planes of classes of 4 bits; each number has its outer context. */
export function makeClassPlanes(model: Model, outer: number[], classes: number[]): Plane[] {
  let nodes = outer.map(() => 1);
  return [3, 2, 1, 0].map((bit) => {
    const contexts = outer.map((context, i) => 16 * context + nodes[i]);
    const bits = classes.map((size) => (size >> bit) & 1);
    nodes = nodes.map((node, i) => 2 * node + bits[i]);
    return [model, contexts, bits];
  });
}
