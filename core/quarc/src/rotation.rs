//! Unit quaternions w, x, y, z with 22 fraction bits, in integer arithmetic: SPEC 7.2, 7.3, 7.5.

use crate::arithmetic::{isqrt, Divisor};
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
pub fn turn(rotation: Quaternion, residual: Quaternion) -> Result<Quaternion> {
    let mut rotations = rotation.map(|part| [part]);
    turn_batch(&mut rotations, &residual.map(|part| [part]))?;
    Ok(rotations.map(|[part]| part))
}

/// Turn rotations `[4, N]`, each by its own residual, as [`turn`] does.
///
/// The integers fit into `f64`, which processors compute several at a time: the components of unit
/// quaternions are at most 2^22, so that sums of their products are exact.
///
/// # Errors
/// Those of [`turn`].
pub fn turn_batch<const N: usize>(
    rotations: &mut [[i32; N]; 4],
    residuals: &[[i32; N]; 4],
) -> Result<()> {
    // A little more than 2^-22, so that halves are rounded away from 0.
    const UNIT: f64 = (1.0 + 4.0 * f64::EPSILON) / ROTATION_ONE as f64;
    let mut products = [[0.0; N]; 4];
    for lane in 0..N {
        let [qw, qx, qy, qz] = [0, 1, 2, 3].map(|row: usize| f64::from(rotations[row][lane]));
        let [dw, dx, dy, dz] = [0, 1, 2, 3].map(|row: usize| f64::from(residuals[row][lane]));
        products[0][lane] = round((qw * dw - qx * dx - qy * dy - qz * dz) * UNIT);
        products[1][lane] = round((qw * dx + qx * dw + qy * dz - qz * dy) * UNIT);
        products[2][lane] = round((qw * dy - qx * dz + qy * dw + qz * dx) * UNIT);
        products[3][lane] = round((qw * dz + qx * dy - qy * dx + qz * dw) * UNIT);
    }
    normalize_products(&products, rotations)
}

/// Added to a number below 2^51 in magnitude, it leaves no fraction bits: the sum is rounded to the
/// nearest integer, whose low bits are those of the sum. Conversions with `as` are much slower.
const NO_FRACTION: f64 = 1.5 * (1u64 << 52) as f64;

/// The integer nearest to a number that is not halfway between two.
#[inline(always)]
fn round(number: f64) -> f64 {
    (number + NO_FRACTION) - NO_FRACTION
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
    let mut normalized = [[0]; 4];
    normalize_products(&vector.map(|part| [f64::from(part)]), &mut normalized)?;
    Ok(normalized.map(|[part]| part))
}

/// SPEC 7.3 with `PRODUCT_GUARD_BITS`, of integers `[4, N]` below 2^31 in magnitude; without a root
/// or a division if all vectors are nearly unit quaternions, like all products of a decoder.
fn normalize_products<const N: usize>(
    vectors: &[[f64; N]; 4],
    normalized: &mut [[i32; N]; 4],
) -> Result<()> {
    const ONE: f64 = (1u64 << (2 * ROTATION_FRACTION_BITS)) as f64;
    const NORM: f64 = (1u64 << (ROTATION_FRACTION_BITS + PRODUCT_GUARD_BITS)) as f64;
    const TWO_15: f64 = (1 << 15) as f64;
    const TWO_16: f64 = (1 << 16) as f64;
    const NEAR: f64 = (1 << 26) as f64;
    let mut excess = [0.0; N];
    for (lane, excess) in excess.iter_mut().enumerate() {
        let [w, x, y, z] = [0, 1, 2, 3].map(|row: usize| vectors[row][lane]);
        *excess = w * w + x * x + y * y + z * z - ONE;
    }
    if excess.iter().any(|excess| excess.abs() >= NEAR) {
        for lane in 0..N {
            let vector = [0, 1, 2, 3].map(|row: usize| vectors[row][lane] as i32);
            for (row, part) in normalized.iter_mut().zip(normalize(vector, PRODUCT_GUARD_BITS)?) {
                row[lane] = part;
            }
        }
        return Ok(());
    }
    for (lane, excess) in excess.into_iter().enumerate() {
        // The norm is 2^30 + e with the greatest e for which 2^60 + 2^31 e + e^2 is at most
        // 2^60 + 2^16 excess. Without e^2, which is below 2^22, e is excess / 2^15 rounded down;
        // with it, it may be 1 less.
        let most = round(excess * (1.0 / TWO_15) - 0.5 + 0.5 / TWO_15);
        let is_less = most * most > (excess - TWO_15 * most) * TWO_16;
        let e = most - if is_less { 1.0 } else { 0.0 };
        // part x 2^30 / norm, rounded, is part + floor((norm - 2 part e - [part < 0]) / (2 norm)).
        // The half added to the integer in parentheses keeps the quotient 2^-33 away from
        // integers, which is more than its error: the relative one of the reciprocal is at most
        // 2^-38, and the quotient is below 2^4.
        let reciprocal = 0.5 / NORM - (0.5 / NORM / NORM) * e;
        for (row, vector) in normalized.iter_mut().zip(vectors) {
            let part = vector[lane];
            let quotient = (NORM + e + 0.5_f64.copysign(part) - 2.0 * e * part) * reciprocal;
            let change = quotient - 0.5 + NO_FRACTION; // rounded down
            row[lane] = (change + part).to_bits() as i32;
        }
    }
    Ok(())
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
