//! The newborn Gaussians of a frame: SPEC 7.6.

use super::canonical::{expand_rotations, narrow_codes};
use super::{narrow_position, require_births, require_gaussians, State};
use crate::coding::births::{read_births, write_births};
use crate::coding::canonical::require_even;
use crate::coding::channels::Channels;
use crate::constants::COUNTER_LIMIT;
use crate::error::{Error, Reject, Result};
use crate::records::{Births, Section};
use crate::rows::Rows;
use std::sync::Arc;

impl State {
    /// Encode the newborn Gaussians of this frame; after the motion and the updates.
    ///
    /// # Errors
    /// `Encode`: a number is out of range, the parents are not ascending, or the births have the
    /// wrong shape.
    pub fn write_births(&self, births: &Births) -> Result<Section> {
        require_even(&births.newborn, self.header.code_planes())?;
        write_births(births, &self.birth_counts)
    }

    /// Decode `count` newborn Gaussians; after the motion and the updates.
    ///
    /// # Errors
    /// The section is invalid, or the number too large.
    pub fn read_births(&mut self, section: &Section, count: u32) -> Result<Births> {
        self.require_room(count as usize)?;
        let (parents, code_planes) = (self.count(), self.header.code_planes());
        let counts = Arc::make_mut(&mut self.birth_counts);
        read_births(section, count as usize, parents, code_planes, counts)
    }

    /// Append the newborn Gaussians of this frame (SPEC 7.6); after the motion and the updates.
    ///
    /// # Errors
    /// `count-exceeds-level`, `parent-range`, `position-range`, `code-range`, `rotation-range`;
    /// `Encode`: the frame has not been moved, or the births have the wrong shape.
    pub fn bear(&mut self, births: &Births) -> Result<()> {
        let newborn = births.newborn.count();
        if newborn == 0 {
            return Ok(());
        }
        self.require_moved()?;
        require_even(&births.newborn, self.header.code_planes())?;
        self.require_room(newborn)?;
        let positions = self.place(births)?;
        let rotations = expand_rotations(&self.header, &births.newborn)?;
        let codes = narrow_codes(&births.newborn)?;
        let first = self.next_id as u32;
        self.next_id += newborn as u64;
        self.ids.make_mut().extend((0..newborn as u32).map(|number| first + number));
        append(self.positions.make_mut(), &positions);
        append(self.rotations.make_mut(), &rotations);
        append(self.codes.make_mut(), &codes);
        let motion = self.motion.make_mut();
        motion.resize(motion.len() + newborn, Channels::default());
        let moved = self.moved.make_mut();
        moved.resize(moved.len() + newborn, true);
        if self.header.updates {
            let recency = self.recency.make_mut();
            recency.resize(recency.len() + newborn, 0);
        }
        Ok(())
    }

    /// Check a number of newborn Gaussians against the level and the remaining ids.
    fn require_room(&self, newborn: usize) -> Result<()> {
        require_births(&self.header, newborn as u64)?;
        require_gaussians(&self.header, self.count() as u64 + newborn as u64)?;
        // [7.6-5]
        if self.next_id + newborn as u64 > COUNTER_LIMIT + 1 {
            let message = "no ids are left for new Gaussians";
            return Err(Error::new(Reject::CountExceedsLevel, message));
        }
        Ok(())
    }

    /// The positions of the newborn Gaussians.
    fn place(&self, births: &Births) -> Result<Rows<i32>> {
        if births.parents.len() != births.newborn.count() {
            return Err(Error::Encode("every newborn Gaussian needs a parent".into()));
        }
        // [7.6-1]
        if births.parents.iter().any(|&parent| parent as usize >= self.count()) {
            let message = "the parent of a newborn Gaussian is not in the scene";
            return Err(Error::new(Reject::ParentRange, message));
        }
        let step = i64::from(self.header.position_step);
        let mut rows = Rows::zeros(3, births.parents.len(), 0);
        for (axis, residuals) in births.newborn.positions.iter().enumerate() {
            let from = self.positions.row(axis);
            let newborn = births.parents.iter().zip(residuals);
            for (to, (&parent, &residual)) in rows.row_mut(axis).iter_mut().zip(newborn) {
                // [7.6-2]
                *to =
                    narrow_position(i64::from(from[parent as usize]) + step * i64::from(residual))?;
            }
        }
        Ok(rows)
    }
}

/// Append columns to rows.
fn append<T: Copy + Default>(rows: &mut Rows<T>, columns: &Rows<T>) {
    let old = rows.columns();
    rows.grow(columns.columns());
    for row in 0..columns.rows() {
        rows.row_mut(row)[old..].copy_from_slice(columns.row(row));
    }
}
