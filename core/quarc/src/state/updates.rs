//! Updates of single Gaussians: SPEC 7.8.

use super::{narrow_code, narrow_position, State};
use crate::coding::updates::{
    read_updates, require_shape, write_updates, UpdateContext, CODES, ROTATION, TRANSLATION,
    TURN_LIMIT,
};
use crate::constants::RECENCY_LIMIT;
use crate::error::{Error, Reject, Result};
use crate::records::{Section, Updates};
use crate::rotation::{normalize_sum, turn};
use std::sync::Arc;

impl State {
    /// The data of the Gaussians on which the contexts of updates depend (SPEC 8.8); after `move_by`.
    fn update_context(&self) -> Result<UpdateContext<'_>> {
        if !self.header.updates {
            return Err(Error::Encode("the stream has no updates".into()));
        }
        self.require_moved()?;
        Ok(UpdateContext { motion: &self.motion, recency: &self.recency })
    }

    /// Encode the updates of this frame; after `move_by`, in a stream with updates.
    ///
    /// # Errors
    /// `Encode`: a residual is out of range.
    pub fn write_updates(&self, updates: &Updates) -> Result<Section> {
        write_updates(self.update_context()?, updates, &self.update_counts)
    }

    /// Decode the updates of this frame; after `move_by`, in a stream with updates.
    ///
    /// # Errors
    /// The section is invalid.
    pub fn read_updates(&mut self, section: &Section) -> Result<Updates> {
        let mut counts = (*self.update_counts).clone();
        let updates = read_updates(section, self.update_context()?, &mut counts)?;
        self.update_counts = Arc::new(counts);
        Ok(updates)
    }

    /// Apply updates of single Gaussians (SPEC 7.8); after `move_by`, in a stream with updates.
    ///
    /// # Errors
    /// `count`, no Gaussian would be left; `position-range`, `code-range`, `symbol-range`.
    pub fn update(&mut self, updates: &Updates) -> Result<()> {
        self.update_context()?;
        require_shape(updates, self.count())?;
        let dying = updates.gaussians.iter().zip(&updates.dies).filter(|(_, &dies)| dies);
        let gone: Vec<u32> = dying.map(|(&gaussian, _)| gaussian).collect();
        // [7.8-1]
        if gone.len() == self.count() {
            return Err(Error::new(
                Reject::Count,
                format!("the updates delete all {} Gaussians", gone.len()),
            ));
        }
        let recency = self.recency.make_mut();
        recency.iter_mut().for_each(|recency| *recency = (*recency + 1).min(RECENCY_LIMIT));
        for &gaussian in &updates.gaussians {
            recency[gaussian as usize] = 0;
        }
        let stays = |place: &usize| !updates.dies[*place];
        let staying: Vec<usize> = (0..updates.gaussians.len()).filter(stays).collect();
        self.shift_some(updates, &staying)?;
        self.turn_some(updates, &staying)?;
        self.recode_some(updates, &staying)?;
        self.remove(&gone, false);
        Ok(())
    }

    /// Apply the residuals of translation of the updates at some places.
    fn shift_some(&mut self, updates: &Updates, places: &[usize]) -> Result<()> {
        let step = i64::from(self.header.translation_step);
        for row in TRANSLATION {
            let residuals = not_zero(updates, places, row);
            if residuals.is_empty() {
                continue;
            }
            let positions = self.positions.make_mut().row_mut(row);
            let moved = self.moved.make_mut();
            for (gaussian, residual) in residuals {
                moved[gaussian] = true;
                let by = i64::from(residual) * step;
                // [7.8-2]
                positions[gaussian] = narrow_position(i64::from(positions[gaussian]) + by)?;
            }
        }
        Ok(())
    }

    /// Apply the residuals of codes.
    fn recode_some(&mut self, updates: &Updates, places: &[usize]) -> Result<()> {
        for row in CODES {
            let residuals = not_zero(updates, places, row);
            if residuals.is_empty() {
                continue;
            }
            let codes = self.codes.make_mut().row_mut(row - CODES.start);
            for (gaussian, residual) in residuals {
                // [7.8-3]
                let code = i32::from(codes[gaussian]).saturating_add(residual);
                codes[gaussian] = narrow_code(code)?;
            }
        }
        Ok(())
    }

    /// Apply the residuals of rotation.
    fn turn_some(&mut self, updates: &Updates, places: &[usize]) -> Result<()> {
        let unity = i32::from(self.header.rotation_unity);
        for &place in places {
            let [x, y, z] = [0, 1, 2].map(|axis| updates.residuals[ROTATION.start + axis][place]);
            if [x, y, z] == [0; 3] {
                continue;
            }
            // [7.8-4]
            if [x, y, z].iter().any(|residual| residual.unsigned_abs() > TURN_LIMIT) {
                let message = format!("a rotation residual exceeds {TURN_LIMIT}");
                return Err(Error::new(Reject::SymbolRange, message));
            }
            let mut rotations = self.rotations.make_mut().first_mut::<4>();
            let residual = normalize_sum([unity, x, y, z])?;
            let gaussian = updates.gaussians[place] as usize;
            let rotation = [0, 1, 2, 3].map(|row: usize| rotations[row][gaussian]);
            for (row, part) in rotations.iter_mut().zip(turn(rotation, residual)?) {
                row[gaussian] = part;
            }
        }
        Ok(())
    }
}

/// The Gaussians at some places whose residual in a row is not 0, and that residual.
fn not_zero(updates: &Updates, places: &[usize], row: usize) -> Vec<(usize, i32)> {
    let residuals = &updates.residuals[row];
    let all = places.iter().map(|&place| (updates.gaussians[place] as usize, residuals[place]));
    all.filter(|&(_, residual)| residual != 0).collect()
}
