//! Which of a list is nearest to each of eight points, by (squared distance, number): SPEC 6.4.

use super::index::{Eight, Index};
use super::near::{Near, ROUNDED};
use super::runs::{Points, LANES};

/// The places of the anchors nearest to each of eight points from `first` on.
pub fn nearest(points: &Points, first: usize, near: &Near, index: &Index) -> [u32; LANES] {
    let at = [0, 1, 2].map(|axis: usize| eight(&points[axis], first));
    let (best, second, who) = hold(at, near);
    let mut places = who.map(|k| near.places()[k as usize]);
    for lane in 0..LANES {
        // Two that are so nearly as far may be as far, or the other way round.
        let within = best[lane] * ROUNDED;
        if second[lane] <= within {
            let point = [0, 1, 2].map(|axis: usize| at[axis][lane]);
            places[lane] = nearest_exactly(point, near, index, within);
        }
    }
    places
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

/// The two least squared distances of each point, nearly, and where in the list the least is.
fn hold(at: [&Eight; 3], near: &Near) -> (Eight, Eight, [u32; LANES]) {
    let (mut best, mut second, mut who) = ([f32::MAX; LANES], [f32::MAX; LANES], [0; LANES]);
    let [xs, ys, zs] = at;
    let mut number = 0;
    for block in near.points() {
        for ((&ax, &ay), &az) in block[0].iter().zip(&block[1]).zip(&block[2]) {
            for k in 0..LANES {
                let (x, y, z) = (xs[k] - ax, ys[k] - ay, zs[k] - az);
                let square = x * x + y * y + z * z;
                let farther = if square > best[k] { square } else { best[k] };
                second[k] = if farther < second[k] { farther } else { second[k] };
                who[k] = if square < best[k] { number } else { who[k] };
                best[k] = if square < best[k] { square } else { best[k] };
            }
            number += 1;
        }
    }
    (best, second, who)
}
