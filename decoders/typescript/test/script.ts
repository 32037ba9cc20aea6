/** Sections whose bits are given by a test, which also checks the requested planes. */

import assert from "node:assert/strict";
import type { Model, Section } from "../src/planes.js";

/** The model of a plane, the contexts of its elements and their bits. */
export type Plane = readonly [Model, number[], number[]];

/** A section whose planes have these bits; it checks the requested contexts. */
export function scripted(script: readonly Plane[]): Section {
  let next = 0;
  const plane = (model: Model, contexts: Int32Array) => {
    if (contexts.length === 0) return new Uint8Array(0);
    const [expected, expectedContexts, bits] = script[next++];
    const place = `plane ${next - 1}`;
    assert.equal(model, expected, place);
    assert.deepEqual(Array.from(contexts), expectedContexts, place);
    return Uint8Array.from(bits);
  };
  const finish = () => assert.equal(next, script.length);
  return { plane, finish } as unknown as Section;
}

/** The planes of a class of 4 bits: each number in its outer context. */
export function classPlanes(model: Model, outer: number[], classes: number[]): Plane[] {
  let nodes = outer.map(() => 1);
  return [3, 2, 1, 0].map((bit) => {
    const contexts = outer.map((context, i) => 16 * context + nodes[i]);
    const bits = classes.map((size) => (size >> bit) & 1);
    nodes = nodes.map((node, i) => 2 * node + bits[i]);
    return [model, contexts, bits];
  });
}
