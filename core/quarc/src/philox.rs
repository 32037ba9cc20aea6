//! The generator behind the sampler: Philox4x32-10 (Salmon and others, 2011), SPEC 6.2.

const ROUNDS: usize = 10;
const FIRST_FACTOR: u64 = 0xD251_1F53;
const SECOND_FACTOR: u64 = 0xCD9E_8D57;
const KEY_STEPS: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];

/// The four words drawn from a counter and a key.
#[must_use]
pub fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    let [mut c0, mut c1, mut c2, mut c3] = counter;
    let [mut k0, mut k1] = key;
    for _ in 0..ROUNDS {
        let p = FIRST_FACTOR * u64::from(c0);
        let q = SECOND_FACTOR * u64::from(c2);
        (c0, c2) = ((q >> 32) as u32 ^ c1 ^ k0, (p >> 32) as u32 ^ c3 ^ k1);
        (c1, c3) = (q as u32, p as u32);
        (k0, k1) = (k0.wrapping_add(KEY_STEPS[0]), k1.wrapping_add(KEY_STEPS[1]));
    }
    [c0, c1, c2, c3]
}
