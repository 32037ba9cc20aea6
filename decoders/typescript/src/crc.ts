/** CRC-32/ISO-HDLC (SPEC 4.5), with a table for eight bits at a time. */

const TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit++) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  return crc;
});

/** An incremental CRC. */
export class Crc {
  #crc = 0xffffffff;

  add(bytes: Uint8Array): void {
    let crc = this.#crc;
    for (let i = 0; i < bytes.length; i++) crc = (crc >>> 8) ^ TABLE[(crc ^ bytes[i]) & 0xff];
    this.#crc = crc;
  }

  /** The CRC of all bytes so far, as a u32. */
  value(): number {
    return (this.#crc ^ 0xffffffff) >>> 0;
  }
}

/** The CRC of `bytes`. */
export function crc32(bytes: Uint8Array): number {
  const crc = new Crc();
  crc.add(bytes);
  return crc.value();
}
