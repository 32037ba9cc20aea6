/** Functions for columns of integers. */

/** Make a column of `count` numbers, where number i is `computeValue(i)`. */
export function tabulate(count: number, computeValue: (index: number) => number): Int32Array {
  const column = new Int32Array(count);
  for (let i = 0; i < count; i++) column[i] = computeValue(i);
  return column;
}

/** Return the indices below `count` for which `condition` is true, ascending. */
export function indicesWhere(count: number, condition: (index: number) => boolean): Uint32Array {
  const indices = new Uint32Array(count);
  let matchCount = 0;
  for (let i = 0; i < count; i++) if (condition(i)) indices[matchCount++] = i;
  return indices.slice(0, matchCount);
}

/** Return all indices below `count`, ascending. */
export function allIndices(count: number): Uint32Array {
  return indicesWhere(count, () => true);
}

/** Return the numbers of a column at `indices`, in this order. */
export function pickColumn(column: Int32Array, indices: Uint32Array): Int32Array {
  return tabulate(indices.length, (i) => column[indices[i]]);
}
