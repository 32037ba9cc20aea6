/** Rotations as integer unit quaternions (SPEC 7.2, 7.3, 7.5). Products exceed 2^53, so computations use `bigint`. */

import { divideRound, isqrt } from "./arithmetic.js";
import { PRODUCT_GUARD_BITS, ROTATION_FRACTION_BITS, ROTATION_ONE, SUM_GUARD_BITS } from "./constants.js";
import { demand } from "./reject.js";

export type Quaternion = readonly [number, number, number, number];

type BigQuaternion = readonly bigint[];

const ONE = BigInt(ROTATION_ONE);

/** Normalize a vector with `guardBits` guard bits (7.3). */
export function normalize(vector: Quaternion, guardBits: number): Quaternion {
  return toNumbers(normalizeBig(vector.map(BigInt), BigInt(guardBits)));
}

/** Expand a rotation that is coded as the index of the omitted component and the other three components (7.2). */
export function expandRotation(index: number, components: readonly number[], rotationBits: number): Quaternion {
  const maximum = 2 ** rotationBits;
  demand(
    components.every((part) => Math.abs(part) <= maximum),
    "rotation-range",
    "a component of a rotation is above 1",
  );
  const stepSize = 2 ** (ROTATION_FRACTION_BITS - rotationBits);
  const parts = components.map((part) => BigInt(part * stepSize));
  const squaredNorm = ONE * ONE - sumOfSquares(parts);
  demand(squaredNorm >= 0n, "rotation-range", "the squares of three components of a rotation sum to more than 1");
  parts.splice(index, 0, isqrt(squaredNorm));
  return toNumbers(normalizeBig(parts, BigInt(PRODUCT_GUARD_BITS)));
}

/** Multiply a rotation by a residual on the right, and normalize the product (7.5). */
export function rotate(rotation: Quaternion, residual: Quaternion): Quaternion {
  const q = rotation.map(BigInt);
  const d = normalizeBig(residual.map(BigInt), BigInt(SUM_GUARD_BITS));
  const product = multiply(q, d).map((component) => divideRound(component, ONE));
  return toNumbers(normalizeBig(product, BigInt(PRODUCT_GUARD_BITS)));
}

/** Return the Hamilton product q x d. */
function multiply([qw, qx, qy, qz]: BigQuaternion, [dw, dx, dy, dz]: BigQuaternion): BigQuaternion {
  return [
    qw * dw - qx * dx - qy * dy - qz * dz,
    qw * dx + qx * dw + qy * dz - qz * dy,
    qw * dy - qx * dz + qy * dw + qz * dx,
    qw * dz + qx * dy - qy * dx + qz * dw,
  ];
}

function normalizeBig(vector: BigQuaternion, guardBits: bigint): BigQuaternion {
  const squaredNorm = sumOfSquares(vector);
  demand(squaredNorm > 0n, "degenerate-rotation", "a rotation has norm zero");
  const norm = isqrt(squaredNorm << (2n * guardBits));
  const shift = BigInt(ROTATION_FRACTION_BITS) + guardBits;
  return vector.map((component) => divideRound(component << shift, norm));
}

function sumOfSquares(vector: BigQuaternion): bigint {
  return vector.reduce((sum, component) => sum + component * component, 0n);
}

function toNumbers(vector: BigQuaternion): Quaternion {
  const [w, x, y, z] = vector.map(Number);
  return [w, x, y, z];
}
