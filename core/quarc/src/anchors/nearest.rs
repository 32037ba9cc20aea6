//! The nearest anchor of a list for each of eight points, by (squared distance, number): SPEC 6.4.

use super::index::{Eight, Index};
use super::near::{Near, ROUNDED};
use super::runs::{Points, LANES};
use std::ops::Range;

/// Append, for each point of a range, the place of the nearest anchor of a list.
pub fn nearest(
    points: &Points,
    some: Range<usize>,
    near: &Near,
    index: &Index,
    places: &mut Vec<u32>,
) {
    for first in some.clone().step_by(LANES) {
        let at = [0, 1, 2].map(|axis: usize| eight(&points[axis], first));
        let mut compared = Compared { best: [0.0; LANES], second: [0.0; LANES], who: [0.0; LANES] };
        compare(at, near.points(), near.places().len(), &mut compared);
        let lanes = compared.best.iter().zip(&compared.second).zip(&compared.who).enumerate();
        for (lane, ((&best, &second), &who)) in lanes.take(some.end - first) {
            let within = best * ROUNDED;
            // The exact order of two approximate distances this close is unknown.
            let place = if second > within {
                near.places()[who as usize]
            } else {
                let point = [0, 1, 2].map(|axis: usize| at[axis][lane]);
                nearest_exactly(point, near, index, within)
            };
            places.push(place);
        }
    }
}

/// The place of the nearest anchor of a list, among those within an approximate squared distance.
pub fn nearest_exactly(point: [f32; 3], near: &Near, index: &Index, within: f32) -> u32 {
    let mut best = (i64::MAX, u32::MAX, u32::MAX);
    for &place in near.places() {
        let apart = [0, 1, 2].map(|axis: usize| index.points[axis][place as usize] - point[axis]);
        let nearly = apart[0] * apart[0] + apart[1] * apart[1] + apart[2] * apart[2];
        if nearly <= within {
            let [x, y, z] = apart.map(|difference| difference as i64);
            let square = x * x + y * y + z * z;
            best = best.min((square, index.numbers[place as usize], place));
        }
    }
    best.2
}

/// Eight consecutive numbers of a row.
pub fn eight(numbers: &[f32], first: usize) -> &Eight {
    numbers[first..first + LANES].try_into().expect("a slice of that length")
}

/// The result of comparing eight points with a list.
struct Compared {
    /// The approximate least squared distance of each point.
    best: Eight,
    /// The second least.
    second: Eight,
    /// The place in the list of the nearest anchor.
    who: Eight,
}

/// Compare eight points with the anchors of a list.
///
/// A function of its own with numbers of a single type, because compilers vectorize it only then.
#[inline(never)]
fn compare(at: [&Eight; 3], anchors: &[[Eight; 3]], count: usize, compared: &mut Compared) {
    let (mut best, mut second, mut who) = ([f32::MAX; LANES], [f32::MAX; LANES], [0.0; LANES]);
    let [xs, ys, zs] = at;
    let (mut number, mut left) = (0.0, count);
    for block in anchors {
        let [xs_of, ys_of, zs_of] = block;
        for ((&ax, &ay), &az) in xs_of.iter().zip(ys_of).zip(zs_of).take(left) {
            for k in 0..LANES {
                let (x, y, z) = (xs[k] - ax, ys[k] - ay, zs[k] - az);
                let square = x * x + y * y + z * z;
                let farther = if square > best[k] { square } else { best[k] };
                second[k] = if farther < second[k] { farther } else { second[k] };
                who[k] = if square < best[k] { number } else { who[k] };
                best[k] = if square < best[k] { square } else { best[k] };
            }
            number += 1.0;
        }
        left = left.saturating_sub(LANES);
    }
    *compared = Compared { best, second, who };
}
