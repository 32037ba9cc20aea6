//! The steps of a frame: SPEC 7.4, 7.7.

use super::{require_births, require_gaussians, State};
use crate::anchors::Anchors;
use crate::coding::channels::Channels;
use crate::error::{Error, Reject, Result};
use crate::parallel::{both, each, ranges};
use crate::records::{Births, FrameChunk, Updates};
use crate::rows::{copy_without, remove_entries, Rows};
use crate::shared::Shared;
use std::sync::Arc;

const OPACITY: usize = 3;
const JUDGED: usize = 1 << 13; // minimum number of Gaussians per task

/// The coded contents of a frame.
#[derive(Clone, Debug)]
pub struct Coded {
    /// The symbols of each level's anchors, level 1 first.
    pub symbols: Vec<Vec<Channels>>,
    /// Updates of single Gaussians; `None` in a stream without updates.
    pub updates: Option<Updates>,
    /// The newborn Gaussians.
    pub births: Births,
}

impl State {
    /// Advance to the next frame (SPEC 7.4 to 7.8); returns the coded contents.
    ///
    /// # Errors
    /// The chunk is invalid; the state must not be used afterwards.
    pub fn frame(&mut self, chunk: &FrameChunk) -> Result<Coded> {
        // [7.4-1]
        if u64::from(chunk.phase) != u64::from(self.phase) + 1 {
            let message = format!("phase {} follows {}", chunk.phase, self.phase);
            return Err(Error::new(Reject::FrameOrder, message));
        }
        require_births(&self.header, u64::from(chunk.birth_count))?;
        self.begin_frame(chunk.death_count)?;
        if chunk.updates.is_none() {
            require_gaussians(&self.header, self.count() as u64 + u64::from(chunk.birth_count))?;
        }
        let symbols = self.read_motion(&chunk.motion, chunk.previous_contexts)?;
        self.move_by(&symbols)?;
        let updates = match &chunk.updates {
            Some(section) => Some(self.read_updates(section)?),
            None => None,
        };
        if let Some(updates) = &updates {
            self.update(updates)?;
        }
        let births = self.read_births(&chunk.births, chunk.birth_count)?;
        self.bear(&births)?;
        self.prove(chunk.state_crc)?;
        Ok(Coded { symbols, updates, births })
    }

    /// Begin a frame (SPEC 7.4): remove `death_count` Gaussians and bind the others to anchors.
    ///
    /// # Errors
    /// `frame-order`, no frame can follow; `count`, no Gaussian would be left; `Encode`, the state
    /// is that of a frame that has only begun.
    pub fn begin_frame(&mut self, death_count: u32) -> Result<()> {
        // [7.4-2]
        let frame = self.frame.checked_add(1).ok_or_else(|| {
            Error::new(Reject::FrameOrder, format!("no frame can follow frame {}", self.frame))
        })?;
        // [7.4-3]
        if death_count as usize >= self.count() {
            let message = format!("{death_count} deaths in a scene of {} Gaussians", self.count());
            return Err(Error::new(Reject::Count, message));
        }
        self.require_moved()?;
        // A new sampling replaces all bindings.
        let samples = self.phase % u32::from(self.header.resample_interval) == 0;
        let before = if samples { self.anchors.take() } else { None };
        let gone = choose_deaths(self.codes.row(OPACITY), death_count);
        self.remove(&gone, true);
        self.departed = gone;
        self.is_moved = false;
        self.frame = frame;
        self.phase += 1;
        self.bind(before.as_deref());
        Ok(())
    }

    /// Bind the Gaussians without a binding: all of them if there are no anchors (SPEC 6.5), where
    /// the previous anchors `before` only make sampling faster.
    fn bind(&mut self, before: Option<&Anchors>) {
        let (header, ids, positions) = (&self.header, &self.ids, &self.positions);
        let stay = |moved: &mut Vec<bool>| {
            moved.clear();
            moved.resize(ids.len(), false);
        };
        match (&mut self.anchors, before) {
            (Some(anchors), _) if self.bound < ids.len() => {
                let newborn = [0, 1, 2].map(|axis| &positions.row(axis)[self.bound..]);
                Arc::make_mut(anchors).append(&newborn);
            }
            (Some(_), _) => {}
            (None, Some(before)) => {
                let moved = &self.moved;
                let anchors = before.sample_again(header, self.phase, ids, positions, moved);
                self.anchors = Some(Arc::new(anchors));
                self.moved.change(stay, |_, moved| stay(moved));
            }
            (None, None) => {
                let anchors = Anchors::sample(header, self.phase, ids, positions);
                self.anchors = Some(Arc::new(anchors));
                self.moved.change(stay, |_, moved| stay(moved));
            }
        }
        self.bound = self.ids.len();
    }

    /// Remove the Gaussians with these ascending indices, except their motion if it is kept.
    pub(super) fn remove(&mut self, gone: &[u32], keeps_motion: bool) {
        if gone.is_empty() {
            return;
        }
        let bound = gone.partition_point(|&gaussian| (gaussian as usize) < self.bound);
        self.bound -= bound;
        let State { ids, positions, rotations, codes, motion, moved, recency, anchors, .. } = self;
        let updates = self.header.updates;
        let places = || {
            remove_columns(positions, gone);
            remove_columns(rotations, gone);
            remove_from(ids, gone);
        };
        let codes = || remove_columns(codes, gone);
        let others = || {
            if !keeps_motion {
                remove_from(motion, gone);
            }
            remove_from(moved, gone);
            if updates {
                remove_from(recency, gone);
            }
            if let Some(anchors) = anchors {
                Arc::make_mut(anchors).remove(&gone[..bound]);
            }
        };
        both(|| both(places, codes), others);
    }
}

/// The ascending indices of the Gaussians with the least (opacity code, id) (SPEC 7.4): `count`, or
/// all if there are fewer.
#[must_use]
pub fn choose_deaths(opacities: &[i16], count: u32) -> Vec<u32> {
    if count == 0 || opacities.is_empty() {
        return Vec::new();
    }
    let range = |(least, most): (i16, i16), &opacity: &i16| (least.min(opacity), most.max(opacity));
    let (least, most) = opacities.iter().fold((i16::MAX, i16::MIN), range);
    let place = |opacity: i16| (i32::from(opacity) - i32::from(least)) as usize;
    let mut counts = vec![0u32; place(most) + 1];
    for &opacity in opacities {
        counts[place(opacity)] += 1;
    }
    // All Gaussians below the limit die, and `left` of those at the limit.
    let (mut limit, mut left) = (0, count);
    while limit + 1 < counts.len() && counts[limit] < left {
        left -= counts[limit];
        limit += 1;
    }
    let may_die = |index: &u32| place(opacities[*index as usize]) <= limit;
    let pieces = each(ranges(opacities.len(), JUDGED), &|indices| {
        (indices.start as u32..indices.end as u32).filter(may_die).collect::<Vec<_>>()
    });
    let mut dying = pieces.concat();
    dying.retain(|&index| {
        let is_at_limit = place(opacities[index as usize]) == limit;
        let dies = !is_at_limit || left > 0;
        left -= u32::from(is_at_limit && dies);
        dies
    });
    dying
}

/// Remove the columns with ascending indices.
fn remove_columns<T: Copy + Default + Send + Sync>(rows: &mut Shared<Rows<T>>, gone: &[u32]) {
    rows.change(|rows| rows.remove(gone), |rows, others| rows.copy_without(gone, others));
}

/// Remove the entries with ascending indices.
fn remove_from<T: Copy>(numbers: &mut Shared<Vec<T>>, gone: &[u32]) {
    let copy = |numbers: &Vec<T>, others: &mut Vec<T>| copy_without(numbers, gone, others);
    numbers.change(|numbers| remove_entries(numbers, gone), copy);
}
