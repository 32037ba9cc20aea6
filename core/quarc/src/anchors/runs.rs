//! Points in Morton order, cut into runs that make a tree of boxes.
//!
//! A sequence is cut where cells end, so that a run is compact and its box tight; a crowd at one
//! place is cut by number. Runs are cut from runs in the same way.

use std::ops::Range;

/// Points side by side, and parts of a run of runs, at most.
pub const LANES: usize = 8;
const TOP: usize = 32; // runs that need no wider ones

/// Coordinates `[3][n + LANES]`, of which the last mean nothing. They are below 2^24 in magnitude,
/// so that f32 holds them and their differences exactly.
pub type Points = [Vec<f32>; 3];

/// The least box of some points.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Least coordinates.
    pub low: [f32; 3],
    /// Greatest coordinates.
    pub high: [f32; 3],
}

/// Runs of about one size.
#[derive(Clone, Debug, Default)]
pub struct Tier {
    /// The first part of each, and the number of all parts.
    pub starts: Vec<u32>,
    /// The box of each.
    pub bounds: Vec<Bounds>,
}

impl Tier {
    /// How many runs there are.
    pub fn count(&self) -> usize {
        self.bounds.len()
    }

    /// The parts of a run.
    pub fn parts(&self, run: usize) -> Range<usize> {
        self.starts[run] as usize..self.starts[run + 1] as usize
    }
}

impl Bounds {
    /// The box of two.
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

/// Cut points into runs of at most `most`, and these into wider ones: the least first.
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

/// Where runs of at most `most` elements begin, and the end.
fn cut(merges: &[u8], most: usize) -> Vec<u32> {
    let mut starts = Vec::with_capacity(4 * merges.len() / most + 2);
    let mut first = 0;
    while first < merges.len() {
        starts.push(first as u32);
        let own = merges[first].max(1);
        // Where all the rest fits, it is not cut but at the end of the cell that begins here.
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
    // Cells that hold no more than one element each would make tiers without end.
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
