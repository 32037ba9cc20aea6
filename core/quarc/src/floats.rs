//! From the integers of a state to the numbers that are drawn: SPEC 10.1.
//!
//! The only floats of the crate that leave it, one rounding from the state; nothing of them
//! feeds the next frame.

use crate::constants::ROTATION_FRACTION_BITS;
use crate::rows::Rows;
use crate::state::State;
use std::ops::Range;
use std::sync::{Arc, Weak};

const LOG_SCALES: Range<usize> = 0..3;
const OPACITY: Range<usize> = 3..4;
const SH_DC_END: usize = 7;

/// Gaussians whose rows are written at once: they stay in the cache meanwhile.
const BLOCK: usize = 256;

/// A scene in floats, a row to a Gaussian, as 3DGS stores it: not activated.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Splats {
    /// `[N, 3]` xyz, world units.
    pub positions: Vec<f32>,
    /// `[N, 4]` wxyz; unit to within 2^-21.
    pub rotations: Vec<f32>,
    /// `[N, 3]` natural logarithms of the standard deviations, world units.
    pub log_scales: Vec<f32>,
    /// `[N]` logits.
    pub opacities: Vec<f32>,
    /// `[N, 1 or 4, 3]` coefficient, then red, green, blue.
    pub sh: Vec<f32>,
}

/// Which arrays of [`Splats`] are others than those of the state before.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Redone {
    /// Positions.
    pub positions: bool,
    /// Rotations.
    pub rotations: bool,
    /// Log-scales, opacities and SH.
    pub codes: bool,
}

/// Makes floats of one state after the other, in the same arrays; what has not changed since the
/// state before stays as it is.
#[derive(Debug, Default)]
pub struct Dequantizer {
    splats: Splats,
    /// What the arrays were made of. Rows that somebody points to, if only so, are not written
    /// to in place: those of equal address are equal.
    positions: Weak<Rows<i32>>,
    rotations: Weak<Rows<i32>>,
    codes: Weak<Rows<i16>>,
}

impl Dequantizer {
    /// The numbers that a state stands for.
    pub fn dequantize(&mut self, state: &State) -> &Splats {
        self.update(state);
        &self.splats
    }

    /// The numbers of the state that was dequantized last.
    #[must_use]
    pub const fn splats(&self) -> &Splats {
        &self.splats
    }

    /// Make the arrays those of a state, and tell which of them have changed.
    pub fn update(&mut self, state: &State) -> Redone {
        let ([positions, rotations], codes) = (state.shared_places(), state.shared_codes());
        let redone = Redone {
            positions: replace(&mut self.positions, positions),
            rotations: replace(&mut self.rotations, rotations),
            codes: replace(&mut self.codes, codes),
        };
        // [10.1-1] Integers below 2^24 and powers of 2 are exact: a product is rounded once.
        let header = state.header();
        let splats = &mut self.splats;
        if redone.positions {
            let unit = 1.0 / (1u32 << header.lattice_exponent) as f32;
            scale(positions, 0..3, |_| unit, |number| number as f32, &mut splats.positions);
        }
        if redone.rotations {
            let unit = 1.0 / (1u32 << ROTATION_FRACTION_BITS) as f32;
            scale(rotations, 0..4, |_| unit, |number| number as f32, &mut splats.rotations);
        }
        if redone.codes {
            let sh_step =
                |row| if row < SH_DC_END { header.sh_dc_step } else { header.sh_rest_step };
            let sh = OPACITY.end..codes.rows();
            scale(codes, LOG_SCALES, |_| header.log_scale_step, f32::from, &mut splats.log_scales);
            scale(codes, OPACITY, |_| header.opacity_step, f32::from, &mut splats.opacities);
            scale(codes, sh, sh_step, f32::from, &mut splats.sh);
        }
        redone
    }
}

/// Take note of rows; whether they are others than before.
fn replace<T>(known: &mut Weak<T>, rows: &Arc<T>) -> bool {
    let before = std::mem::replace(known, Arc::downgrade(rows));
    !Weak::ptr_eq(&before, known)
}

/// Write some planes as columns, each number times the step of its row.
fn scale<T: Copy + Default>(
    planes: &Rows<T>,
    rows: Range<usize>,
    step_of: impl Fn(usize) -> f32,
    to_float: impl Fn(T) -> f32,
    scaled: &mut Vec<f32>,
) {
    let width = rows.len();
    scaled.resize(planes.columns() * width, 0.0);
    for (number, block) in scaled.chunks_mut(BLOCK * width).enumerate() {
        for (place, row) in rows.clone().enumerate() {
            let (step, plane) = (step_of(row), &planes.row(row)[number * BLOCK..]);
            for (columns, &number) in block.chunks_exact_mut(width).zip(plane) {
                columns[place] = to_float(number) * step;
            }
        }
    }
}
