/** Columns of integers. */

/** A column of `count` numbers, where number i is `value(i)`. */
export function tabulate(count: number, value: (index: number) => number): Int32Array {
  const column = new Int32Array(count);
  for (let i = 0; i < count; i++) column[i] = value(i);
  return column;
}

/** The indices below `count` for which `holds` is true, ascending. */
export function indicesWhere(count: number, holds: (index: number) => boolean): Uint32Array {
  const indices = new Uint32Array(count);
  let found = 0;
  for (let i = 0; i < count; i++) if (holds(i)) indices[found++] = i;
  return indices.slice(0, found);
}

/** The indices below `count`. */
export function allIndices(count: number): Uint32Array {
  return indicesWhere(count, () => true);
}

/** The numbers of a column at `indices`. */
export function pick(column: Int32Array, indices: Uint32Array): Int32Array {
  return tabulate(indices.length, (i) => column[indices[i]]);
}
