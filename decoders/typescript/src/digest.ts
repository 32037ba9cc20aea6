/** The serialization of a state, its CRC and its digest (SPEC 9). */

import { createHash } from "node:crypto";
import { Crc } from "./crc.js";
import type { CodedScene } from "./scene.js";

/** The SHA-256 of the serialization, in hexadecimal. */
export function stateDigest(scene: CodedScene, phase: number): string {
  const hash = createHash("sha256");
  for (const bytes of serialize(scene, phase, true)) hash.update(bytes);
  return hash.digest("hex");
}

/** The CRC of the serialization, with or without the codes. */
export function stateCrc(scene: CodedScene, phase: number, withCodes: boolean): number {
  const crc = new Crc();
  for (const bytes of serialize(scene, phase, withCodes)) crc.add(bytes);
  return crc.value();
}

/** The serialization, column by column, to keep only one copy of a column in memory. */
export function* serialize(scene: CodedScene, phase: number, withCodes: boolean): Generator<Uint8Array> {
  yield toBytes([scene.ids.length, phase]);
  yield toBytes(scene.ids);
  for (const column of [...scene.positions, ...scene.rotations]) yield toBytes(column);
  if (!withCodes) return;
  for (const row of scene.codes) yield toBytes(row);
}

/** 32-bit integers as little-endian bytes; an i32 and a u32 that are equal modulo 2^32 have the same bytes. */
function toBytes(numbers: ArrayLike<number>): Uint8Array {
  const bytes = new Uint8Array(4 * numbers.length);
  const view = new DataView(bytes.buffer);
  for (let i = 0; i < numbers.length; i++) view.setInt32(4 * i, numbers[i], true);
  return bytes;
}
