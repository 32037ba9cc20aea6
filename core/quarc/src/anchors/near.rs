//! Lists of the anchors that may be nearest to a point of a box, which become shorter and finer
//! from a box to its parts.
//!
//! Squared distances are sums of f32, and bounds are rounded up: a list may contain a few anchors
//! too many, but lacks none that matters.

use super::index::{Boxes, Eight, Index, NOWHERE};
use super::runs::{Bounds, LANES};

/// A factor that exceeds the error of three roundings to 24 bits.
pub const ROUNDED: f32 = 1.0 + 1.0 / (1 << 20) as f32;

/// For each set of eight lanes, its lanes, ascending, followed by unused entries.
const LANES_OF: [[u8; LANES]; 256] = {
    let mut lanes_of = [[0; LANES]; 256];
    let mut set = 0;
    while set < 256 {
        let (mut lane, mut found) = (0, 0);
        while lane < LANES {
            if set >> lane & 1 == 1 {
                lanes_of[set][found] = lane as u8;
                found += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    lanes_of
};

/// The kind of entries of a list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Nodes of a tier.
    Nodes(usize),
    /// Anchors.
    #[default]
    Points,
}

/// The anchors, or nodes of anchors, that are near a box.
#[derive(Clone, Debug, Default)]
pub struct Near {
    kind: Kind,
    count: usize,
    places: Vec<u32>,
    points: Vec<[Eight; 3]>,
    boxes: Vec<Boxes>,
    nodes: Vec<u32>,
    marks: Vec<[u8; LANES]>,
}

/// A box, repeated in all lanes.
struct Around {
    low: [Eight; 3],
    high: [Eight; 3],
    wide_low: [Eight; 3],
    wide_high: [Eight; 3],
    square: Eight,
}

/// Bounds on the anchors that the points of a box follow.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// The bounding box of the points.
    pub bounds: Bounds,
    /// Greatest squared distance of the anchors from the box.
    pub square: f32,
    /// A box that contains the anchors.
    pub within: Bounds,
}

impl Near {
    /// All nodes of the top tier.
    pub fn all(index: &Index) -> Self {
        let tier = index.tiers.len() - 1;
        let count = index.tiers[tier].count();
        let mut places: Vec<u32> = (0..count as u32).collect();
        places.resize(count + LANES, 0);
        let mut near = Near { kind: Kind::Nodes(tier), count, places, ..Near::default() };
        near.gather(index);
        near
    }

    /// The kind of the entries.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// The listed nodes of the tier, or places of anchors.
    pub fn places(&self) -> &[u32] {
        &self.places[..self.count]
    }

    /// The positions of a list of anchors; unused lanes at the end are at `NOWHERE`.
    pub fn points(&self) -> &[[Eight; 3]] {
        &self.points[..blocks(self.count)]
    }

    /// Make this the list of the entries of another list that are within reach of a box, with nodes
    /// replaced by their parts as long as there are at most `few`.
    ///
    /// Returns false, with an incomplete list, if `matters` is false for the entries.
    pub fn narrow(
        &mut self,
        from: &Near,
        index: &Index,
        reach: &Reach,
        few: usize,
        matters: impl Fn(Kind, &[u32]) -> bool,
    ) -> bool {
        let around = Around::new(reach);
        let blocks = blocks(from.count);
        match from.kind {
            Kind::Points => mark_points(from.points[..blocks].iter(), &around, &mut self.marks),
            Kind::Nodes(_) => mark_boxes(from.boxes[..blocks].iter(), &around, &mut self.marks),
        }
        self.kind = from.kind;
        self.take(|block, lane| from.places[LANES * block + lane]);
        if !matters(self.kind, self.places()) {
            return false;
        }
        while let (Kind::Nodes(tier), true) = (self.kind, self.count <= few) {
            self.expand(tier, index, &around);
        }
        if !matters(self.kind, self.places()) {
            return false;
        }
        self.gather(index);
        true
    }

    /// Replace nodes by those of their parts that are near.
    fn expand(&mut self, tier: usize, index: &Index, around: &Around) {
        let mut nodes = std::mem::take(&mut self.nodes);
        nodes.clear();
        nodes.extend_from_slice(self.places());
        if tier == 0 {
            let leaves = nodes.iter().map(|&node| &index.leaves[node as usize]);
            mark_points(leaves, around, &mut self.marks);
            self.kind = Kind::Points;
        } else {
            let boxes = nodes.iter().map(|&node| &index.boxes[tier - 1][node as usize]);
            mark_boxes(boxes, around, &mut self.marks);
            self.kind = Kind::Nodes(tier - 1);
        }
        let starts = &index.tiers[tier].starts;
        self.take(|block, lane| starts[nodes[block] as usize] + lane as u32);
        self.nodes = nodes;
    }

    /// List the marked lanes of each block.
    fn take(&mut self, place: impl Fn(usize, usize) -> u32) {
        let room = LANES * (self.marks.len() + 1);
        if self.places.len() < room {
            self.places.resize(room, 0);
        }
        let mut count = 0;
        for (block, &marks) in self.marks.iter().enumerate() {
            // The highest byte of the product contains the marks as bits.
            let set = u64::from_le_bytes(marks).wrapping_mul(0x0102_0408_1020_4080) >> 56;
            // Eight entries are written without a branch; the next block overwrites the unused.
            let places = &mut self.places[count..count + LANES];
            for (to, &lane) in places.iter_mut().zip(&LANES_OF[set as usize]) {
                *to = place(block, usize::from(lane) % LANES);
            }
            count += set.count_ones() as usize;
        }
        self.count = count;
    }

    /// Look up the positions or boxes of all entries.
    fn gather(&mut self, index: &Index) {
        let blocks = blocks(self.count);
        let lists = self.places[..self.count].chunks(LANES);
        match self.kind {
            Kind::Points => {
                if self.points.len() < blocks {
                    self.points.resize(blocks, [[0.0; LANES]; 3]);
                }
                if blocks > 0 {
                    self.points[blocks - 1] = [[NOWHERE; LANES]; 3];
                }
                let [xs, ys, zs] = &index.points;
                for (places, [x, y, z]) in lists.zip(&mut self.points) {
                    for (lane, &place) in places.iter().enumerate() {
                        let place = place as usize;
                        (x[lane], y[lane], z[lane]) = (xs[place], ys[place], zs[place]);
                    }
                }
            }
            Kind::Nodes(tier) => {
                if self.boxes.len() < blocks {
                    self.boxes.resize(blocks, Boxes::NOWHERE);
                }
                if blocks > 0 {
                    self.boxes[blocks - 1] = Boxes::NOWHERE;
                }
                let bounds = &index.tiers[tier].bounds;
                for (nodes, boxes) in lists.zip(&mut self.boxes) {
                    for (lane, &node) in nodes.iter().enumerate() {
                        boxes.set(lane, &bounds[node as usize]);
                    }
                }
            }
        }
    }
}

/// Mark which points of blocks are near a box.
#[inline(never)]
fn mark_points<'a>(
    blocks: impl ExactSizeIterator<Item = &'a [Eight; 3]>,
    around: &Around,
    marks: &mut Vec<[u8; LANES]>,
) {
    marks.resize(blocks.len(), [0; LANES]);
    for (points, marks) in blocks.zip(marks) {
        around.mark(points, points, marks);
    }
}

/// Mark which boxes of blocks are near a box.
#[inline(never)]
fn mark_boxes<'a>(
    blocks: impl ExactSizeIterator<Item = &'a Boxes>,
    around: &Around,
    marks: &mut Vec<[u8; LANES]>,
) {
    marks.resize(blocks.len(), [0; LANES]);
    for (boxes, marks) in blocks.zip(marks) {
        around.mark(&boxes.low, &boxes.high, marks);
    }
}

impl Around {
    fn new(reach: &Reach) -> Self {
        let all = |number| [number; LANES];
        Around {
            low: reach.bounds.low.map(all),
            high: reach.bounds.high.map(all),
            wide_low: reach.within.low.map(all),
            wide_high: reach.within.high.map(all),
            square: all(reach.square * ROUNDED),
        }
    }

    /// Mark which of eight boxes are within reach.
    #[inline(always)]
    fn mark(&self, low: &[Eight; 3], high: &[Eight; 3], marks: &mut [u8; LANES]) {
        let mut squares = [0.0; LANES];
        for axis in 0..3 {
            for lane in 0..LANES {
                let below = self.low[axis][lane] - high[axis][lane];
                let above = low[axis][lane] - self.high[axis][lane];
                let gap = if below > above { below } else { above };
                let gap = if gap < 0.0 { 0.0 } else { gap };
                squares[lane] += gap * gap;
            }
        }
        for lane in 0..LANES {
            let meets = |axis: usize| {
                (low[axis][lane] <= self.wide_high[axis][lane])
                    & (high[axis][lane] >= self.wide_low[axis][lane])
            };
            let near = squares[lane] <= self.square[lane];
            marks[lane] = u8::from(meets(0) & meets(1) & meets(2) & near);
        }
    }
}

fn blocks(count: usize) -> usize {
    (count + LANES - 1) / LANES
}
