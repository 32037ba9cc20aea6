//! The nearest anchors of points in Morton order: SPEC 6.4.

use super::alone::nearest_alone;
use super::index::{Boxes, Eight, Index};
use super::near::{Kind, Near, Reach, ROUNDED};
use super::nearest::{eight, nearest};
use super::runs::{Points, Tier, LANES};
use crate::parallel::{each, ranges};
use std::ops::Range;

const BESIDE: usize = 4; // anchors beside a run in Morton order that bound its distances
const LEAVES: usize = 64; // minimum number of runs per task
const FEW: usize = 20; // maximum number of nodes that are replaced by their parts
const MANY: usize = 128; // the same for a run of the lowest tier

/// The points whose anchors are searched, and their runs.
#[derive(Clone, Copy)]
pub struct Seekers<'a> {
    /// In Morton order.
    pub points: &'a Points,
    /// The runs, lowest tier first.
    pub tiers: &'a [Tier],
}

/// Bounds on the anchors that the points of each run follow, tier by tier.
pub type Reaches = Vec<Vec<Reach>>;

/// Find the bounds. `ranks` are the numbers of anchors before each run of the lowest tier in Morton
/// order, followed by the number of all anchors.
pub fn reach(seekers: Seekers, index: &Index, ranks: &[u32]) -> Reaches {
    let leaf = |leaf: usize| {
        let low = (ranks[leaf] as usize).saturating_sub(BESIDE);
        let high = (ranks[leaf + 1] as usize + BESIDE).min(index.numbers.len());
        let anchors = [0, 1, 2].map(|axis: usize| &index.points[axis][low..high]);
        let parts = seekers.tiers[0].parts(leaf);
        let (mut spheres, mut squares) = (Boxes::NOTHING, [0.0; LANES]);
        for first in parts.clone().step_by(LANES) {
            // Eight points of the run, some of them twice; or all of fewer, padded with the first.
            let first = first.min(parts.end.max(parts.start + LANES) - LANES);
            let mut at = [0, 1, 2].map(|axis: usize| *eight(&seekers.points[axis], first));
            for lane in parts.len()..LANES {
                at.iter_mut().for_each(|row| row[lane] = row[0]);
            }
            bound_spheres(&at, anchors, &mut spheres, &mut squares);
        }
        let square = squares.iter().copied().fold(0.0, f32::max) * ROUNDED;
        Reach { bounds: seekers.tiers[0].bounds[leaf], square, within: spheres.join() }
    };
    let leaves = ranges(seekers.tiers[0].count(), LEAVES);
    let leaves = each(leaves, &|leaves| leaves.map(leaf).collect::<Vec<_>>());
    let mut reach: Reaches = vec![leaves.concat()];
    for tier in &seekers.tiers[1..] {
        let below = &reach[reach.len() - 1];
        let of = |run: usize| {
            let parts = &below[tier.parts(run)];
            let square = parts.iter().map(|part| part.square).fold(0.0, f32::max);
            let within = parts.iter().fold(parts[0].within, |a, part| a.join(&part.within));
            Reach { bounds: tier.bounds[run], square, within }
        };
        let of_tier = (0..tier.count()).map(of).collect();
        reach.push(of_tier);
    }
    reach
}

/// Extend boxes, one for each lane, by the spheres around points to the nearest of some anchors.
#[inline(never)]
fn bound_spheres(at: &[Eight; 3], anchors: [&[f32]; 3], boxes: &mut Boxes, most: &mut Eight) {
    let mut squares = [f32::MAX; LANES];
    for ((&ax, &ay), &az) in anchors[0].iter().zip(anchors[1]).zip(anchors[2]) {
        for k in 0..LANES {
            let (x, y, z) = (at[0][k] - ax, at[1][k] - ay, at[2][k] - az);
            let square = x * x + y * y + z * z;
            squares[k] = if square < squares[k] { square } else { squares[k] };
        }
    }
    for k in 0..LANES {
        most[k] = if squares[k] > most[k] { squares[k] } else { most[k] };
    }
    for (axis, at) in at.iter().enumerate() {
        for k in 0..LANES {
            let radius = at_most(squares[k]);
            let (low, high) = (at[k] - radius, at[k] + radius);
            boxes.low[axis][k] = if low < boxes.low[axis][k] { low } else { boxes.low[axis][k] };
            boxes.high[axis][k] =
                if high > boxes.high[axis][k] { high } else { boxes.high[axis][k] };
        }
    }
}

/// An upper bound on the root of an approximate square, with a margin for rounding errors: two
/// roundings to f32, and one when it is added to a coordinate.
fn at_most(square: f32) -> f32 {
    square.sqrt() * ROUNDED + 4.0
}

/// Which anchors move, and which nodes of an index contain any that do.
pub struct Moving {
    places: Vec<bool>,
    tiers: Vec<Vec<bool>>,
}

impl Moving {
    /// `moves` by number.
    pub fn new(index: &Index, moves: &[bool]) -> Self {
        let places: Vec<bool> = index.numbers.iter().map(|&n| moves[n as usize]).collect();
        let mut tiers: Vec<Vec<bool>> = Vec::new();
        for tier in &index.tiers {
            let below = tiers.last().unwrap_or(&places);
            let any = |node| below[tier.parts(node)].contains(&true);
            let tier = (0..tier.count()).map(any).collect();
            tiers.push(tier);
        }
        Moving { places, tiers }
    }

    /// Whether any entry of a list moves.
    fn any(&self, kind: Kind, places: &[u32]) -> bool {
        let moving = match kind {
            Kind::Nodes(tier) => &self.tiers[tier],
            Kind::Points => &self.places,
        };
        places.iter().any(|&place| moving[place as usize])
    }
}

/// A search for the anchors of the points that may follow a moving anchor.
pub struct Search<'a> {
    /// The points.
    pub seekers: Seekers<'a>,
    /// Bounds on their anchors.
    pub reach: &'a Reaches,
    /// The anchors.
    pub index: &'a Index,
    /// Which of the anchors move.
    pub moving: &'a Moving,
    /// For each tier of runs, which have known bindings.
    pub resolved: &'a [Vec<bool>],
}

/// The result of a search.
#[derive(Default)]
pub struct Found {
    /// Runs of the lowest tier with the anchors of all points found.
    pub runs: Vec<usize>,
    /// The places of these anchors in the index, run by run.
    pub places: Vec<u32>,
}

impl Search<'_> {
    /// Search the anchors of all points that may follow a moving anchor.
    pub fn run(&self) -> Vec<Found> {
        let top = self.seekers.tiers.len() - 1;
        let runs = ranges(self.seekers.tiers[top].count(), 1);
        each(runs, &|runs| {
            let mut lists = vec![Near::default(); top + 1];
            lists.push(Near::all(self.index));
            let mut found = Found::default();
            runs.for_each(|run| self.visit(top, run, &mut lists, &mut found));
            found
        })
    }

    /// Search within a run. `lists` has one list for each tier up to this one, and the list of the
    /// next wider run.
    fn visit(&self, tier: usize, run: usize, lists: &mut [Near], found: &mut Found) {
        if self.resolved[tier][run] {
            return;
        }
        let reach = &self.reach[tier][run];
        let parts = self.seekers.tiers[tier].parts(run);
        let (lists, wider) = lists.split_at_mut(tier + 1);
        let near = &mut lists[tier];
        let few = if tier == 0 { MANY } else { FEW };
        let moving = self.moving;
        if !near.narrow(&wider[0], self.index, reach, few, |kind, places| moving.any(kind, places))
        {
            return;
        }
        if tier == 0 {
            self.bind(parts, near, &mut found.places);
            found.runs.push(run);
        } else {
            parts.for_each(|part| self.visit(tier - 1, part, lists, found));
        }
    }

    /// Bind the points of a run of the lowest tier by its list.
    fn bind(&self, parts: Range<usize>, near: &Near, places: &mut Vec<u32>) {
        if near.kind() == Kind::Points {
            nearest(self.seekers.points, parts, near, self.index, places);
        } else {
            for point in parts {
                let at = [0, 1, 2].map(|axis: usize| self.seekers.points[axis][point]);
                places.push(nearest_alone(at, self.index));
            }
        }
    }
}
