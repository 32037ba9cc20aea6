//! Scenes that provoke errors or long searches, and the random numbers for them.

use quarc::philox::philox;
use quarc::records::Header;
use quarc::rows::Rows;

pub const LIMIT: i32 = 8_388_607;

pub type Point = [i32; 3];

/// A generator of pseudorandom numbers.
pub struct Random {
    seed: u32,
    drawn: u32,
}

impl Random {
    pub fn new(seed: u32) -> Self {
        Random { seed, drawn: 0 }
    }

    /// A number below `end`.
    pub fn below(&mut self, end: u32) -> u32 {
        self.drawn += 1;
        let word = philox([self.drawn, 0, 0, 0], [self.seed, 7])[0];
        ((u64::from(word) * u64::from(end)) >> 32) as u32
    }

    /// A number in a range that includes both ends.
    pub fn within(&mut self, low: i32, high: i32) -> i32 {
        low + self.below((high - low) as u32 + 1) as i32
    }

    pub fn point(&mut self, reach: i32) -> Point {
        [0; 3].map(|_| self.within(-reach, reach))
    }
}

/// A header with the minimum of everything.
pub fn plain_header() -> Header {
    Header {
        level: 30,
        position_step: 1,
        translation_step: 1,
        rotation_unity: 1,
        log_scale_step: 1.0,
        opacity_step: 1.0,
        sh_dc_step: 1.0,
        sh_rest_step: 1.0,
        sh_degree: 0,
        level_count: 1,
        gaussians_per_anchor: 1,
        anchor_ratio: 2,
        resample_interval: 1,
        full_crc_interval: 1,
        ..Header::default()
    }
}

/// Any number of levels, with about `per` Gaussians per anchor.
pub fn any_header(random: &mut Random, per: u32) -> Header {
    Header {
        seed: u64::from(random.below(u32::MAX)) << 32 | u64::from(random.below(u32::MAX)),
        level_count: 1 + random.below(3) as u8,
        gaussians_per_anchor: 1 + random.below(2 * per) as u16,
        anchor_ratio: 2 + random.below(4) as u16,
        ..plain_header()
    }
}

pub fn rows(points: &[Point]) -> Rows<i32> {
    let mut rows = Rows::zeros(3, points.len(), 0);
    for axis in 0..3 {
        for (to, point) in rows.row_mut(axis).iter_mut().zip(points) {
            *to = point[axis];
        }
    }
    rows
}

/// Ascending ids with gaps.
pub fn any_ids(random: &mut Random, count: usize) -> Vec<u32> {
    let mut next = random.below(5);
    let mut id = || {
        next += 1 + random.below(8) / 7;
        next - 1
    };
    (0..count).map(|_| id()).collect()
}

/// A scene of one of many kinds.
pub fn any_scene(random: &mut Random, count: usize) -> Vec<Point> {
    let kind = random.below(12);
    (0..count).map(|i| place(random, kind, i)).collect()
}

fn place(random: &mut Random, kind: u32, i: usize) -> Point {
    let corner = |random: &mut Random, inset: i32| {
        [0; 3].map(|_| (2 * random.within(0, 1) - 1) * (LIMIT - random.within(0, inset)))
    };
    match kind {
        0 => random.point(LIMIT),
        1 => random.point(300),
        2 => random.point(2),                          // clusters and ties
        3 => [LIMIT, -LIMIT, 0],                       // all at one position
        4 => corner(random, 0),                        // clusters at the corners
        5 => corner(random, 3),                        // extremely distant across the lattice
        6 => [i as i32 * 7 - 4000, 0, 0],              // a line
        7 => random.point(3).map(|at| at * (1 << 21)), // a grid as large as the lattice
        8 => random.point(6).map(|at| at * 512),       // a grid of ties
        9 if i % 50 == 0 => random.point(LIMIT),       // a few outliers
        9 => random.point(40),
        10 => {
            // On a sphere, so that all points have nearly the same distance from a center.
            let toward = [0; 3].map(|_| f64::from(random.within(-1000, 1000)));
            let length = toward.iter().map(|v| v * v).sum::<f64>().sqrt().max(1.0);
            let radius = if i % 2 == 0 { 20_000.0 } else { 30.0 };
            toward.map(|v| (v / length * radius) as i32)
        }
        _ => {
            // All kinds except the corners of the lattice.
            let kind = [0, 1, 2, 6, 8, 10][random.below(6) as usize];
            place(random, kind, i)
        }
    }
}
