//! The operators of the text: SPEC 4. Every rounding and every root of the format is here.

/// The integer nearest to n / d, of two equally near the one farther from 0 (SPEC 4.2).
///
/// `d` is above 0; both are below 2^62 in magnitude.
#[must_use]
pub const fn divide_round(n: i64, d: i64) -> i64 {
    let divisor = d as u64;
    with_sign_of(n, ((2 * n.unsigned_abs() + divisor) / (2 * divisor)) as i64)
}

/// Divide by 2^`bits`, rounded as [`divide_round`] does.
#[must_use]
pub const fn shift_round(n: i64, bits: u32) -> i64 {
    // Rounded up at a half, but down, away from 0, where n is negative.
    (n + (1 << (bits - 1)) + (n >> (i64::BITS - 1))) >> bits
}

/// A magnitude, negative if `n` is; without a branch, as nobody can guess signs.
const fn with_sign_of(n: i64, magnitude: i64) -> i64 {
    let sign = n >> (i64::BITS - 1);
    (magnitude ^ sign) - sign
}

/// Rounded division of several numbers by one.
#[derive(Clone, Copy, Debug)]
pub struct Divisor {
    divisor: i64,
    share: f64,
}

impl Divisor {
    /// Divide by this, above 0 and below 2^31.
    #[must_use]
    pub fn new(divisor: i64) -> Self {
        Divisor { divisor, share: 1.0 / divisor as f64 }
    }

    /// As [`divide_round`], where the quotient is below 2^24 in magnitude.
    #[must_use]
    pub fn divide_round(&self, n: i64) -> i64 {
        // The quotient in floating point, cut off, is the rounded one or 1 less: the relative
        // error is below 2^-51. The integers decide.
        let magnitude = n.unsigned_abs() as i64;
        let guess = (magnitude as f64 * self.share) as i64;
        let left = 2 * (magnitude - guess * self.divisor) + self.divisor;
        with_sign_of(n, guess + i64::from(left >= 2 * self.divisor))
    }
}

/// The largest integer whose square is at most `v`, from 0 to 2^62 (SPEC 4.3).
#[must_use]
pub fn isqrt(v: i64) -> i64 {
    // The root in floating point is a guess, at most 1 off; the integers decide.
    let guess = (v as f64).sqrt() as i64;
    let root = guess - i64::from(guess * guess > v);
    root + i64::from((root + 1) * (root + 1) <= v)
}

/// The least b with v < 2^b (SPEC 4.4).
#[must_use]
pub const fn bit_length(v: u64) -> u32 {
    u64::BITS - v.leading_zeros()
}
