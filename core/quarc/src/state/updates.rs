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
    /// What is known of the Gaussians before their updates (SPEC 8.8); after `move_by`.
    fn update_context(&self) -> Result<UpdateContext<'_>> {
        if !self.header.updates {
            return Err(Error::Encode("the stream has no updates".into()));
        }
        Ok(UpdateContext { motion: &self.motion, recency: &self.recency })
    }

    /// Code the updates of this frame; after `move_by`, in a stream with updates.
    ///
    /// # Errors
    /// `Encode`: a residual is beyond what the format carries.
    pub fn write_updates(&self, updates: &Updates) -> Result<Section> {
        write_updates(self.update_context()?, updates, &self.update_counts)
    }

    /// Read the updates of this frame; after `move_by`, in a stream with updates.
    ///
    /// # Errors
    /// What is wrong with the section.
    pub fn read_updates(&mut self, section: &Section) -> Result<Updates> {
        let mut counts = (*self.update_counts).clone();
        let updates = read_updates(section, self.update_context()?, &mut counts)?;
        self.update_counts = Arc::new(counts);
        Ok(updates)
    }

    /// Change single Gaussians (SPEC 7.8); after `move_by`, in a stream with updates.
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
            return Err(Error::new(Reject::Count, format!("all {} Gaussians leave", gone.len())));
        }
        let recency = Arc::make_mut(&mut self.recency);
        recency.iter_mut().for_each(|recency| *recency = (*recency + 1).min(RECENCY_LIMIT));
        for &gaussian in &updates.gaussians {
            recency[gaussian as usize] = 0;
        }
        let stays = |place: &usize| !updates.dies[*place];
        for place in (0..updates.gaussians.len()).filter(stays) {
            self.change(updates, place)?;
        }
        self.remove(&gone);
        Ok(())
    }

    /// Add the residuals at a place to their Gaussian.
    fn change(&mut self, updates: &Updates, place: usize) -> Result<()> {
        let gaussian = updates.gaussians[place] as usize;
        let residuals = |row: usize| updates.residuals[row][place];
        if TRANSLATION.map(residuals).any(|residual| residual != 0) {
            let positions = Arc::make_mut(&mut self.positions);
            for row in TRANSLATION {
                let position = &mut positions.row_mut(row)[gaussian];
                let by = i64::from(residuals(row)) * i64::from(self.header.translation_step);
                // [7.8-2]
                *position = narrow_position(i64::from(*position) + by)?;
            }
        }
        if CODES.map(residuals).any(|residual| residual != 0) {
            let codes = Arc::make_mut(&mut self.codes);
            for row in CODES {
                let code = &mut codes.row_mut(row - CODES.start)[gaussian];
                // [7.8-3]
                *code = narrow_code(i32::from(*code).saturating_add(residuals(row)))?;
            }
        }
        self.turn_one(gaussian, [0, 1, 2].map(|axis| residuals(ROTATION.start + axis)))
    }

    fn turn_one(&mut self, gaussian: usize, residuals: [i32; 3]) -> Result<()> {
        // [7.8-4]
        if residuals.iter().any(|residual| residual.unsigned_abs() > TURN_LIMIT) {
            let message = format!("a residual of rotation is beyond {TURN_LIMIT}");
            return Err(Error::new(Reject::SymbolRange, message));
        }
        if residuals == [0; 3] {
            return Ok(());
        }
        let [x, y, z] = residuals;
        let residual = normalize_sum([i32::from(self.header.rotation_unity), x, y, z])?;
        let rotations = Arc::make_mut(&mut self.rotations);
        let rotation = [0, 1, 2, 3].map(|row| rotations.row(row)[gaussian]);
        for (row, part) in turn(rotation, residual)?.iter().enumerate() {
            rotations.row_mut(row)[gaussian] = *part;
        }
        Ok(())
    }
}
