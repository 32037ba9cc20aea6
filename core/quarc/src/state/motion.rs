//! The motion of a frame: SPEC 7.5.

use super::State;
use crate::anchors::Anchors;
use crate::coding::channels::Channels;
use crate::coding::motion::{read_motion, require_valid, write_motion, Known, MotionContext};
use crate::error::{Error, Result};
use crate::parallel::{each, ranges};
use crate::records::Section;
use crate::rows::before_removal;
use std::sync::Arc;

/// No motion.
pub(super) const STILL: Channels = [0; 8];

const RECALLED: usize = 1 << 12; // minimum number of anchors per task

impl State {
    /// Whether every Gaussian is bound.
    fn require_bound(&self) -> Result<()> {
        if self.bound == self.ids.len() {
            return Ok(());
        }
        Err(not_begun())
    }

    /// Check that `move_by` has been called since `begin_frame`.
    pub(super) fn require_moved(&self) -> Result<()> {
        if self.is_moved {
            return Ok(());
        }
        Err(Error::Encode("move_by has not been called for this state".into()))
    }

    /// Encode the symbols of each level's anchors in this frame, level 1 first.
    ///
    /// # Errors
    /// `Encode`: a symbol is out of range, or the number of symbols does not match the anchors.
    pub fn write_motion(&self, symbols: &[Vec<Channels>], previous: bool) -> Result<Section> {
        self.require_bound()?;
        let mut anchors = self.anchors.clone();
        let anchors = anchors_of(&mut anchors)?;
        let motion = previous.then_some((&self.motion[..], &self.departed[..]));
        let sizes = anchors.levels().iter().map(|level| level.ids.len()).collect();
        let pass = &mut |above: usize, wanted: &[bool]| know(anchors, motion, above, wanted);
        let mut context = MotionContext { sizes, pass };
        write_motion(&mut context, symbols, self.header.symbol_planes(), &self.motion_counts)
    }

    /// Decode the symbols of each level's anchors in this frame, level 1 first.
    ///
    /// # Errors
    /// The section is invalid.
    pub fn read_motion(&mut self, section: &Section, previous: bool) -> Result<Vec<Vec<Channels>>> {
        let mut counts = (*self.motion_counts).clone();
        self.require_bound()?;
        let anchors = anchors_of(&mut self.anchors)?;
        let motion = previous.then_some((&self.motion[..], &self.departed[..]));
        let sizes = anchors.levels().iter().map(|level| level.ids.len()).collect();
        let pass = &mut |above: usize, wanted: &[bool]| {
            if above == 0 {
                anchors.seek(0, wanted); // for `move_by`
            }
            know(anchors, motion, above, wanted)
        };
        let mut context = MotionContext { sizes, pass };
        let symbols = read_motion(section, &mut context, self.header.symbol_planes(), &mut counts)?;
        self.motion_counts = Arc::new(counts);
        Ok(symbols)
    }

    /// Move every Gaussian by its anchors (SPEC 7.5); after `begin_frame`.
    ///
    /// # Errors
    /// `position-range`, `degenerate-rotation`; `Encode`: a symbol is out of range, or the number of
    /// symbols does not match the anchors.
    pub fn move_by(&mut self, symbols: &[Vec<Channels>]) -> Result<()> {
        self.require_bound()?;
        let anchors = anchors_of(&mut self.anchors)?;
        let counts = anchors.levels().iter().map(|level| level.ids.len());
        require_valid(symbols, counts, self.header.symbol_planes())?;
        let moves = |symbols: &Vec<Channels>| symbols.iter().map(|own| own != &STILL).collect();
        let moves: Vec<Vec<bool>> = symbols.iter().map(moves).collect();
        anchors.follow(&moves);
        let moving = |&level: &usize| moves[level].contains(&true);
        let levels: Vec<usize> = (0..moves.len()).filter(moving).collect();
        self.displace(symbols, &levels)?;
        self.is_moved = true;
        Ok(())
    }
}

/// What is known about the level below the level `above`, whose `wanted` anchors matter; `motion`
/// is that of the Gaussians in the previous frame, where it is part of the contexts (SPEC 8.7),
/// with the ascending indices of those that have died since.
fn know(
    anchors: &mut Anchors,
    motion: Option<(&[Channels], &[u32])>,
    above: usize,
    wanted: &[bool],
) -> Known {
    let Some(level) = above.checked_sub(1) else { return Known::default() };
    let count = anchors.levels()[level].ids.len();
    let parents = if above < anchors.levels().len() {
        anchors.parents(level, wanted)
    } else {
        vec![u32::MAX; count]
    };
    let Some((motion, departed)) = motion else {
        return Known { own: vec![STILL; count], parents };
    };
    let recall = |some| {
        let mut before = before_removal(departed);
        // Dead Gaussians do not move.
        let own = |index: Option<usize>| index.map_or(STILL, |index| motion[before(index)]);
        anchors.owners(level, some).map(own).collect::<Vec<_>>()
    };
    Known { own: each(ranges(count, RECALLED), &recall).concat(), parents }
}

/// The anchors of a state, mutable because searches keep their results.
pub(super) fn anchors_of(anchors: &mut Option<Arc<Anchors>>) -> Result<&mut Anchors> {
    anchors.as_mut().map(Arc::make_mut).ok_or_else(not_begun)
}

fn not_begun() -> Error {
    Error::Encode("begin_frame has not been called for this state".into())
}
