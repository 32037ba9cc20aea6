//! The operators of the text: SPEC 4. Every rounding and every root of the format is here.

/// The integer nearest to n / d, of two equally near the one farther from 0 (SPEC 4.2).
///
/// `d` is above 0; both are below 2^62 in magnitude.
#[must_use]
pub const fn divide_round(n: i64, d: i64) -> i64 {
    let divisor = d as u64;
    let magnitude = ((2 * n.unsigned_abs() + divisor) / (2 * divisor)) as i64;
    if n < 0 {
        -magnitude
    } else {
        magnitude
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
