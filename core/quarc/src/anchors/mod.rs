//! The anchors of a scene and who follows them: SPEC 6.

mod binding;
mod sampler;

pub use sampler::count_anchors;

use crate::records::Header;
use crate::rows::Rows;

/// What stands for an anchor that was not looked for, as it does not move.
pub const NOBODY: u32 = u32::MAX;

/// The anchors of one level, as they stand from one sampling to the next.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AnchorLevel {
    /// Ids of the Gaussians that were chosen, ascending.
    pub ids: Vec<u32>,
    /// Where they were when chosen, lattice units.
    pub positions: [Vec<i32>; 3],
    /// Index of each one's parent in the next coarser level; zeros at the coarsest.
    pub parents: Vec<u32>,
}

/// All anchors of a scene, and the anchor that each Gaussian follows at each level.
#[derive(Clone, Debug)]
pub struct Anchors {
    levels: Vec<AnchorLevel>,
    binding: Vec<Vec<u32>>,
}

impl Anchors {
    /// Sample the anchors of a frame: 6.1 to 6.4.
    ///
    /// `ids` are ascending, one to a column of `positions`, and there is at least one. All
    /// coordinates are within `POSITION_LIMIT`.
    #[must_use]
    pub fn sample(header: &Header, phase: u32, ids: &[u32], positions: &Rows<i32>) -> Self {
        let rows = [positions.row(0), positions.row(1), positions.row(2)];
        let mut levels: Vec<AnchorLevel> = Vec::new();
        let mut binding = Vec::new();
        let chosen = sampler::sample(header, phase, ids, rows);
        for members in &chosen {
            let at = |axis: usize| members.iter().map(|&i| rows[axis][i as usize]).collect();
            let positions: [Vec<i32>; 3] = [at(0), at(1), at(2)];
            binding.push(binding::bind(rows, &positions));
            let ids = members.iter().map(|&i| ids[i as usize]).collect();
            levels.push(AnchorLevel { ids, positions, parents: vec![0; members.len()] });
        }
        // [6.5] the parent is the anchor that the own Gaussian follows.
        for (level, members) in chosen.iter().enumerate().take(chosen.len() - 1) {
            let coarser: &Vec<u32> = &binding[level + 1];
            levels[level].parents = members.iter().map(|&i| coarser[i as usize]).collect();
        }
        Anchors { levels, binding }
    }

    /// The levels, level 1, the finest, first.
    #[must_use]
    pub fn levels(&self) -> &[AnchorLevel] {
        &self.levels
    }

    /// Gaussians of these ascending indices have died; the others keep their order (6.5).
    pub fn remove(&mut self, gone: &[u32]) {
        for binding in &mut self.binding {
            let (mut place, mut next) = (0, 0);
            binding.retain(|_| {
                let dies = gone.get(next) == Some(&place);
                next += usize::from(dies);
                place += 1;
                !dies
            });
        }
    }

    /// Newborn at these positions are bound from now on, behind all others (6.5).
    pub fn append(&mut self, positions: &[&[i32]; 3]) {
        for (level, binding) in self.levels.iter().zip(&mut self.binding) {
            binding.extend(binding::bind(*positions, &level.positions));
        }
    }

    /// For each Gaussian the index of the anchor that it follows at a level, where that anchor
    /// moves; where not, `NOBODY` or an anchor that does not move.
    ///
    /// `moves` has one entry to each anchor of the level. Level 1 is number 0.
    pub fn followed(&mut self, level: usize, moves: &[bool]) -> &[u32] {
        assert_eq!(moves.len(), self.levels[level].ids.len(), "an entry to each anchor");
        &self.binding[level]
    }

    /// For each Gaussian the index of the anchor that it follows at a level. Level 1 is number 0.
    pub fn binding(&mut self, level: usize) -> &[u32] {
        &self.binding[level]
    }
}
