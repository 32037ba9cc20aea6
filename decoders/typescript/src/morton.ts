/** Morton keys and Morton order: bit i of x, y, z is bit 3i + 2, 3i + 1, 3i of the key (SPEC 8.5). */

const HALF_KEY_BITS = 30;
const HALF_KEY_MASK = (1n << 30n) - 1n;
const HALF_AXIS_BITS = HALF_KEY_BITS / 3;

/** Extract a coordinate from a key of up to 60 bits; the axis is 0 for x, 1 for y, 2 for z. */
export function extractCoordinate(key: bigint, axis: number): number {
  const high = gatherBits(Number(key >> BigInt(HALF_KEY_BITS)), axis);
  const low = gatherBits(Number(key & HALF_KEY_MASK), axis);
  return high * 2 ** HALF_AXIS_BITS + low;
}

/** Gather every third bit of half a key. */
function gatherBits(halfKey: number, axis: number): number {
  let coordinate = 0;
  for (let i = 0; i < HALF_AXIS_BITS; i++) coordinate |= ((halfKey >> (3 * i + 2 - axis)) & 1) << i;
  return coordinate;
}

/** Compare two Gaussians by their Morton keys, so that Gaussians of the same cell are adjacent at every shift. */
export function compareMorton(columns: readonly Int32Array[], first: number, second: number): number {
  let decisiveColumn = columns[0];
  let leadingZeros = Math.clz32(decisiveColumn[first] ^ decisiveColumn[second]);
  for (const column of columns) {
    const zeros = Math.clz32(column[first] ^ column[second]);
    if (zeros < leadingZeros) {
      decisiveColumn = column;
      leadingZeros = zeros;
    }
  }
  return decisiveColumn[first] - decisiveColumn[second];
}
