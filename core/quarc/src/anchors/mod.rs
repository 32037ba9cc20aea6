//! The anchors of a scene and who follows them: SPEC 6.
//!
//! Gaussians are sorted once, in Morton order, for all levels. The anchors of a level, a subset
//! of them, inherit that order, so that a tree of boxes over them takes no further sorting. Which
//! anchor a Gaussian follows is found out when somebody asks, and only where it may be one that
//! moves.

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
use crate::rows::{remove_entries, Rows};
use near::Near;
use order::Order;
use runs::Tier;
use sampling::Sampling;
use search::{bind_alone, Moving, Search, Seekers};
use std::sync::Arc;
use survivors::Survivors;

/// What stands for an anchor that was not looked for, as it does not move.
pub const NOBODY: u32 = u32::MAX;

/// The anchors of one level, as they stand from one sampling to the next.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct AnchorLevel {
    /// Ids of the Gaussians that were chosen, ascending.
    pub ids: Vec<u32>,
    /// Where they were when chosen, lattice units.
    pub positions: [Vec<i32>; 3],
}

/// All anchors of a scene, and what is known of who follows them.
#[derive(Clone, Debug)]
pub struct Anchors {
    sampling: Arc<Sampling>,
    survivors: Survivors,
    followers: Vec<Followers>,
}

/// The followers of a level.
#[derive(Clone, Debug, Default)]
struct Followers {
    /// Whom each Gaussian follows that there is now, by index.
    binding: Vec<u32>,
    /// Whom each Gaussian follows of those that were sampled, by place in Morton order.
    sampled: Vec<u32>,
    /// Of each tier of runs of Gaussians, which runs are done.
    resolved: Vec<Vec<bool>>,
}

impl Anchors {
    /// Sample the anchors of a frame (6.1 to 6.3).
    ///
    /// `ids` are ascending, one to a column of `positions`, and there is at least one. All
    /// coordinates are within `POSITION_LIMIT`.
    #[must_use]
    pub fn sample(header: &Header, phase: u32, ids: &[u32], positions: &Rows<i32>) -> Self {
        let rows = [positions.row(0), positions.row(1), positions.row(2)];
        Self::begin(Sampling::new(header, phase, ids, rows, Order::new(rows)))
    }

    /// The same anchors, found faster: most Gaussians stand as they did at the last sampling.
    ///
    /// `moved` tells, by index, which of those that were sampled then may stand elsewhere.
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
        let followers = || Followers {
            binding: vec![NOBODY; sampling.ids.len()],
            sampled: vec![NOBODY; sampling.ids.len()],
            resolved: sampling.tiers.iter().map(|tier| vec![false; tier.count()]).collect(),
        };
        Anchors {
            followers: sampling.levels.iter().map(|_| followers()).collect(),
            survivors: Survivors::all(sampling.ids.len()),
            sampling: Arc::new(sampling),
        }
    }

    /// The levels, level 1, the finest, first.
    #[must_use]
    pub fn levels(&self) -> &[AnchorLevel] {
        &self.sampling.levels
    }

    /// Gaussians of these ascending indices have died; the others keep their order (6.5).
    pub fn remove(&mut self, gone: &[u32]) {
        let sampled = gone.partition_point(|&index| (index as usize) < self.survivors.count());
        self.survivors.remove(&gone[..sampled]);
        for followers in &mut self.followers {
            remove_entries(&mut followers.binding, gone);
        }
    }

    /// Newborn at these positions are bound from now on, behind all others (6.5).
    pub fn append(&mut self, positions: &[&[i32]; 3]) {
        for (followers, index) in self.followers.iter_mut().zip(&self.sampling.indices) {
            let (all, mut near) = (Near::all(index), Near::default());
            let [xs, ys, zs] = *positions;
            for ((&x, &y), &z) in xs.iter().zip(ys).zip(zs) {
                let at = [x, y, z].map(|number| number as f32);
                let place = bind_alone(at, &all, &mut near, index);
                followers.binding.push(index.numbers[place as usize]);
            }
        }
    }

    /// For each Gaussian the index of the anchor that it follows at a level, where that anchor
    /// moves; where not, `NOBODY` or an anchor that does not move (6.4).
    ///
    /// `moves` has one entry to each anchor of the level. Level 1 is number 0.
    pub fn followed(&mut self, level: usize, moves: &[bool]) -> &[u32] {
        self.followers[level].seek(&self.sampling, level, &self.survivors, moves);
        self.known(level)
    }

    /// Do as [`Anchors::followed`] at every level at which anchors move.
    pub fn follow(&mut self, moves: &[Vec<bool>]) {
        let (sampling, survivors) = (&*self.sampling, &self.survivors);
        let levels = self.followers.iter_mut().zip(moves).enumerate();
        let moving = levels.filter(|(_, (_, moves))| moves.contains(&true)).collect();
        each(moving, &|(level, (followers, moves))| {
            followers.seek(sampling, level, survivors, moves);
        });
    }

    /// For each anchor of a level the index of its parent in the next coarser one, where that is
    /// asked for; where not, `NOBODY` or one that is not asked for (6.5).
    ///
    /// `asked` has one entry to each anchor of the next coarser level. Level 1 is number 0; the
    /// coarsest has no parents.
    pub fn parents(&mut self, level: usize, asked: &[bool]) -> Vec<u32> {
        // The parent is whom the own Gaussian follows, alive or not.
        self.followed(level + 1, asked);
        let sampled = &self.followers[level + 1].sampled;
        self.sampling.own[level].iter().map(|&place| sampled[place as usize]).collect()
    }

    /// Whom each Gaussian follows, as far as it has been asked for.
    #[must_use]
    pub fn known(&self, level: usize) -> &[u32] {
        &self.followers[level].binding
    }

    /// For each Gaussian the index of the anchor that it follows at a level. Level 1 is number 0.
    pub fn binding(&mut self, level: usize) -> &[u32] {
        let moves = vec![true; self.levels()[level].ids.len()];
        self.followed(level, &moves)
    }
}

impl Followers {
    /// Look for those of a level who may follow an anchor that moves.
    fn seek(&mut self, sampling: &Sampling, level: usize, survivors: &Survivors, moves: &[bool]) {
        let index = &sampling.indices[level];
        assert_eq!(moves.len(), sampling.levels[level].ids.len(), "an entry to each anchor");
        let tiers = &sampling.tiers;
        let search = Search {
            seekers: Seekers { points: &sampling.order.points, tiers },
            reach: &sampling.reaches[level],
            index,
            moving: &Moving::new(index, moves),
            resolved: &self.resolved,
        };
        for found in search.run() {
            let mut places = found.places.iter();
            for run in found.runs {
                self.resolved[0][run] = true;
                for (point, &place) in tiers[0].parts(run).zip(&mut places) {
                    let anchor = index.numbers[place as usize];
                    self.sampled[point] = anchor;
                    if let Some(now) = survivors.place(sampling.order.indices[point]) {
                        self.binding[now as usize] = anchor;
                    }
                }
            }
        }
        self.resolve_wider(tiers);
    }

    /// Wider runs are done whose parts all are.
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
