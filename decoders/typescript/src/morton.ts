/** Morton order: bit i of x, y, z is bit 3i + 2, 3i + 1, 3i of the key (SPEC 8.5). */

const HALF_KEY_BITS = 30;
const HALF_KEY_MASK = (1n << 30n) - 1n;
const HALF_AXIS_BITS = HALF_KEY_BITS / 3;

/** The coordinate on an axis (0 for x, 1 for y, 2 for z) in a key of up to 60 bits. */
export function coordinateOfKey(key: bigint, axis: number): number {
  const high = gather(Number(key >> BigInt(HALF_KEY_BITS)), axis);
  const low = gather(Number(key & HALF_KEY_MASK), axis);
  return high * 2 ** HALF_AXIS_BITS + low;
}

/** Every third bit of half a key. */
function gather(half: number, axis: number): number {
  let coordinate = 0;
  for (let i = 0; i < HALF_AXIS_BITS; i++) coordinate |= ((half >> (3 * i + 2 - axis)) & 1) << i;
  return coordinate;
}

/** Compare two Gaussians by their cells; sorting with this keeps the Gaussians of a cell together at every shift. */
export function compareMorton(columns: readonly Int32Array[], first: number, second: number): number {
  let decisive = columns[0];
  let leadingZeros = Math.clz32(decisive[first] ^ decisive[second]);
  for (const column of columns) {
    const zeros = Math.clz32(column[first] ^ column[second]);
    if (zeros < leadingZeros) {
      decisive = column;
      leadingZeros = zeros;
    }
  }
  return decisive[first] - decisive[second];
}
