//! A search index: the anchors of a level in a tree of boxes with up to eight parts each.

use super::runs::{cut_runs, Bounds, Points, Tier, LANES};

/// One number for each of eight lanes.
pub type Eight = [f32; LANES];
/// A coordinate beyond all distances, whose square f32 can represent.
pub const NOWHERE: f32 = 1e18;

/// The boxes of the parts of a node; unused lanes are at `NOWHERE`.
#[derive(Clone, Copy, Debug)]
pub struct Boxes {
    /// Least coordinates.
    pub low: [Eight; 3],
    /// Greatest coordinates.
    pub high: [Eight; 3],
}

impl Boxes {
    /// Eight unused lanes.
    pub const NOWHERE: Boxes = Boxes { low: [[NOWHERE; LANES]; 3], high: [[NOWHERE; LANES]; 3] };

    /// Eight empty boxes.
    pub const NOTHING: Boxes = Boxes { low: [[NOWHERE; LANES]; 3], high: [[-NOWHERE; LANES]; 3] };

    /// Up to eight boxes.
    pub fn of(bounds: &[Bounds]) -> Self {
        let mut boxes = Boxes::NOWHERE;
        bounds.iter().enumerate().for_each(|(lane, bounds)| boxes.set(lane, bounds));
        boxes
    }

    /// The bounding box of all.
    pub fn join(&self) -> Bounds {
        let least = |row: Eight| row.iter().copied().fold(NOWHERE, f32::min);
        let greatest = |row: Eight| row.iter().copied().fold(-NOWHERE, f32::max);
        Bounds { low: self.low.map(least), high: self.high.map(greatest) }
    }

    /// Set the box of a lane.
    pub fn set(&mut self, lane: usize, bounds: &Bounds) {
        for axis in 0..3 {
            self.low[axis][lane] = bounds.low[axis];
            self.high[axis][lane] = bounds.high[axis];
        }
    }
}

/// The anchors of a level, indexed for search.
#[derive(Clone, Debug, Default)]
pub struct Index {
    /// Anchors in Morton order; of those at one position only the first.
    pub points: Points,
    /// The number of each anchor.
    pub numbers: Vec<u32>,
    /// The nodes over them, leaves first.
    pub tiers: Vec<Tier>,
    /// The anchors of each leaf.
    pub leaves: Vec<[Eight; 3]>,
    /// The boxes of the parts of each node, for the tiers above the leaves.
    pub boxes: Vec<Vec<Boxes>>,
    /// The boxes of all nodes of the top tier.
    pub top: Vec<Boxes>,
}

impl Index {
    /// Index anchors in Morton order, with their numbers, and `merges` as in `Order`.
    pub fn new(points: Points, numbers: Vec<u32>, merges: &[u8]) -> Self {
        let tiers = cut_runs(&points, merges, LANES, LANES);
        let leaves = (0..tiers[0].count())
            .map(|leaf| {
                let parts = tiers[0].parts(leaf);
                [0, 1, 2].map(|axis: usize| {
                    let mut eight = [NOWHERE; LANES];
                    eight[..parts.len()].copy_from_slice(&points[axis][parts.clone()]);
                    eight
                })
            })
            .collect();
        let boxes = tiers.windows(2).map(|pair| box_parts(&pair[1], &pair[0].bounds)).collect();
        let top = tiers[tiers.len() - 1].bounds.chunks(LANES).map(Boxes::of).collect();
        Index { points, numbers, tiers, leaves, boxes, top }
    }
}

fn box_parts(tier: &Tier, parts: &[Bounds]) -> Vec<Boxes> {
    (0..tier.count()).map(|node| Boxes::of(&parts[tier.parts(node)])).collect()
}
