//! Morton keys: the order of canonical Gaussians (SPEC 8.5), and the cells of the sampler (6.3).
//!
//! Bit b of x, y and z is bit 3b + 2, 3b + 1 and 3b of the key, so that the points in a cell of
//! side 2^s have adjacent keys.

/// The Morton key of a point whose coordinates are below 2^21.
#[must_use]
pub const fn interleave(x: u32, y: u32, z: u32) -> u64 {
    spread(x) << 2 | spread(y) << 1 | spread(z)
}

/// The point of a Morton key below 2^63.
#[must_use]
pub const fn deinterleave(key: u64) -> [u32; 3] {
    [gather(key >> 2), gather(key >> 1), gather(key)]
}

// Every step splits all groups of bits in half and moves the halves apart.
const MASKS: [u64; 6] = [
    0x001F_FFFF,
    0x001F_0000_0000_FFFF,
    0x001F_0000_FF00_00FF,
    0x100F_00F0_0F00_F00F,
    0x10C3_0C30_C30C_30C3,
    0x1249_2492_4924_9249,
];

const fn spread(number: u32) -> u64 {
    let v = number as u64 & MASKS[0];
    let v = (v | v << 32) & MASKS[1];
    let v = (v | v << 16) & MASKS[2];
    let v = (v | v << 8) & MASKS[3];
    let v = (v | v << 4) & MASKS[4];
    (v | v << 2) & MASKS[5]
}

const fn gather(key: u64) -> u32 {
    let v = key & MASKS[5];
    let v = (v | v >> 2) & MASKS[4];
    let v = (v | v >> 4) & MASKS[3];
    let v = (v | v >> 8) & MASKS[2];
    let v = (v | v >> 16) & MASKS[1];
    ((v | v >> 32) & MASKS[0]) as u32
}
