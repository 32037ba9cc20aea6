//! The generator of the sampler, Philox4x32-10 (Salmon et al., 2011): SPEC 6.2.

const ROUNDS: usize = 10;
const FACTORS: [u64; 2] = [0xD251_1F53, 0xCD9E_8D57];
const KEY_STEPS: [u32; 2] = [0x9E37_79B9, 0xBB67_AE85];
const WORD: u64 = 0xFFFF_FFFF;

/// The four words for a counter and a key.
#[inline]
#[must_use]
pub fn philox(counter: [u32; 4], key: [u32; 2]) -> [u32; 4] {
    // All in 64 bits, so that compilers vectorize it.
    let [mut c0, mut c1, mut c2, mut c3] = counter.map(u64::from);
    let [mut k0, mut k1] = key;
    for _ in 0..ROUNDS {
        let (p, q) = (FACTORS[0] * (c0 & WORD), FACTORS[1] * (c2 & WORD));
        (c0, c2) = ((q >> 32) ^ c1 ^ u64::from(k0), (p >> 32) ^ c3 ^ u64::from(k1));
        (c1, c3) = (q & WORD, p & WORD);
        (k0, k1) = (k0.wrapping_add(KEY_STEPS[0]), k1.wrapping_add(KEY_STEPS[1]));
    }
    [c0, c1, c2, c3].map(|word| word as u32)
}
