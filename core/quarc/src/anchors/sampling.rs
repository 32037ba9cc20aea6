//! All that one sampling of the anchors fixes until the next.

use super::index::Index;
use super::order::Order;
use super::runs::{cut_runs, Points, Tier, LANES};
use super::sampler::{count_anchors, Sampler};
use super::search::{reach, Moving, Search, Seekers};
use super::AnchorLevel;
use crate::records::Header;

const SEEKERS: usize = 32; // of the least runs, at most

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
        let indices = &order.indices;
        let gather = |axis: usize| {
            let row = positions[axis];
            let mut to: Vec<f32> = Vec::with_capacity(indices.len() + LANES);
            to.extend(indices.iter().map(|&index| row[index as usize] as f32));
            to.resize(indices.len() + LANES, 0.0);
            to
        };
        let points = [gather(0), gather(1), gather(2)];
        let tiers = cut_runs(&points, &order.merges, SEEKERS, 16);
        let drawn: Vec<Drawn> = count_anchors(header, ids.len())
            .into_iter()
            .enumerate()
            .map(|(level, count)| {
                Drawn::new(&order, &points, sampler.choose(level, count), ids, positions)
            })
            .collect();
        let mut sampling = Sampling { ids: ids.to_vec(), order, points, tiers, ..Self::default() };
        for (number, level) in drawn.iter().enumerate() {
            let parents = match drawn.get(number + 1) {
                Some(coarser) => level.find_parents(coarser),
                None => vec![0; level.anchors.ids.len()],
            };
            sampling.levels.push(AnchorLevel { parents, ..level.anchors.clone() });
        }
        for level in drawn {
            sampling.ranks.push(rank(&level.places, &sampling.tiers[0].starts));
            sampling.indices.push(level.index);
        }
        sampling
    }
}

/// A level of anchors.
struct Drawn {
    anchors: AnchorLevel,
    index: Index,
    /// Of each of the index's anchors, the Gaussian's place in Morton order.
    places: Vec<u32>,
    merges: Vec<u8>,
    /// For each anchor in Morton order its number, and where in the index is what is at its place.
    members: Vec<(u32, u32)>,
}

impl Drawn {
    /// The level whose anchors are at these places of the Morton order.
    fn new(
        order: &Order,
        gaussians: &Points,
        chosen: Vec<u32>,
        ids: &[u32],
        positions: [&[i32]; 3],
    ) -> Self {
        let mut indices: Vec<u32> =
            chosen.iter().map(|&place| order.indices[place as usize]).collect();
        let numbers_of = number(&indices, ids.len());
        let mut places: Vec<u32> = Vec::with_capacity(chosen.len());
        let (mut merges, mut numbers, mut members) = (Vec::new(), Vec::new(), Vec::new());
        for (&place, &number) in chosen.iter().zip(&numbers_of) {
            let merge = match places.last() {
                Some(&before) => order.merge_with(before, place),
                None => order.merges[0],
            };
            if merge > 0 {
                places.push(place);
                merges.push(merge);
                numbers.push(number);
            }
            members.push((number, places.len() as u32 - 1));
        }
        indices.sort_unstable();
        let row = |axis: usize| indices.iter().map(|&i| positions[axis][i as usize]).collect();
        let anchors = AnchorLevel {
            ids: indices.iter().map(|&i| ids[i as usize]).collect(),
            positions: [row(0), row(1), row(2)],
            parents: Vec::new(),
        };
        let point = |axis: usize| {
            let of = &gaussians[axis];
            let mut to: Vec<f32> = places.iter().map(|&place| of[place as usize]).collect();
            to.resize(places.len() + LANES, 0.0);
            to
        };
        let index = Index::new([point(0), point(1), point(2)], numbers, &merges);
        Drawn { anchors, index, places, merges, members }
    }

    /// [6.5] the parent is the anchor of the next level that the own Gaussian follows.
    fn find_parents(&self, coarser: &Drawn) -> Vec<u32> {
        let tiers = cut_runs(&self.index.points, &self.merges, SEEKERS, 16);
        let place = |&start: &u32| self.places.get(start as usize).map_or(u32::MAX, |&place| place);
        let starts: Vec<u32> = tiers[0].starts.iter().map(place).collect();
        let ranks = rank(&coarser.places, &starts);
        let seekers = Seekers { points: &self.index.points, tiers: &tiers };
        let mut answers = vec![0; self.places.len()];
        Search {
            seekers,
            reach: &reach(seekers, &coarser.index, &ranks),
            index: &coarser.index,
            moving: &Moving::new(&coarser.index, &vec![true; coarser.members.len()]),
            resolved: &mut unresolved(&tiers),
        }
        .run(&mut |point, place| answers[point] = coarser.index.numbers[place as usize]);
        let mut parents = vec![0; self.members.len()];
        for &(number, place) in &self.members {
            parents[number as usize] = answers[place as usize];
        }
        parents
    }
}

/// Of each tier, that no run is done.
pub fn unresolved(tiers: &[Tier]) -> Vec<Vec<bool>> {
    tiers.iter().map(|tier| vec![false; tier.count()]).collect()
}

/// The number of each of some of `count` Gaussians: how many of them have a lower index.
fn number(indices: &[u32], count: usize) -> Vec<u32> {
    let mut members = vec![0_u64; count / 64 + 1];
    for &index in indices {
        members[index as usize / 64] |= 1 << (index % 64);
    }
    let mut before = Vec::with_capacity(members.len());
    let mut sum = 0;
    for word in &members {
        before.push(sum);
        sum += word.count_ones();
    }
    let number = |&index: &u32| {
        let (word, bit) = (index as usize / 64, 1_u64 << (index % 64));
        before[word] + (members[word] & (bit - 1)).count_ones()
    };
    indices.iter().map(number).collect()
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
