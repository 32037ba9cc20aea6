//! The motion of a frame: SPEC 7.5.

use super::State;
use crate::anchors::Anchors;
use crate::coding::motion::{read_motion, write_motion, Channels, MotionContext};
use crate::error::{Error, Result};
use crate::parallel::each;
use crate::records::Section;
use std::sync::Arc;

/// No motion.
pub(super) const STILL: Channels = [0; 8];

impl State {
    /// For each level, level 1 first, the motion of each anchor's own Gaussian in the previous frame
    /// (SPEC 8.7); zero unless `previous`. After `begin_frame`.
    fn own_motion(&self, previous: bool) -> Result<Vec<Vec<Channels>>> {
        self.require_bound()?;
        let anchors = self.anchors.as_ref().ok_or_else(not_begun)?;
        let recall = |level: usize| {
            if !previous {
                return vec![STILL; anchors.levels()[level].ids.len()];
            }
            // Dead Gaussians do not move.
            let motion = |index: Option<usize>| index.map_or(STILL, |index| self.motion[index]);
            anchors.owners(level).map(motion).collect()
        };
        Ok(each((0..anchors.levels().len()).collect(), &recall))
    }

    /// Whether every Gaussian is bound.
    fn require_bound(&self) -> Result<()> {
        if self.bound == self.ids.len() {
            return Ok(());
        }
        Err(not_begun())
    }

    /// Encode the symbols of each level's anchors in this frame, level 1 first.
    ///
    /// # Errors
    /// `Encode`: a symbol is out of range, or the number of symbols does not match the anchors.
    pub fn write_motion(&self, symbols: &[Vec<Channels>], previous: bool) -> Result<Section> {
        let own = self.own_motion(previous)?;
        let mut anchors = self.anchors.clone();
        let anchors = anchors_of(&mut anchors)?;
        let parents = &mut |level, wanted: &[bool]| anchors.parents(level, wanted);
        let mut context = MotionContext { own: &own, parents };
        write_motion(&mut context, symbols, self.header.symbol_planes(), &self.motion_counts)
    }

    /// Decode the symbols of each level's anchors in this frame, level 1 first.
    ///
    /// # Errors
    /// The section is invalid.
    pub fn read_motion(&mut self, section: &Section, previous: bool) -> Result<Vec<Vec<Channels>>> {
        let mut counts = (*self.motion_counts).clone();
        let own = self.own_motion(previous)?;
        let anchors = anchors_of(&mut self.anchors)?;
        let parents = &mut |level, wanted: &[bool]| anchors.parents(level, wanted);
        let mut context = MotionContext { own: &own, parents };
        let symbols = read_motion(section, &mut context, self.header.symbol_planes(), &mut counts)?;
        self.motion_counts = Arc::new(counts);
        Ok(symbols)
    }

    /// Move every Gaussian by its anchors (SPEC 7.5); after `begin_frame`.
    ///
    /// # Errors
    /// `position-range`, `degenerate-rotation`.
    pub fn move_by(&mut self, symbols: &[Vec<Channels>]) -> Result<()> {
        self.require_bound()?;
        let anchors = anchors_of(&mut self.anchors)?;
        let counts = anchors.levels().iter().map(|level| level.ids.len());
        if !counts.eq(symbols.iter().map(Vec::len)) {
            return Err(Error::Encode("the number of symbols does not match the anchors".into()));
        }
        let moves = |symbols: &Vec<Channels>| symbols.iter().map(|own| own != &STILL).collect();
        let moves: Vec<Vec<bool>> = symbols.iter().map(moves).collect();
        anchors.follow(&moves);
        let moving = |&level: &usize| moves[level].contains(&true);
        let levels: Vec<usize> = (0..moves.len()).filter(moving).collect();
        self.displace(symbols, &levels)
    }
}

/// The anchors of a state, mutable because searches keep their results.
pub(super) fn anchors_of(anchors: &mut Option<Arc<Anchors>>) -> Result<&mut Anchors> {
    anchors.as_mut().map(Arc::make_mut).ok_or_else(not_begun)
}

fn not_begun() -> Error {
    Error::Encode("begin_frame has not been called for this state".into())
}
