/** Modifies streams, for the tests of rejection and recovery. */

import { crc32 } from "../src/crc.js";

const MAGIC_BYTES = 8;
const HEADER_BYTES = 20;
const LEVEL_OFFSET = 10;

/** Return the offsets of all chunks. */
export function findChunkOffsets(bytes: Uint8Array): number[] {
  const offsets = [];
  const view = new DataView(bytes.buffer);
  for (let offset = MAGIC_BYTES; offset < bytes.length; offset += HEADER_BYTES + view.getUint32(offset + 12, true) + 4)
    offsets.push(offset);
  return offsets;
}

/** Change a payload byte of the chunk at `offset` (XOR with `mask`), and correct the payload CRC. */
export function changePayload(bytes: Uint8Array, offset: number, byteIndex: number, mask: number): Uint8Array {
  const changedBytes = bytes.slice();
  const view = new DataView(changedBytes.buffer);
  const start = offset + HEADER_BYTES;
  const end = start + view.getUint32(offset + 12, true);
  changedBytes[start + byteIndex] ^= mask;
  view.setUint32(end, crc32(changedBytes.subarray(start, end)), true);
  return changedBytes;
}

/** Set the conformance level of a stream to 10, whose small limits keep the tests short. */
export function setLowestLevel(bytes: Uint8Array): Uint8Array {
  return changePayload(bytes, MAGIC_BYTES, LEVEL_OFFSET, bytes[MAGIC_BYTES + HEADER_BYTES + LEVEL_OFFSET] ^ 10);
}

/** Change the byte at an offset (XOR with `mask`). */
export function changeByte(bytes: Uint8Array, byteIndex: number, mask = 1): Uint8Array {
  const changedBytes = bytes.slice();
  changedBytes[byteIndex] ^= mask;
  return changedBytes;
}

/** Change the type of the chunk at `offset`, and correct the CRC of its header. */
export function changeType(bytes: Uint8Array, offset: number, type: string): Uint8Array {
  const changedBytes = bytes.slice();
  changedBytes.set(Buffer.from(type), offset + 4);
  updateHeaderCrc(changedBytes, offset);
  return changedBytes;
}

/** Make a chunk header with a correct CRC. */
export function makeChunkHeader(type: string, sequence: number, length: number): Uint8Array {
  const bytes = Uint8Array.of(0x9e, 0x51, 0x43, 0xf3, ...Buffer.from(type), ...new Uint8Array(12));
  const view = new DataView(bytes.buffer);
  view.setUint32(8, sequence, true);
  view.setUint32(12, length, true);
  updateHeaderCrc(bytes, 0);
  return bytes;
}

/** Make a chunk with correct CRCs. */
export function makeChunk(type: string, sequence: number, payload: Uint8Array): Uint8Array {
  const crc = Buffer.alloc(4);
  crc.writeUInt32LE(crc32(payload));
  return Buffer.concat([makeChunkHeader(type, sequence, payload.length), payload, crc]);
}

function updateHeaderCrc(bytes: Uint8Array, offset: number): void {
  const crc = crc32(bytes.subarray(offset, offset + HEADER_BYTES - 4));
  new DataView(bytes.buffer).setUint32(offset + HEADER_BYTES - 4, crc, true);
}
