/** Modifications of streams, for the tests of rejection and recovery. */

import { crc32 } from "../src/crc.js";

const MAGIC_BYTES = 8;
const HEADER_BYTES = 20;
const LEVEL_PLACE = 10;

/** The offsets of the chunks. */
export function chunkOffsets(bytes: Uint8Array): number[] {
  const offsets = [];
  const view = new DataView(bytes.buffer);
  for (let at = MAGIC_BYTES; at < bytes.length; at += HEADER_BYTES + view.getUint32(at + 12, true) + 4)
    offsets.push(at);
  return offsets;
}

/** Change the payload byte at `place` of the chunk at `offset`, and correct the CRC. */
export function changePayload(bytes: Uint8Array, offset: number, place: number, mask: number): Uint8Array {
  const changed = bytes.slice();
  const view = new DataView(changed.buffer);
  const start = offset + HEADER_BYTES;
  const end = start + view.getUint32(offset + 12, true);
  changed[start + place] ^= mask;
  view.setUint32(end, crc32(changed.subarray(start, end)), true);
  return changed;
}

/** Set the stream to level 10, whose limits keep the tests short. */
export function atLowestLevel(bytes: Uint8Array): Uint8Array {
  return changePayload(bytes, MAGIC_BYTES, LEVEL_PLACE, bytes[MAGIC_BYTES + HEADER_BYTES + LEVEL_PLACE] ^ 10);
}

/** Change the byte at `place`. */
export function changeByte(bytes: Uint8Array, place: number, mask = 1): Uint8Array {
  const changed = bytes.slice();
  changed[place] ^= mask;
  return changed;
}

/** Change the type of the chunk at `offset`, and correct the CRC of its header. */
export function changeType(bytes: Uint8Array, offset: number, type: string): Uint8Array {
  const changed = bytes.slice();
  changed.set(Buffer.from(type), offset + 4);
  proveHeader(changed, offset);
  return changed;
}

/** A chunk header with a correct CRC. */
export function chunkHeader(type: string, sequence: number, length: number): Uint8Array {
  const bytes = Uint8Array.of(0x9e, 0x51, 0x43, 0xf3, ...Buffer.from(type), ...new Uint8Array(12));
  const view = new DataView(bytes.buffer);
  view.setUint32(8, sequence, true);
  view.setUint32(12, length, true);
  proveHeader(bytes, 0);
  return bytes;
}

/** A chunk with correct CRCs. */
export function chunk(type: string, sequence: number, payload: Uint8Array): Uint8Array {
  const crc = Buffer.alloc(4);
  crc.writeUInt32LE(crc32(payload));
  return Buffer.concat([chunkHeader(type, sequence, payload.length), payload, crc]);
}

function proveHeader(bytes: Uint8Array, offset: number): void {
  const crc = crc32(bytes.subarray(offset, offset + HEADER_BYTES - 4));
  new DataView(bytes.buffer).setUint32(offset + HEADER_BYTES - 4, crc, true);
}
