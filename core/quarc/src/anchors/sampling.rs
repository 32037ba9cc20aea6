//! The result of a sampling of the anchors, constant until the next one.

use super::drawn::Drawn;
use super::index::Index;
use super::order::Order;
use super::runs::{cut_runs, Tier};
use super::sampler::{count_anchors, Sampler};
use super::search::{reach, Reaches, Seekers};
use super::AnchorLevel;
use crate::parallel::{both, each};
use crate::records::Header;

const GAUSSIANS: usize = 48; // maximum number in a run of the lowest tier
const FAN: usize = 8; // maximum number of parts of a run of the higher tiers

/// Gaussians and anchors at the time of the sampling.
#[derive(Clone, Debug, Default)]
pub struct Sampling {
    /// Ids of the Gaussians, by index.
    pub ids: Vec<u32>,
    /// The Gaussians in Morton order.
    pub order: Order,
    /// Their runs, the lowest tier first.
    pub tiers: Vec<Tier>,
    /// The anchors, level 1 first.
    pub levels: Vec<AnchorLevel>,
    /// For each level, the search index of its anchors.
    pub indices: Vec<Index>,
    /// For each level, bounds on the anchors that the Gaussians of each run may follow.
    pub reaches: Vec<Reaches>,
    /// For each level, the index of each anchor's Gaussian, ascending.
    pub owners: Vec<Vec<u32>>,
}

impl Sampling {
    /// Sample a scene with the Morton order of its Gaussians.
    pub fn new(
        header: &Header,
        phase: u32,
        ids: &[u32],
        positions: [&[i32]; 3],
        order: Order,
    ) -> Self {
        let (sampler, tiers) = both(
            || Sampler::new(header, phase, ids, &order),
            || cut_runs(&order.points, &order.merges, GAUSSIANS, FAN),
        );
        let seekers = Seekers { points: &order.points, tiers: &tiers };
        let counts = count_anchors(header, ids.len()).into_iter().enumerate().collect();
        let drawn = each(counts, &|(level, count)| {
            let level = Drawn::new(&sampler.choose(level, count), &order);
            let row = |row: &[i32]| level.indices.iter().map(|&i| row[i as usize]).collect();
            let anchors = AnchorLevel {
                ids: level.indices.iter().map(|&i| ids[i as usize]).collect(),
                positions: positions.map(row),
            };
            let reach = reach(seekers, &level.index, &rank(&level.places, &tiers[0].starts));
            (anchors, level.index, reach, level.indices)
        });
        let mut sampling = Sampling { ids: ids.to_vec(), tiers, ..Self::default() };
        for (anchors, index, reach, owners) in drawn {
            sampling.levels.push(anchors);
            sampling.indices.push(index);
            sampling.reaches.push(reach);
            sampling.owners.push(owners);
        }
        sampling.order = order;
        sampling
    }
}

/// The number of ascending places before each of some ascending borders.
fn rank(places: &[u32], borders: &[u32]) -> Vec<u32> {
    let mut found = 0;
    let rank = |&border: &u32| {
        while places.get(found).map_or(false, |&place| place < border) {
            found += 1;
        }
        found as u32
    };
    borders.iter().map(rank).collect()
}
