//! Which of a list is nearest to each of eight points, by (squared distance, number): SPEC 6.4.

use super::index::{Eight, Index};
use super::near::{Near, ROUNDED};
use super::runs::{Points, LANES};
use std::ops::Range;

/// List the place of the anchor nearest to each of some points, of those of a list.
pub fn nearest(
    points: &Points,
    some: Range<usize>,
    near: &Near,
    index: &Index,
    places: &mut Vec<u32>,
) {
    for first in some.clone().step_by(LANES) {
        let at = [0, 1, 2].map(|axis: usize| eight(&points[axis], first));
        let mut held = Held { best: [0.0; LANES], second: [0.0; LANES], who: [0.0; LANES] };
        hold(at, near.points(), near.places().len(), &mut held);
        let lanes = held.best.iter().zip(&held.second).zip(&held.who).enumerate();
        for (lane, ((&best, &second), &who)) in lanes.take(some.end - first) {
            let within = best * ROUNDED;
            // Two that are so nearly as far may be as far, or the other way round.
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

/// The place of the anchor nearest to a point, of a list of those within a squared distance,
/// nearly.
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

/// Eight numbers of a row.
pub fn eight(numbers: &[f32], first: usize) -> &Eight {
    numbers[first..first + LANES].try_into().expect("a slice of that length")
}

/// Of eight points, what a list holds for each.
struct Held {
    /// The least squared distance, nearly.
    best: Eight,
    /// The second least.
    second: Eight,
    /// Where in the list the nearest is.
    who: Eight,
}

/// Hold eight points against the anchors of a list.
///
/// It stands alone, with numbers of one kind, as only then compilers see that the lanes of all
/// of them go together.
#[inline(never)]
fn hold(at: [&Eight; 3], anchors: &[[Eight; 3]], count: usize, held: &mut Held) {
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
    *held = Held { best, second, who };
}
