//! Which anchors may be nearest to any point of a box: lists that get shorter and finer from
//! box to part.
//!
//! Squared distances are summed up in f32 and bounds are rounded up: some anchors more may be
//! listed, none that counts is not.

use super::index::{Boxes, Eight, Index};
use super::runs::{Bounds, LANES};

/// More than three roundings to 24 bits can lose.
pub const ROUNDED: f32 = 1.0 + 1.0 / (1 << 20) as f32;

/// What is listed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Nodes of a tier.
    Nodes(usize),
    /// Anchors themselves.
    #[default]
    Points,
}

/// Anchors, or nodes of them, that are near some box.
#[derive(Clone, Debug, Default)]
pub struct Near {
    kind: Kind,
    count: usize,
    places: Vec<u32>,
    points: Vec<[Eight; 3]>,
    nodes: Vec<u32>,
}

/// A box, and how far around it.
struct Around {
    low: [Eight; 3],
    high: [Eight; 3],
    reach: Eight,
}

impl Near {
    /// All nodes of the widest tier.
    pub fn all(index: &Index) -> Self {
        let tier = index.tiers.len() - 1;
        let count = index.tiers[tier].count();
        let places = (0..count as u32).collect();
        Near { kind: Kind::Nodes(tier), count, places, ..Near::default() }
    }

    /// What is listed.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Nodes of the tier, or places of anchors.
    pub fn places(&self) -> &[u32] {
        &self.places[..self.count]
    }

    /// Of a list of anchors, where they are; behind the last, such as are nowhere.
    pub fn points(&self) -> &[[Eight; 3]] {
        &self.points[..blocks(self.count)]
    }

    /// Make this the list of what of another is within a squared distance of a box, with parts
    /// in the place of nodes: once, and further as long as few are listed.
    pub fn narrow(&mut self, from: &Near, index: &Index, bounds: &Bounds, reach: f32, few: usize) {
        let around = Around::new(bounds, reach * ROUNDED);
        match from.kind {
            Kind::Points => self.keep_points(from, &around),
            Kind::Nodes(tier) => self.keep_parts(from.places(), tier, index, &around),
        }
        while let (Kind::Nodes(tier), true) = (self.kind, self.count <= few) {
            self.expand(tier, index, &around);
        }
        if self.kind == Kind::Points {
            self.gather(index);
        }
    }

    /// Put parts in the place of nodes.
    fn expand(&mut self, tier: usize, index: &Index, around: &Around) {
        let mut nodes = std::mem::take(&mut self.nodes);
        nodes.clear();
        nodes.extend_from_slice(self.places());
        self.keep_parts(&nodes, tier, index, around);
        self.nodes = nodes;
    }

    fn keep_points(&mut self, from: &Near, around: &Around) {
        self.begin(Kind::Points, blocks(from.count));
        for (block, points) in from.points().iter().enumerate() {
            let near = around.reaches(points, points);
            let places = &from.places[LANES * block..LANES * (block + 1)];
            self.keep(near, |lane| places[lane]);
        }
    }

    fn keep_parts(&mut self, nodes: &[u32], tier: usize, index: &Index, around: &Around) {
        let starts = &index.tiers[tier].starts;
        if tier == 0 {
            self.begin(Kind::Points, nodes.len());
            for &node in nodes {
                let points = &index.leaves[node as usize];
                let first = starts[node as usize];
                self.keep(around.reaches(points, points), |lane| first + lane as u32);
            }
        } else {
            self.begin(Kind::Nodes(tier - 1), nodes.len());
            let boxes = &index.boxes[tier - 1];
            for &node in nodes {
                let Boxes { low, high } = &boxes[node as usize];
                let first = starts[node as usize];
                self.keep(around.reaches(low, high), |lane| first + lane as u32);
            }
        }
    }

    fn begin(&mut self, kind: Kind, blocks: usize) {
        (self.kind, self.count) = (kind, 0);
        if self.places.len() < LANES * (blocks + 1) {
            self.places.resize(LANES * (blocks + 1), 0);
        }
    }

    /// List those of eight that are near.
    #[inline(always)]
    fn keep(&mut self, near: [bool; LANES], place: impl Fn(usize) -> u32) {
        let places = &mut self.places[self.count..self.count + LANES];
        let mut found = 0;
        for lane in 0..LANES {
            places[found & (LANES - 1)] = place(lane); // without a branch; the next writes over it
            found += usize::from(near[lane]);
        }
        self.count += found;
    }

    /// Look up where the anchors are.
    fn gather(&mut self, index: &Index) {
        let blocks = blocks(self.count);
        if self.points.len() < blocks {
            self.points.resize(blocks, [[0.0; LANES]; 3]);
        }
        if blocks > 0 {
            self.points[blocks - 1] = [[f32::MAX; LANES]; 3];
        }
        let [xs, ys, zs] = &index.points;
        for (places, block) in self.places[..self.count].chunks(LANES).zip(&mut self.points) {
            for (lane, &place) in places.iter().enumerate() {
                let place = place as usize;
                (block[0][lane], block[1][lane], block[2][lane]) =
                    (xs[place], ys[place], zs[place]);
            }
        }
    }
}

impl Around {
    fn new(bounds: &Bounds, reach: f32) -> Self {
        let all = |number| [number; LANES];
        Around { low: bounds.low.map(all), high: bounds.high.map(all), reach: all(reach) }
    }

    /// Which of eight boxes are within reach.
    #[inline(always)]
    fn reaches(&self, low: &[Eight; 3], high: &[Eight; 3]) -> [bool; LANES] {
        let mut squares = [0.0; LANES];
        for axis in 0..3 {
            for lane in 0..LANES {
                let below = self.low[axis][lane] - high[axis][lane];
                let above = low[axis][lane] - self.high[axis][lane];
                let gap = if below > above { below } else { above };
                let gap = if gap > 0.0 { gap } else { 0.0 };
                squares[lane] += gap * gap;
            }
        }
        let mut near = [false; LANES];
        for lane in 0..LANES {
            near[lane] = squares[lane] <= self.reach[lane];
        }
        near
    }
}

fn blocks(count: usize) -> usize {
    (count + LANES - 1) / LANES
}
