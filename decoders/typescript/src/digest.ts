/** Serializes a state, and computes its CRC and its digest (SPEC 9). */

import { createHash } from "node:crypto";
import { Crc } from "./crc.js";
import type { CodedScene } from "./scene.js";

/** Return the SHA-256 of a state's serialization, in hexadecimal. */
export function digestState(scene: CodedScene, phase: number): string {
  const hash = createHash("sha256");
  for (const bytes of serialize(scene, phase, true)) hash.update(bytes);
  return hash.digest("hex");
}

/** Return the CRC of a state's serialization, with or without the codes. */
export function computeStateCrc(scene: CodedScene, phase: number, includesCodes: boolean): number {
  const crc = new Crc();
  for (const bytes of serialize(scene, phase, includesCodes)) crc.add(bytes);
  return crc.value();
}

/** Serialize a state column by column, so that only one serialized column is in memory at a time. */
export function* serialize(scene: CodedScene, phase: number, includesCodes: boolean): Generator<Uint8Array> {
  yield toBytes([scene.ids.length, phase]);
  yield toBytes(scene.ids);
  for (const column of [...scene.positions, ...scene.rotations]) yield toBytes(column);
  if (!includesCodes) return;
  for (const row of scene.codes) yield toBytes(row);
}

/** Convert i32 or u32 numbers to little-endian bytes; numbers that are equal modulo 2^32 have the same bytes. */
function toBytes(numbers: ArrayLike<number>): Uint8Array {
  const bytes = new Uint8Array(4 * numbers.length);
  const view = new DataView(bytes.buffer);
  for (let i = 0; i < numbers.length; i++) view.setInt32(4 * i, numbers[i], true);
  return bytes;
}
