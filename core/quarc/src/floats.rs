//! Dequantization of integer states to the floats that are rendered: SPEC 10.1.
//!
//! These are the only floats that the crate returns. Each is rounded once from the state, and the
//! next frame does not depend on them.

use crate::constants::ROTATION_FRACTION_BITS;
use crate::parallel::{each_chunk, piece};
use crate::rows::Rows;
use crate::state::State;
use std::sync::{Arc, Weak};

// First rows of the kinds of codes (SPEC 7.1).
const LOG_SCALES: usize = 0;
const OPACITY: usize = 3;
const SH: usize = 4;

/// Gaussians whose rows are written together, while they are in the cache.
const BLOCK: usize = 256;
/// Minimum number of blocks per task.
const BLOCKS: usize = 32;

/// A scene in floats, one row per Gaussian, with the unactivated attributes of 3DGS.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Splats {
    /// `[N, 3]` xyz, world units.
    pub positions: Vec<f32>,
    /// `[N, 4]` wxyz; unit length to within 2^-21.
    pub rotations: Vec<f32>,
    /// `[N, 3]` natural logarithms of the standard deviations in world units.
    pub log_scales: Vec<f32>,
    /// `[N]` logits.
    pub opacities: Vec<f32>,
    /// `[N, 1 or 4, 3]`: coefficient, then red, green, blue.
    pub sh: Vec<f32>,
}

/// Which arrays of [`Splats`] have changed since the previous state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Redone {
    /// Positions.
    pub positions: bool,
    /// Rotations.
    pub rotations: bool,
    /// Log-scales, opacities and SH.
    pub codes: bool,
}

/// Dequantizes successive states into the same arrays. Arrays that have not changed are not
/// computed again.
#[derive(Debug, Default)]
pub struct Dequantizer {
    splats: Splats,
    /// The rows from which the arrays were computed. A weak reference keeps rows from being changed
    /// in place, so that rows at the same address are equal.
    positions: Weak<Rows<i32>>,
    rotations: Weak<Rows<i32>>,
    codes: Weak<Rows<i16>>,
}

impl Dequantizer {
    /// Dequantize a state.
    pub fn dequantize(&mut self, state: &State) -> &Splats {
        self.update(state);
        &self.splats
    }

    /// The result of the last dequantization.
    #[must_use]
    pub const fn splats(&self) -> &Splats {
        &self.splats
    }

    /// Update the arrays to a state, and return which of them have changed.
    pub fn update(&mut self, state: &State) -> Redone {
        let ([positions, rotations], codes) = (state.shared_places(), state.shared_codes());
        let redone = Redone {
            positions: replace(&mut self.positions, positions),
            rotations: replace(&mut self.rotations, rotations),
            codes: replace(&mut self.codes, codes),
        };
        // [10.1-1] Integers below 2^24 and powers of 2 are exact, so each product is rounded once.
        let header = state.header();
        let splats = &mut self.splats;
        if redone.positions {
            let unit = 1.0 / (1u32 << header.lattice_exponent) as f32;
            scale(positions, 0, [unit; 3], |number| number as f32, &mut splats.positions);
        }
        if redone.rotations {
            let unit = 1.0 / (1u32 << ROTATION_FRACTION_BITS) as f32;
            scale(rotations, 0, [unit; 4], |number| number as f32, &mut splats.rotations);
        }
        if redone.codes {
            scale(codes, LOG_SCALES, [header.log_scale_step; 3], f32::from, &mut splats.log_scales);
            scale(codes, OPACITY, [header.opacity_step], f32::from, &mut splats.opacities);
            let dc = [header.sh_dc_step; 3];
            if header.sh_degree == 0 {
                scale(codes, SH, dc, f32::from, &mut splats.sh);
            } else {
                let mut steps = [header.sh_rest_step; 12];
                steps[..3].copy_from_slice(&dc);
                scale(codes, SH, steps, f32::from, &mut splats.sh);
            }
        }
        redone
    }
}

/// Remember rows, and return whether they have changed.
fn replace<T>(known: &mut Weak<T>, rows: &Arc<T>) -> bool {
    let before = std::mem::replace(known, Arc::downgrade(rows));
    !Weak::ptr_eq(&before, known)
}

/// Write planes, from plane `first` on, as columns: each number times the step of its row.
fn scale<T: Copy + Default + Sync, const WIDTH: usize>(
    planes: &Rows<T>,
    first: usize,
    steps: [f32; WIDTH],
    to_float: impl Fn(T) -> f32 + Sync,
    scaled: &mut Vec<f32>,
) {
    scaled.resize(planes.columns() * WIDTH, 0.0);
    let size = BLOCK * piece((planes.columns() + BLOCK - 1) / BLOCK, BLOCKS);
    each_chunk(scaled, size * WIDTH, &|number, columns| {
        scale_some(planes, first, number * size, steps, &to_float, columns);
    });
}

/// The same for some of the columns, from column `begin` on.
fn scale_some<T: Copy + Default, const WIDTH: usize>(
    planes: &Rows<T>,
    first: usize,
    begin: usize,
    steps: [f32; WIDTH],
    to_float: impl Fn(T) -> f32,
    scaled: &mut [f32],
) {
    let mut padded = [[T::default(); BLOCK]; WIDTH];
    for (number, columns) in scaled.chunks_mut(BLOCK * WIDTH).enumerate() {
        let mut row = first;
        let mut rows = [(); WIDTH].map(|()| {
            row += 1;
            &planes.row(row - 1)[begin + number * BLOCK..][..columns.len() / WIDTH]
        });
        // Arrays instead of slices where possible: then compilers need no checks inside the loop.
        if columns.len() < BLOCK * WIDTH {
            for (padded, row) in padded.iter_mut().zip(&mut rows) {
                padded[..row.len()].copy_from_slice(row);
                *row = padded;
            }
        }
        let rows = rows.map(|row| <&[T; BLOCK]>::try_from(row).expect("a slice of this length"));
        for (column, to) in columns.chunks_exact_mut(WIDTH).enumerate() {
            for ((to, row), step) in to.iter_mut().zip(rows).zip(steps) {
                *to = to_float(row[column % BLOCK]) * step;
            }
        }
    }
}
