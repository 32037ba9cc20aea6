/** Rotations as integer unit quaternions w, x, y, z (SPEC 7.2, 7.3, 7.5). Products exceed 2^53, so all are `bigint`. */

import { divideRound, isqrt } from "./arithmetic.js";
import { PRODUCT_GUARD_BITS, ROTATION_FRACTION_BITS, ROTATION_ONE, SUM_GUARD_BITS } from "./constants.js";
import { demand } from "./reject.js";

export type Quaternion = readonly [number, number, number, number];

type BigQuaternion = readonly bigint[];

const ONE = BigInt(ROTATION_ONE);

/** `vector` normalized with `guardBits` guard bits (7.3). */
export function normalize(vector: Quaternion, guardBits: number): Quaternion {
  return toNumbers(normalizeBig(vector.map(BigInt), BigInt(guardBits)));
}

/** The rotation coded as the index of the omitted component and the other three in order (7.2). */
export function expandRotation(index: number, three: readonly number[], rotationBits: number): Quaternion {
  const unity = 2 ** rotationBits;
  demand(
    three.every((part) => Math.abs(part) <= unity),
    "rotation-range",
    "a component of a rotation is above 1",
  );
  const unit = 2 ** (ROTATION_FRACTION_BITS - rotationBits);
  const parts = three.map((part) => BigInt(part * unit));
  const square = ONE * ONE - sumOfSquares(parts);
  demand(square >= 0n, "rotation-range", "three components are longer than a unit quaternion");
  parts.splice(index, 0, isqrt(square));
  return toNumbers(normalizeBig(parts, BigInt(PRODUCT_GUARD_BITS)));
}

/** Multiply `before` by the residual (L x rotation_unity + W', X, Y, Z) on the right, and normalize (7.5). */
export function turn(before: Quaternion, residual: Quaternion): Quaternion {
  const q = before.map(BigInt);
  const d = normalizeBig(residual.map(BigInt), BigInt(SUM_GUARD_BITS));
  const product = multiply(q, d).map((component) => divideRound(component, ONE));
  return toNumbers(normalizeBig(product, BigInt(PRODUCT_GUARD_BITS)));
}

/** The Hamilton product q x d. */
function multiply([qw, qx, qy, qz]: BigQuaternion, [dw, dx, dy, dz]: BigQuaternion): BigQuaternion {
  return [
    qw * dw - qx * dx - qy * dy - qz * dz,
    qw * dx + qx * dw + qy * dz - qz * dy,
    qw * dy - qx * dz + qy * dw + qz * dx,
    qw * dz + qx * dy - qy * dx + qz * dw,
  ];
}

function normalizeBig(vector: BigQuaternion, guardBits: bigint): BigQuaternion {
  const square = sumOfSquares(vector);
  demand(square > 0n, "degenerate-rotation", "a rotation has norm zero");
  const norm = isqrt(square << (2n * guardBits));
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
