//! Points in Morton order, cut into runs that form a tree of boxes.
//!
//! A sequence is cut where cells end, so that runs are compact and their boxes tight; many points at
//! one position are cut by number. Runs are grouped into wider runs in the same way.

use std::ops::Range;

/// Number of points processed together, and maximum number of parts of a run of anchors.
pub const LANES: usize = 8;
const TOP: usize = 32; // maximum number of runs of the top tier

/// Coordinates `[3][n + LANES]`, of which the last `LANES` are padding. They are below 2^24 in
/// magnitude, so that f32 represents them exactly.
pub type Points = [Vec<f32>; 3];

/// The bounding box of points.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Least coordinates.
    pub low: [f32; 3],
    /// Greatest coordinates.
    pub high: [f32; 3],
}

/// Runs of about the same size.
#[derive(Clone, Debug, Default)]
pub struct Tier {
    /// The first part of each run, and the number of all parts.
    pub starts: Vec<u32>,
    /// The bounding box of each run.
    pub bounds: Vec<Bounds>,
}

impl Tier {
    /// The number of runs.
    pub fn count(&self) -> usize {
        self.bounds.len()
    }

    /// The parts of a run.
    pub fn parts(&self, run: usize) -> Range<usize> {
        self.starts[run] as usize..self.starts[run + 1] as usize
    }
}

impl Bounds {
    /// The bounding box of two.
    pub fn join(self, other: &Bounds) -> Bounds {
        let [low, high] = [0, 1].map(|_| [0.0; 3]);
        let mut joined = Bounds { low, high };
        for axis in 0..3 {
            joined.low[axis] = least(self.low[axis], other.low[axis]);
            joined.high[axis] = greatest(self.high[axis], other.high[axis]);
        }
        joined
    }
}

/// Cut points into runs of at most `most`, and group these by at most `fan`: lowest tier first.
///
/// `merges` are those of `Order`; there is at least one point.
pub fn cut_runs(points: &Points, merges: &[u8], most: usize, fan: usize) -> Vec<Tier> {
    let starts = cut(merges, most);
    let mut merges: Vec<u8> =
        starts[1..].iter().zip(&starts).map(|(_, &s)| merges[s as usize]).collect();
    let mut tiers = vec![Tier { bounds: bound(points, &starts), starts }];
    while merges.len() > TOP {
        let below = &tiers[tiers.len() - 1].bounds;
        let starts = cut(&merges, fan);
        merges = starts[1..].iter().zip(&starts).map(|(_, &s)| merges[s as usize]).collect();
        let join = |run: &[u32]| {
            let parts = &below[run[0] as usize..run[1] as usize];
            parts.iter().fold(parts[0], Bounds::join)
        };
        tiers.push(Tier { bounds: starts.windows(2).map(join).collect(), starts });
    }
    tiers
}

/// The first element of each run of at most `most` elements, and the end.
fn cut(merges: &[u8], most: usize) -> Vec<u32> {
    let mut starts = Vec::with_capacity(4 * merges.len() / most + 2);
    let mut first = 0;
    while first < merges.len() {
        starts.push(first as u32);
        let own = merges[first].max(1);
        // A rest that fits is only cut at the end of the cell that begins here.
        let fits = merges.len() - first <= most;
        let end = if fits { merges.len() } else { first + most + 1 };
        let (mut widest, mut next) = (0, end.min(first + most));
        for (place, &merge) in (first + 1..end).zip(&merges[first + 1..end]) {
            if merge >= own {
                next = place;
                break;
            }
            if merge > widest && !fits {
                (widest, next) = (merge, place);
            }
        }
        first = next;
    }
    // Cells with a single element each would lead to an endless number of tiers.
    if starts.len() > merges.len() / 2 {
        starts = (0..merges.len()).step_by(most).map(|start| start as u32).collect();
    }
    starts.push(merges.len() as u32);
    starts
}

fn bound(points: &Points, starts: &[u32]) -> Vec<Bounds> {
    let [xs, ys, zs] = points;
    let bound = |run: &[u32]| {
        let run = run[0] as usize..run[1] as usize;
        let (xs, ys, zs) = (&xs[run.clone()], &ys[run.clone()], &zs[run]);
        let first = [xs[0], ys[0], zs[0]];
        let mut bounds = Bounds { low: first, high: first };
        for ((&x, &y), &z) in xs.iter().zip(ys).zip(zs) {
            bounds = bounds.join(&Bounds { low: [x, y, z], high: [x, y, z] });
        }
        bounds
    };
    starts.windows(2).map(bound).collect()
}

fn least(a: f32, b: f32) -> f32 {
    if a < b {
        a
    } else {
        b
    }
}

fn greatest(a: f32, b: f32) -> f32 {
    if a > b {
        a
    } else {
        b
    }
}
