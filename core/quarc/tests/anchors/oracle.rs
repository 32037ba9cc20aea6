//! A direct, slow implementation of SPEC 6.

use crate::scenes::Point;
use quarc::philox::philox;
use quarc::records::Header;
use std::collections::HashSet;

/// The ascending indices of the `count` anchors of a level, counted from 1 (6.3).
pub fn choose(
    header: &Header,
    phase: u32,
    ids: &[u32],
    points: &[Point],
    level: usize,
    count: usize,
) -> Vec<usize> {
    let key = [header.seed as u32, (header.seed >> 32) as u32];
    let rank = |i: &usize| (philox([ids[*i], phase, 0, 1], key)[level - 1], ids[*i]);
    let cell = |i: usize, shift: u32| points[i].map(|at| (at + (1 << 23)) >> shift);
    let all = 0..points.len();
    let occupied = |shift: &u32| all.clone().map(|i| cell(i, *shift)).collect::<HashSet<_>>();
    let shift = (0..=24).find(|shift| occupied(shift).len() <= count).expect("shift 24");
    let mut ranked: Vec<usize> = all.collect();
    ranked.sort_by_key(rank);
    let mut seen = HashSet::new();
    let (mut chosen, others): (Vec<usize>, Vec<usize>) =
        ranked.into_iter().partition(|&i| seen.insert(cell(i, shift)));
    let missing = count - chosen.len();
    chosen.extend(&others[..missing]);
    chosen.sort_unstable();
    chosen
}

/// The index of the anchor that a position follows (6.4).
pub fn follow(at: Point, anchors: &[Vec<i32>; 3]) -> u32 {
    let [xs, ys, zs] = anchors;
    let square = |apart: i32| i64::from(apart) * i64::from(apart);
    let places = xs.iter().zip(ys).zip(zs).enumerate();
    let squares = places
        .map(|(a, ((x, y), z))| (square(x - at[0]) + square(y - at[1]) + square(z - at[2]), a));
    squares.min().expect("an anchor").1 as u32
}
