//! The state of a frame, and how the next frame changes it: SPEC 7.
//!
//! ```text
//! CANO, SNAP -> canonical, snapshot ----------------------------------+
//! FRAM -> begin_frame -> move_by -> update -> bear -> state of the frame
//!         (7.4)          (7.5)      (7.8)    (7.6)
//! ```
//!
//! An encoder calls the same steps with its own symbols, updates and births. Before each step, a
//! `write` method encodes them, and the `read` method must decode the section again: only reading
//! adapts the contexts of the next frame (SPEC 8.2).

mod births; // SPEC 7.6
mod canonical; // SPEC 7.2, 7.9
mod displacement; // SPEC 7.5
mod frame; // SPEC 7.4, 7.7
mod motion; // SPEC 7.5
mod updates; // SPEC 7.8

pub use frame::{choose_deaths, Coded};

use crate::anchors::Anchors;
use crate::coding::channels::Channels;
use crate::coding::counts::Counts;
use crate::constants::{Level, CODE_LIMIT, POSITION_LIMIT};
use crate::error::{Error, Reject, Result};
use crate::records::Header;
use crate::rows::{kept_ranges, Rows};
use crate::shared::Shared;
use std::sync::Arc;

/// Everything that a frame passes on to the next (SPEC 7.1).
///
/// Clones share their arrays until one of them changes: without clones, the next frame is computed
/// in place.
#[derive(Clone, Debug)]
pub struct State {
    header: Arc<Header>,
    frame: u32,
    phase: u32,
    next_id: u64,
    ids: Shared<Vec<u32>>,
    positions: Shared<Rows<i32>>,
    rotations: Shared<Rows<i32>>,
    codes: Shared<Rows<i16>>,
    motion: Shared<Vec<Channels>>,
    /// Ascending indices in `motion` of the Gaussians that have died since it was computed, so that
    /// `begin_frame` does not have to copy it: only contexts read it until `move_by` replaces it.
    departed: Vec<u32>,
    /// Whether the motion is that of this frame: `move_by` has been called since `begin_frame`.
    is_moved: bool,
    /// Empty in streams without updates.
    recency: Shared<Vec<u8>>,
    /// `None` before the first sampling.
    anchors: Option<Arc<Anchors>>,
    /// `[N]`: whether each Gaussian may have moved since the last sampling.
    moved: Shared<Vec<bool>>,
    /// The number of Gaussians with bindings; those after them were born in the last frame.
    bound: usize,
    motion_counts: Arc<Counts>,
    birth_counts: Arc<Counts>,
    update_counts: Arc<Counts>,
}

impl State {
    /// The header of the stream.
    #[must_use]
    pub const fn header(&self) -> &Arc<Header> {
        &self.header
    }

    /// Ordinal of the frame in the stream.
    #[must_use]
    pub const fn frame_ordinal(&self) -> u32 {
        self.frame
    }

    /// Frames since the canonical frame, which has 0.
    #[must_use]
    pub const fn phase(&self) -> u32 {
        self.phase
    }

    /// Number of Gaussians, N.
    #[must_use]
    pub fn count(&self) -> usize {
        self.ids.len()
    }

    /// `[N]` ids, ascending.
    #[must_use]
    pub fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// `[3, N]` xyz, lattice units.
    #[must_use]
    pub fn positions(&self) -> &Rows<i32> {
        &self.positions
    }

    /// `[4, N]` wxyz of unit quaternions with `ROTATION_FRACTION_BITS` fraction bits.
    #[must_use]
    pub fn rotations(&self) -> &Rows<i32> {
        &self.rotations
    }

    /// `[7 or 16, N]` log-scale 3, opacity 1, SH DC 3, SH rest 9.
    #[must_use]
    pub fn codes(&self) -> &Rows<i16> {
        &self.codes
    }

    /// Positions and rotations, shared with clones of the state.
    #[must_use]
    pub const fn shared_places(&self) -> [&Arc<Rows<i32>>; 2] {
        [self.positions.arc(), self.rotations.arc()]
    }

    /// Codes, shared with clones of the state.
    #[must_use]
    pub const fn shared_codes(&self) -> &Arc<Rows<i16>> {
        self.codes.arc()
    }

    /// The id of the next newborn Gaussian.
    #[must_use]
    pub const fn next_id(&self) -> u64 {
        self.next_id
    }

    /// `[N]`: for each Gaussian, the sum of the symbols that moved it in this frame.
    #[must_use]
    pub fn motion(&self) -> Vec<Channels> {
        let kept = kept_ranges(&self.departed, self.motion.len());
        kept.flat_map(|kept| &self.motion[kept]).copied().collect()
    }

    /// `[N]` frames since each Gaussian was updated or born, at most `RECENCY_LIMIT`; empty in streams
    /// without updates.
    #[must_use]
    pub fn recency(&self) -> &[u8] {
        &self.recency
    }

    /// The anchors; `None` before the first frame that samples.
    #[must_use]
    pub fn anchors(&self) -> Option<&Arc<Anchors>> {
        self.anchors.as_ref()
    }

    /// The anchors, mutable because searches keep their results.
    ///
    /// # Errors
    /// `Encode`: `begin_frame` has not been called.
    pub fn anchors_mut(&mut self) -> Result<&mut Anchors> {
        motion::anchors_of(&mut self.anchors)
    }
}

/// The limits of this decoder for streams of the unlimited level (SPEC 3.2).
const OWN_LIMITS: Level = match Level::of(30) {
    Some(level) => level,
    None => panic!("there is a level 30"),
};

/// Check a number of Gaussians against the level of the stream: [3.2-1] [3.2-2] [3.2-6].
pub(crate) fn require_gaussians(header: &Header, count: u64) -> Result<()> {
    require_within(header, count, "Gaussians", |level| level.gaussians)
}

/// Check a number of births against the level of the stream: [3.2-3].
fn require_births(header: &Header, count: u64) -> Result<()> {
    require_within(header, count, "births", |level| level.births)
}

fn require_within(
    header: &Header,
    count: u64,
    what: &str,
    most: impl Fn(Level) -> u32,
) -> Result<()> {
    if count > u64::from(most(header.limits())) {
        let message = format!("{count} {what} are too many for level {}", header.level);
        return Err(Error::new(Reject::CountExceedsLevel, message));
    }
    let own = most(OWN_LIMITS);
    if count > u64::from(own) {
        let message = format!("{count} {what} exceed this decoder's limit of {own}");
        return Err(Error::Limit(message));
    }
    Ok(())
}

/// A coordinate that must be within the lattice.
fn narrow_position(position: i64) -> Result<i32> {
    if position.abs() > POSITION_LIMIT {
        return Err(off_lattice());
    }
    Ok(position as i32)
}

fn off_lattice() -> Error {
    Error::new(Reject::PositionRange, "a Gaussian is off the lattice")
}

/// A code that must be within its range.
fn narrow_code(code: i32) -> Result<i16> {
    if i64::from(code).abs() > CODE_LIMIT {
        return Err(Error::new(Reject::CodeRange, "an attribute code is out of its range"));
    }
    Ok(code as i16)
}
