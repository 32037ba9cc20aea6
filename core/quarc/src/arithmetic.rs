//! Integer arithmetic: SPEC 4. All rounding and all roots of the format are in this module.

/// Divide n by d and round to the nearest integer, halves away from 0 (SPEC 4.2).
///
/// `d` must be positive, and both must be below 2^62 in magnitude.
#[must_use]
pub const fn divide_round(n: i64, d: i64) -> i64 {
    let divisor = d as u64;
    with_sign_of(n, ((2 * n.unsigned_abs() + divisor) / (2 * divisor)) as i64)
}

/// Negate `magnitude` if `n` is negative. Branch-free, because signs are unpredictable.
const fn with_sign_of(n: i64, magnitude: i64) -> i64 {
    let sign = n >> (i64::BITS - 1);
    (magnitude ^ sign) - sign
}

/// Rounded division of many numbers by the same divisor.
#[derive(Clone, Copy, Debug)]
pub struct Divisor {
    divisor: i64,
    share: f64,
}

impl Divisor {
    /// Prepare division by `divisor`, which is positive and below 2^31.
    #[must_use]
    pub fn new(divisor: i64) -> Self {
        Divisor { divisor, share: 1.0 / divisor as f64 }
    }

    /// Divide like [`divide_round`]; the quotient must be below 2^24 in magnitude.
    #[must_use]
    pub fn divide_round(&self, n: i64) -> i64 {
        // The floating-point quotient, truncated, is the rounded quotient or 1 less, because its
        // relative error is below 2^-51. The integer comparison decides which.
        let magnitude = n.unsigned_abs() as i64;
        let guess = (magnitude as f64 * self.share) as i64;
        let left = 2 * (magnitude - guess * self.divisor) + self.divisor;
        with_sign_of(n, guess + i64::from(left >= 2 * self.divisor))
    }
}

/// Return the largest integer whose square is at most `v`, for `v` from 0 to 2^62 (SPEC 4.3).
#[must_use]
pub fn isqrt(v: i64) -> i64 {
    // The floating-point root is off by at most 1; the integer comparisons correct it.
    let guess = (v as f64).sqrt() as i64;
    let root = guess - i64::from(guess * guess > v);
    root + i64::from((root + 1) * (root + 1) <= v)
}

/// Return the least b with v < 2^b (SPEC 4.4).
#[must_use]
pub const fn bit_length(v: u64) -> u32 {
    u64::BITS - v.leading_zeros()
}
