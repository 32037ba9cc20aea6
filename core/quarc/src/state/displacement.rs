//! Displacement and rotation of Gaussians by their anchors: SPEC 7.5.

use super::motion::STILL;
use super::{off_lattice, State};
use crate::anchors::Anchors;
use crate::coding::channels::{add, Channels, TRANSLATION_CHANNELS};
use crate::constants::{LEVEL_COUNT_LIMIT, POSITION_LIMIT};
use crate::error::Result;
use crate::parallel::{each, piece};
use crate::records::Header;
use crate::rotation::{turn_batch, Quaternion, Residuals, ROTATION_ONE};
use std::ops::Range;

const MOVED: usize = 1 << 12; // minimum number of Gaussians per task
const BLOCK: usize = 1 << 10; // Gaussians processed at a time, whose motion stays in the cache
const BATCH: usize = 64; // rotations computed together

impl State {
    /// Move and turn every Gaussian by the anchors that it follows at the given levels, at which
    /// anchors move.
    pub(super) fn displace(&mut self, symbols: &[Vec<Channels>], levels: &[usize]) -> Result<()> {
        // All entries are overwritten.
        self.motion.change(|_| (), |_, _| ());
        let motion = self.motion.make_mut();
        motion.resize(self.ids.len(), STILL);
        self.departed.clear();
        let (Some(anchors), false) = (&self.anchors, levels.is_empty()) else {
            motion.fill(STILL);
            return Ok(());
        };
        // Levels without motion contribute no symbols.
        let level = |place: usize| {
            let number = levels.get(place).copied();
            let symbols = number.map_or(&[][..], |number| &symbols[number][..]);
            (anchors.binding_by_slot(number.unwrap_or(levels[0])), symbols)
        };
        let levels = [0, 1, 2].map(level);
        let size = piece(motion.len(), MOVED);
        let mut moved = self.moved.make_mut().chunks_mut(size);
        let positions = self.positions.make_mut().first_mut::<3>();
        let mut positions = positions.map(|row| row.chunks_mut(size));
        let rotations = self.rotations.make_mut().first_mut::<4>();
        let mut rotations = rotations.map(|row| row.chunks_mut(size));
        let mut pieces = Vec::new();
        for (number, motion) in motion.chunks_mut(size).enumerate() {
            pieces.push(Moving {
                first: number * size,
                motion,
                moved: moved.next().unwrap_or_default(),
                positions: [0, 1, 2].map(|row: usize| positions[row].next().unwrap_or_default()),
                rotations: [0, 1, 2, 3].map(|row: usize| rotations[row].next().unwrap_or_default()),
            });
        }
        let header = &*self.header;
        each(pieces, &|piece| piece.displace(header, anchors, levels)).into_iter().collect()
    }
}

/// A range of the Gaussians of a state.
struct Moving<'a> {
    /// Index of the first.
    first: usize,
    motion: &'a mut [Channels],
    moved: &'a mut [bool],
    positions: [&'a mut [i32]; 3],
    rotations: [&'a mut [i32]; 4],
}

/// The anchor of each slot at a level, and the symbols of the level's anchors.
type Level<'a> = (&'a [u32], &'a [Channels]);

impl Moving<'_> {
    /// Move and turn the Gaussians by the anchors that they follow at some levels.
    fn displace(
        mut self,
        header: &Header,
        anchors: &Anchors,
        levels: [Level; LEVEL_COUNT_LIMIT],
    ) -> Result<()> {
        let mut residuals = Residuals::default();
        let mut next = 0;
        for slots in anchors.slots(self.first..self.first + self.motion.len()) {
            for first in slots.clone().step_by(BLOCK) {
                let slots = first..slots.end.min(first + BLOCK);
                let places = next..next + slots.len();
                next = places.end;
                sum_motion(&mut self.motion[places.clone()], slots, levels);
                self.move_block(header, places, &mut residuals)?;
            }
        }
        Ok(())
    }

    /// Move and turn the Gaussians at some places by their motion.
    fn move_block(
        &mut self,
        header: &Header,
        places: Range<usize>,
        residuals: &mut Residuals,
    ) -> Result<()> {
        let motion = &self.motion[places.clone()];
        for (moved, motion) in self.moved[places.clone()].iter_mut().zip(motion) {
            *moved |= motion != &STILL;
        }
        let step = i32::from(header.translation_step);
        for (axis, row) in self.positions.iter_mut().enumerate() {
            shift(&mut row[places.clone()], motion, axis, step)?;
        }
        let [w, x, y, z] = &mut self.rotations;
        let rotations = [w, x, y, z].map(|row| &mut row[places.clone()]);
        let mut turning = Turning::new(rotations);
        let (mut last, mut residual) = (STILL, [0; 4]);
        for (place, motion) in motion.iter().enumerate() {
            if motion[TRANSLATION_CHANNELS..] == STILL[TRANSLATION_CHANNELS..] {
                continue;
            }
            // Neighbors mostly follow the same anchors.
            if motion != &last {
                (last, residual) = (*motion, residuals.of(sum_of(header, motion))?);
            }
            turning.push(place, residual)?;
        }
        turning.turn()
    }
}

/// Add the motion on one axis to positions.
fn shift(positions: &mut [i32], motion: &[Channels], axis: usize, step: i32) -> Result<()> {
    let mut is_beyond = false;
    for (position, motion) in positions.iter_mut().zip(motion) {
        // A sum that overflows is also beyond the limit.
        *position = position.wrapping_add(step * i32::from(motion[axis]));
        is_beyond |= position.unsigned_abs() > POSITION_LIMIT as u32;
    }
    // [7.5-1]
    if is_beyond {
        return Err(off_lattice());
    }
    Ok(())
}

/// Turns some of the rotations `[4, n]`, in batches.
struct Turning<'a> {
    rotations: [&'a mut [i32]; 4],
    count: usize,
    places: [usize; BATCH],
    batch: [[i32; BATCH]; 4],
    residuals: [[i32; BATCH]; 4],
}

impl<'a> Turning<'a> {
    fn new(rotations: [&'a mut [i32]; 4]) -> Self {
        // Unused lanes contain unit quaternions.
        let unit = [ROTATION_ONE, 0, 0, 0].map(|part| [part; BATCH]);
        Turning { rotations, count: 0, places: [0; BATCH], batch: unit, residuals: unit }
    }

    /// Add a rotation to the batch.
    fn push(&mut self, place: usize, residual: Quaternion) -> Result<()> {
        if self.count == BATCH {
            self.turn()?;
        }
        self.places[self.count] = place;
        for (row, part) in residual.into_iter().enumerate() {
            self.batch[row][self.count] = self.rotations[row][place];
            self.residuals[row][self.count] = part;
        }
        self.count += 1;
        Ok(())
    }

    /// Turn the rotations of the batch.
    fn turn(&mut self) -> Result<()> {
        turn_batch(&mut self.batch, &self.residuals)?;
        for (row, turned) in self.rotations.iter_mut().zip(&self.batch) {
            for (&place, &part) in self.places[..self.count].iter().zip(turned) {
                row[place] = part;
            }
        }
        self.count = 0;
        Ok(())
    }
}

/// Sum the symbols of the anchors that the Gaussians of some slots follow.
fn sum_motion(motion: &mut [Channels], slots: Range<usize>, levels: [Level; LEVEL_COUNT_LIMIT]) {
    let levels = levels.map(|(binding, symbols)| (&binding[slots.clone()], symbols));
    for (place, motion) in motion.iter_mut().enumerate() {
        let mut sum = STILL;
        for (binding, symbols) in levels {
            // `NOBODY` is greater than the index of any anchor.
            sum = add(&sum, symbols.get(binding[place] as usize).unwrap_or(&STILL));
        }
        *motion = sum;
    }
}

/// The sum of the residuals of a rotation, including the identities of all levels.
fn sum_of(header: &Header, motion: &Channels) -> [i32; 4] {
    let [_, _, _, rest @ ..] = motion.map(i32::from);
    let unity = i32::from(header.rotation_unity) * i32::from(header.level_count);
    let [first, second, third, fourth, _] = rest;
    if header.rotation_components == 3 {
        [unity, first, second, third]
    } else {
        [unity + first, second, third, fourth]
    }
}
