//! The probability codes that a plane may state: SPEC 8.2.

use crate::error::{Error, Reject, Result};

/// A weight w of a 1 bit is the probability w / 2^`WEIGHT_BITS`.
pub const WEIGHT_BITS: u32 = 24;
/// Bits of a probability code.
pub const CODE_BITS: usize = 8;
/// The weight of probability 1/2.
pub const EVEN_WEIGHT: u32 = 1 << (WEIGHT_BITS - 1);
/// The weight of the bit that signals a stated code.
pub const STATED_WEIGHT: u32 = 1 << 18;

const WEIGHT_TOTAL: u32 = 1 << WEIGHT_BITS;
const CODES: usize = 240;
const HALF: usize = CODES / 2;
const WEIGHTS: [u32; CODES] = make_weights();

const fn make_weights() -> [u32; CODES] {
    let mut weights = [0; CODES];
    let mut code = 0;
    while code < HALF {
        let (octave, step) = (code / 8, code % 8);
        weights[code] = (8 + step as u32) << (octave + 5);
        weights[code + HALF] = WEIGHT_TOTAL - weights[code];
        code += 1;
    }
    weights
}

/// The weight of a probability code.
///
/// # Errors
/// `bad-probability`: the code is undefined.
pub fn weight_of_code(code: u8) -> Result<u32> {
    // [8.2-1]
    WEIGHTS.get(usize::from(code)).copied().ok_or_else(|| {
        Error::new(Reject::BadProbability, format!("probability code {code} is undefined"))
    })
}

/// The code nearest to the probability `ones` / `count`, and its weight; `count` is at least 1.
#[must_use]
pub fn choose_code(ones: u64, count: u64) -> (u8, u32) {
    let share = (ones << WEIGHT_BITS) / count;
    let (mut low, mut high) = (0, CODES - 1);
    while low < high {
        let middle = (low + high) / 2;
        let between = WEIGHTS[ascending(middle)] + WEIGHTS[ascending(middle + 1)];
        if share < u64::from((between + 1) / 2) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    (ascending(low) as u8, WEIGHTS[ascending(low)])
}

/// The code of a rank in ascending order of weight; codes of the upper half descend.
const fn ascending(rank: usize) -> usize {
    if rank < HALF {
        rank
    } else {
        CODES + HALF - 1 - rank
    }
}

/// Whether stating the weight `fitting` saves more bits than it costs.
///
/// Only encoders decide this, so floats are safe here.
#[must_use]
pub fn is_worth_stating(zeros: u64, ones: u64, known: u32, fitting: u32) -> bool {
    let cost = CODE_BITS as f64 + (f64::from(WEIGHT_TOTAL) / f64::from(STATED_WEIGHT)).log2();
    let of_ones = (f64::from(fitting) / f64::from(known)).log2();
    let of_zeros = (f64::from(WEIGHT_TOTAL - fitting) / f64::from(WEIGHT_TOTAL - known)).log2();
    ones as f64 * of_ones + zeros as f64 * of_zeros > cost
}
