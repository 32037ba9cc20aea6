//! Deterministic numbers.

/// A xorshift generator.
pub struct Numbers(u64);

impl Numbers {
    /// The same numbers every time.
    pub fn new() -> Self {
        Numbers(0x9E37_79B9_7F4A_7C15)
    }

    /// The next number, from 0 to `bound` - 1.
    pub fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % bound as u64) as usize
    }
}
