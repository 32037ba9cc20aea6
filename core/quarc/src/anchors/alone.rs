//! The anchor nearest to a single point, by a descent through the boxes: SPEC 6.4.

use super::index::{Boxes, Eight, Index};
use super::near::ROUNDED;
use super::order::precedes;
use super::runs::LANES;

const BESIDE: usize = 4; // anchors on each side in Morton order that bound the distance

/// The place in an index of the anchor nearest to a point, by (squared distance, number).
pub fn nearest_alone(at: [f32; 3], index: &Index) -> u32 {
    let within = reach(at, index) * ROUNDED;
    let mut descent = Descent { at, index, within, best: (i64::MAX, u32::MAX, u32::MAX) };
    for (number, boxes) in index.top.iter().enumerate() {
        descent.visit_near(index.tiers.len() - 1, LANES * number, boxes);
    }
    descent.best.2
}

/// The search for one point.
struct Descent<'a> {
    at: [f32; 3],
    index: &'a Index,
    /// Upper bound on the squared distance, rounded up.
    within: f32,
    /// Nearest anchor so far: squared distance, number, place.
    best: (i64, u32, u32),
}

impl Descent<'_> {
    /// Visit the nodes of eight that are near enough.
    fn visit_near(&mut self, tier: usize, first: usize, boxes: &Boxes) {
        let squares = self.squares(&boxes.low, &boxes.high);
        for (lane, square) in squares.into_iter().enumerate() {
            if square > self.within {
                continue;
            }
            let node = first + lane;
            let part = self.index.tiers[tier].starts[node] as usize;
            if tier == 0 {
                self.visit_leaf(part, &self.index.leaves[node]);
            } else {
                self.visit_near(tier - 1, part, &self.index.boxes[tier - 1][node]);
            }
        }
    }

    /// Compare the anchors of a leaf, exactly if they may be the nearest.
    fn visit_leaf(&mut self, first: usize, points: &[Eight; 3]) {
        for (lane, square) in self.squares(points, points).into_iter().enumerate() {
            if square > self.within {
                continue;
            }
            let apart = [0, 1, 2].map(|axis: usize| (points[axis][lane] - self.at[axis]) as i64);
            let exact = apart.iter().map(|apart| apart * apart).sum();
            let place = first + lane;
            self.best = self.best.min((exact, self.index.numbers[place], place as u32));
            self.within = self.within.min(square * ROUNDED);
        }
    }

    /// The approximate squared distances to eight boxes.
    fn squares(&self, low: &[Eight; 3], high: &[Eight; 3]) -> Eight {
        let mut squares = [0.0; LANES];
        for axis in 0..3 {
            for lane in 0..LANES {
                let below = self.at[axis] - high[axis][lane];
                let above = low[axis][lane] - self.at[axis];
                let gap = if below > above { below } else { above };
                let gap = if gap < 0.0 { 0.0 } else { gap };
                squares[lane] += gap * gap;
            }
        }
        squares
    }
}

/// The approximate squared distance to the nearest of the point's neighbors in Morton order.
fn reach(at: [f32; 3], index: &Index) -> f32 {
    let point = |place: usize| [0, 1, 2].map(|axis: usize| index.points[axis][place]);
    let (mut low, mut high) = (0, index.numbers.len());
    while low < high {
        let middle = (low + high) / 2;
        if precedes(point(middle), at) {
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
    squares.fold(f32::MAX, f32::min)
}
