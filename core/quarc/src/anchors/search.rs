//! The nearest anchor of points in Morton order: SPEC 6.4.

use super::index::{Eight, Index};
use super::near::{Kind, Near, ROUNDED};
use super::nearest::{eight, nearest, nearest_exactly};
use super::order::stands_before;
use super::runs::{Bounds, Points, Tier, LANES};
use std::ops::Range;

const BESIDE: usize = 3; // anchors beside a run in Morton order that bound how far it is to one

const FEW: usize = 16; // nodes whose parts are listed
const MANY: usize = 128; // nodes that are too many to be held against a run

/// Points that look for their anchors, and the runs that they are in.
#[derive(Clone, Copy)]
pub struct Seekers<'a> {
    /// In Morton order.
    pub points: &'a Points,
    /// The least runs first.
    pub tiers: &'a [Tier],
}

/// How far at most it is, squared, from any point of each run to its anchor; tier by tier.
pub type Reach = Vec<Vec<f32>>;

/// Bound how far it is; `ranks` tell how many anchors of the index stand before each of the least
/// runs in Morton order, and how many there are.
pub fn reach(seekers: Seekers, index: &Index, ranks: &[u32]) -> Reach {
    let leaf = |leaf: usize| {
        let low = (ranks[leaf] as usize).saturating_sub(BESIDE);
        let high = (ranks[leaf + 1] as usize + BESIDE).min(index.numbers.len());
        let parts = seekers.tiers[0].parts(leaf);
        let mut most = 0.0;
        for first in parts.clone().step_by(LANES) {
            let squares = least_squares(seekers.points, first, &index.points, low..high);
            for &square in &squares[..LANES.min(parts.end - first)] {
                most = if square > most { square } else { most };
            }
        }
        most * ROUNDED
    };
    let mut reach: Reach = vec![(0..seekers.tiers[0].count()).map(leaf).collect()];
    for tier in &seekers.tiers[1..] {
        let below = &reach[reach.len() - 1];
        let of = |run| below[tier.parts(run)].iter().copied().fold(0.0, f32::max);
        let of_tier = (0..tier.count()).map(of).collect();
        reach.push(of_tier);
    }
    reach
}

/// For eight points the squared distance to the nearest of some anchors, nearly.
fn least_squares(points: &Points, first: usize, anchors: &Points, some: Range<usize>) -> Eight {
    let at = [0, 1, 2].map(|axis: usize| eight(&points[axis], first));
    let mut least = [f32::MAX; LANES];
    let [xs, ys, zs] = [0, 1, 2].map(|axis: usize| &anchors[axis][some.clone()]);
    for ((&ax, &ay), &az) in xs.iter().zip(ys).zip(zs) {
        for k in 0..LANES {
            let (x, y, z) = (at[0][k] - ax, at[1][k] - ay, at[2][k] - az);
            let square = x * x + y * y + z * z;
            least[k] = if square < least[k] { square } else { least[k] };
        }
    }
    least
}

/// Which anchors move, and which nodes of an index have such.
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

    /// Whether anything of a list moves.
    fn any(&self, near: &Near) -> bool {
        let moving = self.of(near.kind());
        near.places().iter().any(|&place| moving[place as usize])
    }

    /// Whether anything of a list moves that is within a squared distance of a box.
    fn any_within(&self, near: &Near, bounds: &Bounds, reach: f32) -> bool {
        let moving = self.of(near.kind());
        let listed = near.places().iter().enumerate();
        listed
            .filter(|(_, &place)| moving[place as usize])
            .any(|(i, _)| near.gap(i, bounds) <= reach)
    }

    fn of(&self, kind: Kind) -> &[bool] {
        match kind {
            Kind::Nodes(tier) => &self.tiers[tier],
            Kind::Points => &self.places,
        }
    }
}

/// Of each tier, that no run is done.
pub fn unresolved(tiers: &[Tier]) -> Vec<Vec<bool>> {
    tiers.iter().map(|tier| vec![false; tier.count()]).collect()
}

/// A search for the anchors of those points that may follow one that moves.
pub struct Search<'a> {
    /// Who looks.
    pub seekers: Seekers<'a>,
    /// How far.
    pub reach: &'a Reach,
    /// For whom.
    pub index: &'a Index,
    /// Which of the anchors move.
    pub moving: &'a Moving,
    /// Of each tier of the seekers, which runs are done.
    pub resolved: &'a mut [Vec<bool>],
}

impl Search<'_> {
    /// Tell the places in the index of the anchors of all that may follow one that moves.
    ///
    /// `answer` is called with the place of a point and that of its anchor.
    pub fn run(&mut self, answer: &mut impl FnMut(usize, u32)) {
        let top = self.seekers.tiers.len() - 1;
        let mut lists = vec![Near::default(); top + 2];
        lists.push(Near::all(self.index));
        for run in 0..self.seekers.tiers[top].count() {
            self.visit(top, run, &mut lists, answer);
        }
    }

    /// `lists` are one to spare, one to each tier up to this, and that of the next wider run.
    fn visit(
        &mut self,
        tier: usize,
        run: usize,
        lists: &mut [Near],
        answer: &mut impl FnMut(usize, u32),
    ) {
        if self.resolved[tier][run] {
            return;
        }
        let bounds = &self.seekers.tiers[tier].bounds[run];
        let parts = self.seekers.tiers[tier].parts(run);
        let (lists, wider) = lists.split_at_mut(tier + 2);
        let near = &mut lists[tier + 1];
        if !self.moving.any_within(&wider[0], bounds, self.reach[tier][run] * ROUNDED) {
            return;
        }
        let few = if tier == 0 { MANY } else { FEW };
        near.narrow(&wider[0], self.index, bounds, self.reach[tier][run], few);
        if !self.moving.any(near) {
            return;
        }
        if tier == 0 {
            self.bind(parts, lists, answer);
            self.resolved[0][run] = true;
        } else {
            for part in parts.clone() {
                self.visit(tier - 1, part, lists, answer);
            }
            self.resolved[tier][run] = self.resolved[tier - 1][parts].iter().all(|&done| done);
        }
    }

    /// Bind the points of a least run by its list.
    fn bind(&self, parts: Range<usize>, lists: &mut [Near], answer: &mut impl FnMut(usize, u32)) {
        let (alone, lists) = lists.split_first_mut().expect("a list to spare");
        let near = &lists[0];
        if near.kind() == Kind::Points {
            nearest(self.seekers.points, parts, near, self.index, answer);
        } else {
            for point in parts {
                let at = [0, 1, 2].map(|axis: usize| self.seekers.points[axis][point]);
                answer(point, bind_alone(at, near, alone, self.index));
            }
        }
    }
}

/// The place of the anchor nearest to a point, which is among those of a list of nodes.
pub fn bind_alone(at: [f32; 3], from: &Near, near: &mut Near, index: &Index) -> u32 {
    let bounds = Bounds { low: at, high: at };
    near.narrow(from, index, &bounds, reach_alone(at, index), usize::MAX);
    nearest_exactly(at, near, index, f32::MAX)
}

/// A squared distance within which there surely is an anchor: to one of those that stand beside
/// the point in Morton order.
fn reach_alone(at: [f32; 3], index: &Index) -> f32 {
    let point = |place: usize| [0, 1, 2].map(|axis: usize| index.points[axis][place]);
    let (mut low, mut high) = (0, index.numbers.len());
    while low < high {
        let middle = (low + high) / 2;
        if stands_before(point(middle), at) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    let beside = low.saturating_sub(BESIDE)..(low + BESIDE).min(index.numbers.len());
    let squares = beside.map(|place| {
        let [x, y, z] = point(place);
        let (x, y, z) = (x - at[0], y - at[1], z - at[2]);
        x * x + y * y + z * z
    });
    squares.fold(f32::MAX, f32::min) * ROUNDED
}
