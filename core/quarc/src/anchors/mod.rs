//! The anchors of a scene and the Gaussians that follow them: SPEC 6.
//!
//! Gaussians are sorted once, in Morton order, for all levels. The anchors of a level are a subset
//! in the same order, so that a tree of boxes over them needs no further sorting. The anchor of a
//! Gaussian is searched on demand, and only where it may be one that moves.

mod alone;
mod drawn;
mod index;
mod near;
mod nearest;
mod order;
mod runs;
mod sampler;
mod sampling;
mod search;
mod survivors;

pub use sampler::count_anchors;

use crate::parallel::each;
use crate::records::Header;
use crate::rows::{before_removal, kept_ranges, remove_entries, Rows};
use alone::nearest_alone;
use order::Order;
use runs::Tier;
use sampling::Sampling;
use search::{Moving, Search, Seekers};
use std::ops::Range;
use std::sync::Arc;
use survivors::Survivors;

/// Stands for an anchor that was not searched, because it does not move.
pub const NOBODY: u32 = u32::MAX;

/// The anchors of one level, which are constant from one sampling to the next.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AnchorLevel {
    /// Ids of the chosen Gaussians, ascending.
    pub ids: Vec<u32>,
    /// Their positions at the sampling, lattice units.
    pub positions: [Vec<i32>; 3],
}

/// All anchors of a scene, and the bindings that are known.
///
/// Each Gaussian has a slot until the next sampling: its index at the last one; newborn Gaussians
/// have the slots after these. The slots of sampled Gaussians that have died stay empty, so that
/// bindings do not have to be moved.
#[derive(Clone, Debug)]
pub struct Anchors {
    sampling: Arc<Sampling>,
    /// Empty slots, ascending.
    empty: Vec<u32>,
    followers: Vec<Followers>,
}

/// The Gaussians that follow the anchors of a level.
#[derive(Clone, Debug, Default)]
struct Followers {
    /// The anchor of each slot's Gaussian; `NOBODY` if unknown.
    binding: Vec<u32>,
    /// For each tier of runs of Gaussians, which runs have known bindings.
    resolved: Vec<Vec<bool>>,
    /// Which anchors have only known followers.
    sought: Vec<bool>,
}

impl Anchors {
    /// Sample the anchors of a frame (6.1 to 6.3).
    ///
    /// `ids` are ascending, one for each column of `positions`, and there is at least one. All
    /// coordinates are within `POSITION_LIMIT`.
    #[must_use]
    pub fn sample(header: &Header, phase: u32, ids: &[u32], positions: &Rows<i32>) -> Self {
        let rows = [positions.row(0), positions.row(1), positions.row(2)];
        Self::begin(Sampling::new(header, phase, ids, rows, Order::new(rows)))
    }

    /// The same result as `sample`, computed faster if most Gaussians have not moved since the
    /// last sampling.
    ///
    /// `moved` has an entry for each Gaussian that took part in it: whether its position may have
    /// changed.
    #[must_use]
    pub fn sample_again(
        &self,
        header: &Header,
        phase: u32,
        ids: &[u32],
        positions: &Rows<i32>,
        moved: &[bool],
    ) -> Self {
        let last = &self.sampling;
        let rows = [positions.row(0), positions.row(1), positions.row(2)];
        let order = match Survivors::find(&last.ids, ids) {
            Some(survivors) => Order::again(&last.order, &survivors, moved, rows),
            None => Order::new(rows),
        };
        Self::begin(Sampling::new(header, phase, ids, rows, order))
    }

    fn begin(sampling: Sampling) -> Self {
        let followers = |level: &AnchorLevel| Followers {
            binding: vec![NOBODY; sampling.ids.len()],
            resolved: sampling.tiers.iter().map(|tier| vec![false; tier.count()]).collect(),
            sought: vec![false; level.ids.len()],
        };
        Anchors {
            followers: each(sampling.levels.iter().collect(), &followers),
            empty: Vec::new(),
            sampling: Arc::new(sampling),
        }
    }

    /// The levels; level 1, the finest, first.
    #[must_use]
    pub fn levels(&self) -> &[AnchorLevel] {
        &self.sampling.levels
    }

    /// Remove the Gaussians with these ascending indices; the others keep their order (6.5).
    pub fn remove(&mut self, gone: &[u32]) {
        let sampled = self.sampling.ids.len() - self.empty.len();
        let sampled = gone.partition_point(|&index| (index as usize) < sampled);
        let slots: Vec<u32> = self.find_slots(gone).collect();
        let (sampled, newborn) = slots.split_at(sampled);
        for followers in &mut self.followers {
            remove_entries(&mut followers.binding, newborn);
        }
        self.empty.extend_from_slice(sampled);
        self.empty.sort_unstable();
    }

    /// The slots of Gaussians with ascending indices.
    fn find_slots<'a>(&'a self, indices: &'a [u32]) -> impl Iterator<Item = u32> + 'a {
        let mut slot = before_removal(&self.empty);
        indices.iter().map(move |&index| slot(index as usize) as u32)
    }

    /// The slots of a range of Gaussians, as ranges without empty slots.
    pub fn slots(&self, indices: Range<usize>) -> impl Iterator<Item = Range<usize>> + '_ {
        let mut next = 0;
        let slots = self.followers.first().map_or(0, |followers| followers.binding.len());
        kept_ranges(&self.empty, slots).map(move |slots| {
            let first = next;
            next += slots.len();
            let [from, to] =
                [indices.start, indices.end].map(|index| index.clamp(first, next) - first);
            slots.start + from..slots.start + to
        })
    }

    /// For each of some anchors of a level, the current index of its Gaussian; `None` if it has died.
    pub fn owners(
        &self,
        level: usize,
        some: Range<usize>,
    ) -> impl Iterator<Item = Option<usize>> + '_ {
        let owners = &self.sampling.owners[level][some];
        let mut passed = self.empty.partition_point(|empty| owners.first() > Some(empty));
        owners.iter().map(move |&slot| {
            while self.empty.get(passed).map_or(false, |&empty| empty < slot) {
                passed += 1;
            }
            (self.empty.get(passed) != Some(&slot)).then(|| slot as usize - passed)
        })
    }

    /// Append and bind newborn Gaussians at these positions (6.5).
    pub fn append(&mut self, positions: &[&[i32]; 3]) {
        let levels = self.followers.iter_mut().zip(&self.sampling.indices).collect();
        each(levels, &|(followers, index)| {
            let [xs, ys, zs] = *positions;
            for ((&x, &y), &z) in xs.iter().zip(ys).zip(zs) {
                let at = [x, y, z].map(|number| number as f32);
                let place = nearest_alone(at, index);
                followers.binding.push(index.numbers[place as usize]);
            }
        });
    }

    /// For each Gaussian, the index of its anchor at a level if that anchor moves; otherwise
    /// `NOBODY` or an anchor that does not move (6.4).
    ///
    /// `moves` has one entry for each anchor of the level. Level 1 has number 0.
    pub fn followed(&mut self, level: usize, moves: &[bool]) -> Vec<u32> {
        self.seek(level, moves);
        self.known(level)
    }

    /// Search the Gaussians that follow moving anchors of a level.
    pub fn seek(&mut self, level: usize, moves: &[bool]) {
        self.followers[level].seek(&self.sampling, level, moves);
    }

    /// The same for all levels.
    pub fn follow(&mut self, moves: &[Vec<bool>]) {
        let sampling = &*self.sampling;
        let levels = self.followers.iter_mut().zip(moves).enumerate();
        each(levels.collect(), &|(level, (followers, moves))| {
            followers.seek(sampling, level, moves);
        });
    }

    /// For each anchor of a level, the index of its parent in the next coarser level if that is one
    /// of the wanted; otherwise `NOBODY` or an anchor that is not wanted (6.5).
    ///
    /// `wanted` has one entry for each anchor of the next coarser level. Level 1 has number 0; the
    /// coarsest level has no parents.
    pub fn parents(&mut self, level: usize, wanted: &[bool]) -> Vec<u32> {
        self.seek(level + 1, wanted);
        let coarser = &self.followers[level + 1];
        // The parent is the anchor of the anchor's own Gaussian, alive or not.
        let owners = self.sampling.owners[level].iter();
        owners.map(|&slot| coarser.binding[slot as usize]).collect()
    }

    /// The anchor of each slot's Gaussian at a level; `NOBODY` if unknown.
    #[must_use]
    pub fn binding_by_slot(&self, level: usize) -> &[u32] {
        &self.followers[level].binding
    }

    /// For each Gaussian, the index of its anchor at a level; `NOBODY` if unknown.
    #[must_use]
    pub fn known(&self, level: usize) -> Vec<u32> {
        let binding = self.binding_by_slot(level);
        self.slots(0..binding.len()).flat_map(|slots| &binding[slots]).copied().collect()
    }

    /// For each Gaussian, the index of its anchor at a level. Level 1 has number 0.
    pub fn binding(&mut self, level: usize) -> Vec<u32> {
        let moves = vec![true; self.levels()[level].ids.len()];
        self.followed(level, &moves)
    }
}

impl Followers {
    /// Search the Gaussians that may follow a moving anchor.
    fn seek(&mut self, sampling: &Sampling, level: usize, moves: &[bool]) {
        let index = &sampling.indices[level];
        assert_eq!(moves.len(), self.sought.len(), "an entry for each anchor");
        let moves = moves.iter().zip(&self.sought).map(|(&moves, &sought)| moves && !sought);
        let moves: Vec<bool> = moves.collect();
        if !moves.contains(&true) {
            return;
        }
        let tiers = &sampling.tiers;
        let search = Search {
            seekers: Seekers { points: &sampling.order.points, tiers },
            reach: &sampling.reaches[level],
            index,
            moving: &Moving::new(index, &moves),
            resolved: &self.resolved,
        };
        for found in search.run() {
            let mut places = found.places.iter();
            for run in found.runs {
                self.resolved[0][run] = true;
                let slots = &sampling.order.indices[tiers[0].parts(run)];
                for (&slot, &place) in slots.iter().zip(&mut places) {
                    self.binding[slot as usize] = index.numbers[place as usize];
                }
            }
        }
        self.resolve_wider(tiers);
        self.sought.iter_mut().zip(moves).for_each(|(sought, moves)| *sought |= moves);
    }

    /// Mark the wider runs all of whose parts are resolved.
    fn resolve_wider(&mut self, tiers: &[Tier]) {
        for number in 1..tiers.len() {
            let (below, wider) = self.resolved.split_at_mut(number);
            let below = &below[number - 1];
            for (run, done) in wider[0].iter_mut().enumerate() {
                *done = *done || !below[tiers[number].parts(run)].contains(&false);
            }
        }
    }
}
