//! Unit quaternions w, x, y, z with 22 fraction bits, in integer arithmetic: SPEC 7.2, 7.3, 7.5.

use crate::arithmetic::{isqrt, shift_round, Divisor};
use crate::constants::ROTATION_FRACTION_BITS;
use crate::error::{Error, Reject, Result};

/// w, x, y, z with `ROTATION_FRACTION_BITS` fraction bits.
pub type Quaternion = [i32; 4];

/// 1.0 in a quaternion.
pub const ROTATION_ONE: i32 = 1 << ROTATION_FRACTION_BITS;

const SUM_GUARD_BITS: u32 = 20;
const PRODUCT_GUARD_BITS: u32 = 8;

/// Normalize a sum of residuals, with components below 2^10 in magnitude (SPEC 7.5).
///
/// # Errors
/// `degenerate-rotation`: all components are 0.
pub fn normalize_sum(sum: [i32; 4]) -> Result<Quaternion> {
    normalize(sum, SUM_GUARD_BITS)
}

/// Multiply a rotation by a residual on the right; both are unit quaternions (SPEC 7.5).
///
/// # Errors
/// `degenerate-rotation`: the product is 0.
#[inline]
pub fn turn(rotation: Quaternion, residual: Quaternion) -> Result<Quaternion> {
    let [qw, qx, qy, qz] = rotation.map(i64::from);
    let [dw, dx, dy, dz] = residual.map(i64::from);
    let product = [
        qw * dw - qx * dx - qy * dy - qz * dz,
        qw * dx + qx * dw + qy * dz - qz * dy,
        qw * dy - qx * dz + qy * dw + qz * dx,
        qw * dz + qx * dy - qy * dx + qz * dw,
    ];
    let rounded = product.map(|part| shift_round(part, ROTATION_FRACTION_BITS) as i32);
    normalize_product(rounded)
}

/// The unit quaternion of a coded rotation: the index of the omitted component, and the other three
/// in units of 2^-`rotation_bits` (SPEC 7.2).
///
/// # Errors
/// `rotation-range`: the three components are longer than a unit quaternion.
pub fn expand(coded: [i32; 4], rotation_bits: u8) -> Result<Quaternion> {
    let most = 1 << rotation_bits;
    let [left_out, others @ ..] = coded;
    let long = || Error::new(Reject::RotationRange, "a rotation is longer than a unit quaternion");
    // [7.2-5]
    if others.iter().any(|&other| other.unsigned_abs() > most) {
        return Err(long());
    }
    let unit = ROTATION_ONE >> rotation_bits;
    let others = others.map(|other| other * unit);
    let squares: i64 = others.iter().map(|&other| i64::from(other) * i64::from(other)).sum();
    let left = (1i64 << (2 * ROTATION_FRACTION_BITS)) - squares;
    // [7.2-6]
    if left < 0 {
        return Err(long());
    }
    let [a, b, c] = others;
    let largest = isqrt(left) as i32;
    let vector = match left_out {
        0 => [largest, a, b, c],
        1 => [a, largest, b, c],
        2 => [a, b, largest, c],
        _ => [a, b, c, largest],
    };
    normalize_product(vector)
}

/// SPEC 7.3 with `PRODUCT_GUARD_BITS`, for a vector that is nearly a unit quaternion, which is
/// always the case in a decoder. This needs neither a root nor a division.
#[inline(always)] // most of the arithmetic of a frame
fn normalize_product(vector: Quaternion) -> Result<Quaternion> {
    const UNIT_BITS: u32 = ROTATION_FRACTION_BITS + PRODUCT_GUARD_BITS;
    let parts = vector.map(i64::from);
    let squares: i64 = parts.iter().map(|part| part * part).sum();
    let more = squares - (1 << (2 * ROTATION_FRACTION_BITS));
    if more.abs() >= 1 << 26 {
        return normalize(vector, PRODUCT_GUARD_BITS);
    }
    // The norm is 2^30 + e, where e is the largest with 2^60 + 2^31 e + e^2 <= 2^60 + 2^16 more.
    // Without e^2, which is below 2^22, e is more / 2^15 rounded down, or 1 less if e^2 does not
    // fit.
    let most = more >> 15;
    let e = most - i64::from(most * most > (more - (most << 15)) << 16);
    let doubled = 2 * ((1 << UNIT_BITS) + e);
    Ok(parts.map(|part| {
        // part x 2^30 / norm is part - part e / norm, where the rounded second term is small.
        // Estimate it with 2^31 in place of 2 norm, then correct the estimate by 1.
        let rest = doubled / 2 - 2 * part * e + (part >> (i64::BITS - 1));
        let guess = rest >> (UNIT_BITS + 1);
        let left = rest - guess * doubled;
        (part + guess + i64::from(left >= doubled) - i64::from(left < 0)) as i32
    }))
}

/// SPEC 7.3. The sum of squares is below 2^(62 - 2 `guard_bits`).
fn normalize(vector: [i32; 4], guard_bits: u32) -> Result<Quaternion> {
    let squares: i64 = vector.iter().map(|&part| i64::from(part) * i64::from(part)).sum();
    // [7.3-1]
    if squares == 0 {
        return Err(Error::new(Reject::DegenerateRotation, "a rotation has norm zero"));
    }
    let norm = Divisor::new(isqrt(squares << (2 * guard_bits)));
    let shift = ROTATION_FRACTION_BITS + guard_bits;
    Ok(vector.map(|part| norm.divide_round(i64::from(part) << shift) as i32))
}

/// A cache of the unit quaternions of sums of residuals: a frame has few different sums.
#[derive(Clone, Debug)]
pub struct Residuals {
    slots: Vec<([i32; 4], Quaternion)>,
}

const SLOT_BITS: u32 = 12;

impl Default for Residuals {
    fn default() -> Self {
        // A sum of 0 has no quaternion and is never stored: it marks an empty entry.
        Residuals { slots: vec![([0; 4], [0; 4]); 1 << SLOT_BITS] }
    }
}

impl Residuals {
    /// Like [`normalize_sum`], cached.
    ///
    /// # Errors
    /// Those of [`normalize_sum`].
    pub fn of(&mut self, sum: [i32; 4]) -> Result<Quaternion> {
        let slot = &mut self.slots[Self::place(sum)];
        if slot.0 != sum || sum == [0; 4] {
            *slot = (sum, normalize_sum(sum)?);
        }
        Ok(slot.1)
    }

    /// The entry of a sum: its four parts of 16 bits form a number, which is hashed.
    fn place(sum: [i32; 4]) -> usize {
        let [w, x, y, z] = sum.map(|part| u64::from(part as u16));
        let number = w << 48 | x << 32 | y << 16 | z;
        (number.wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (u64::BITS - SLOT_BITS)) as usize
    }
}
