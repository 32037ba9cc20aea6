//! All that one sampling of the anchors fixes until the next.

use super::drawn::Drawn;
use super::index::Index;
use super::order::Order;
use super::runs::{cut_runs, Points, Tier, LANES};
use super::sampler::{count_anchors, Sampler};
use super::AnchorLevel;
use crate::records::Header;

const GAUSSIANS: usize = 48; // of the least runs, at most
const FAN: usize = 8; // parts of a wider run, at most

/// Gaussians and anchors as they stood when they were sampled.
#[derive(Clone, Debug, Default)]
pub struct Sampling {
    /// Ids of the Gaussians, by index.
    pub ids: Vec<u32>,
    /// The Gaussians in Morton order.
    pub order: Order,
    /// Where they are, in that order.
    pub points: Points,
    /// And in runs.
    pub tiers: Vec<Tier>,
    /// The anchors, level 1 first.
    pub levels: Vec<AnchorLevel>,
    /// What finds the nearest of each level.
    pub indices: Vec<Index>,
    /// Of each level, how many of the `Index` stand before each of the least runs, and in all.
    pub ranks: Vec<Vec<u32>>,
    /// Of each level, for each anchor the place in Morton order of a Gaussian where it stands.
    pub own: Vec<Vec<u32>>,
}

impl Sampling {
    /// Sample a scene whose Gaussians are in Morton order already.
    pub fn new(
        header: &Header,
        phase: u32,
        ids: &[u32],
        positions: [&[i32]; 3],
        order: Order,
    ) -> Self {
        let sampler = Sampler::new(header, phase, ids, &order);
        let points = gather(positions, &order.indices);
        let tiers = cut_runs(&points, &order.merges, GAUSSIANS, FAN);
        let mut drawn = Vec::new();
        for (level, count) in count_anchors(header, ids.len()).into_iter().enumerate() {
            let chosen = sampler.choose(level, count);
            drawn.push(Drawn::new(&chosen, &order, &points));
        }
        let mut sampling = Sampling { ids: ids.to_vec(), order, points, tiers, ..Self::default() };
        for level in drawn {
            let row = |row: &[i32]| level.indices.iter().map(|&i| row[i as usize]).collect();
            sampling.levels.push(AnchorLevel {
                ids: level.indices.iter().map(|&i| ids[i as usize]).collect(),
                positions: positions.map(row),
            });
            sampling.ranks.push(rank(&level.places, &sampling.tiers[0].starts));
            sampling.indices.push(level.index);
            sampling.own.push(level.own);
        }
        sampling
    }
}

/// Positions in an order.
fn gather(positions: [&[i32]; 3], indices: &[u32]) -> Points {
    positions.map(|row| {
        let mut points: Vec<f32> = Vec::with_capacity(indices.len() + LANES);
        points.extend(indices.iter().map(|&index| row[index as usize] as f32));
        points.resize(indices.len() + LANES, 0.0);
        points
    })
}

/// How many of some ascending places are before each of some borders, ascending too.
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
