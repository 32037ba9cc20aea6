//! How fast anchors are sampled and followed, on one thread.
//!
//!     cargo run --release --example bench_anchors [-- --gaussians N] [--per M] [--write FILE]
//!
//! The scene is like that of benchmarks/moving_stream.py: a room with furniture, dense clusters
//! and sparse outskirts, of which a few things move. Anchors are sampled in every second frame.
//! `--write` leaves the positions of the last sampling, three rows of i32, and the bindings of
//! its three levels, as u32, for others to be held against.

use quarc::anchors::Anchors;
use quarc::philox::philox;
use quarc::records::Header;
use quarc::rows::Rows;
use std::time::Instant;

const METER: f64 = 4096.0;
const MOVERS: usize = 8;
const STEP: f64 = 7.0;
const SAMPLINGS: usize = 12;
const TIMES: [&str; 5] = ["sample", "followed", "again", "complete", "remove, append"];

fn main() {
    let options: Vec<String> = std::env::args().collect();
    let value = |name: &str| {
        options.iter().position(|option| option == name).map(|at| options[at + 1].clone())
    };
    let gaussians = value("--gaussians").map_or(244_000, |text| text.parse().expect("a number"));
    let per = value("--per").map_or(4, |text| text.parse().expect("a number"));
    let shares = [("dense", [0.44; 3]), ("sparse", [0.10, 0.25, 0.45])];
    for (name, shares) in shares {
        let mut bench = Bench::new(gaussians, per, shares);
        let rounds: Vec<[f64; 5]> = (0..SAMPLINGS).map(|round| bench.round(round)).collect();
        println!("{name}: ms, first round, then median and least of the others");
        let shares = bench.count_followers();
        println!("  {shares:.2?} of the Gaussians follow what moves");
        for (stage, name) in TIMES.iter().enumerate() {
            let mut times: Vec<f64> = rounds[1..].iter().map(|round| round[stage]).collect();
            times.sort_by(f64::total_cmp);
            let (first, median, least) = (rounds[0][stage], times[times.len() / 2], times[0]);
            println!("  {name:15} {first:7.2} {median:7.2} {least:7.2}");
        }
        if let Some(path) = value("--write") {
            bench.write(&path);
        }
    }
}

/// Processor time of this thread in milliseconds, where the system tells; else any time.
fn now(start: Instant) -> f64 {
    std::thread::yield_now(); // brings that number up to date
    let spent = std::fs::read_to_string("/proc/thread-self/schedstat");
    let nanoseconds = spent.ok().and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or(start.elapsed().as_secs_f64() * 1e3, |nanoseconds| nanoseconds / 1e6)
}

/// Numbers that look random, from the generator of the format.
struct Random(u32);

impl Random {
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.0 += 1;
        low + (high - low) * f64::from(philox([self.0, 0, 0, 9], [1, 2])[0]) / 4_294_967_296.0
    }

    fn normal(&mut self) -> f64 {
        let (a, b) = (self.uniform(1e-12, 1.0), self.uniform(0.0, std::f64::consts::TAU));
        (-2.0 * a.ln()).sqrt() * b.cos()
    }

    fn unit(&mut self) -> [f64; 3] {
        let vector = [self.normal(), self.normal(), self.normal()];
        let length = vector.iter().map(|v| v * v).sum::<f64>().sqrt();
        vector.map(|v| v / length)
    }

    fn below(&mut self, end: usize) -> usize {
        self.uniform(0.0, end as f64) as usize
    }
}

fn make_points(count: usize, random: &mut Random) -> Vec<[f64; 3]> {
    let mut place = |reach: f64| [0; 3].map(|_| random.uniform(-reach, reach));
    let (tables, balls): (Vec<_>, Vec<_>) =
        ((0..40).map(|_| place(2.0)).collect(), (0..60).map(|_| place(2.0)).collect());
    let sizes: Vec<f64> = (0..60).map(|_| random.uniform(0.01, 0.08)).collect();
    let radii: Vec<[f64; 3]> = (0..40).map(|_| [0; 3].map(|_| random.uniform(0.1, 0.5))).collect();
    let mut point = || {
        let (kind, unit) = (random.uniform(0.0, 1.0), random.unit());
        if kind < 0.38 {
            let (room, side) = ([4.0, 2.0, 3.0], random.below(3));
            let mut wall = room.map(|reach| random.uniform(-reach, reach));
            wall[side] = room[side] * if random.below(2) == 0 { 1.0 } else { -1.0 };
            wall.map(|at| at + 0.01 * random.normal())
        } else if kind < 0.68 {
            let which = random.below(40);
            [0, 1, 2].map(|axis: usize| tables[which][axis] + unit[axis] * radii[which][axis])
        } else if kind < 0.88 {
            let which = random.below(60);
            balls[which].map(|at: f64| at + sizes[which] * random.normal())
        } else {
            let radius = random.uniform(5_f64.ln(), 400_f64.ln()).exp();
            unit.map(|at| at * radius)
        }
    };
    (0..count).map(|_| point()).collect()
}

/// A scene that moves.
struct Bench {
    header: Header,
    ids: Vec<u32>,
    positions: Rows<i32>,
    anchors: Option<Anchors>,
    centers: Vec<[f64; 3]>,
    velocities: Vec<[f64; 3]>,
    /// Of the Gaussians, how many are within reach of a mover, by level.
    shares: [f64; 3],
    random: Random,
    /// Of all answers, so that they are made.
    seen: u64,
}

impl Bench {
    fn new(gaussians: usize, per: u16, shares: [f64; 3]) -> Self {
        let mut random = Random(0);
        let mut points: Vec<[i32; 3]> = make_points(gaussians, &mut random)
            .iter()
            .map(|point| point.map(|at| (at * METER / 4.0) as i32 * 4))
            .collect();
        let least = [0, 1, 2].map(|axis: usize| points.iter().map(|p| p[axis]).min().unwrap());
        points.sort_by_key(|p| {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| ((p[axis] - least[axis]) / 4) as u32);
            quarc::morton::interleave(x, y, z)
        });
        let mut positions = Rows::zeros(3, gaussians, 0);
        for (axis, row) in positions.rows_mut().enumerate() {
            row.iter_mut().zip(&points).for_each(|(to, point)| *to = point[axis]);
        }
        let mut centers = Vec::new();
        while centers.len() < MOVERS {
            let point = points[random.below(gaussians)].map(f64::from);
            if point.iter().all(|at| at.abs() < 2.0 * METER) {
                centers.push(point);
            }
        }
        let velocity = |_| [0; 3].map(|_| 5.0 * random.normal());
        let velocities = (0..MOVERS).map(velocity).collect();
        let ids = (0..gaussians as u32).collect();
        let header = header(per);
        Bench {
            header,
            ids,
            positions,
            anchors: None,
            centers,
            velocities,
            shares,
            random,
            seen: 0,
        }
    }

    /// Two frames, of which the first samples.
    fn round(&mut self, round: usize) -> [f64; 5] {
        let start = Instant::now();
        let mut times = [now(start)];
        let mut spent = [0.0; 5];
        let mut lap = |stage: usize, begins: bool| {
            let time = now(start);
            if !begins {
                spent[stage] += time - times[0];
            }
            times[0] = now(start);
        };
        let phase = 2 * round as u32 + 1;
        let before = self.anchors.take();
        lap(0, true);
        let mut anchors = match &before {
            None => Anchors::sample(&self.header, phase, &self.ids, &self.positions),
            Some(last) => last.sample_again(&self.header, phase, &self.ids, &self.positions),
        };
        lap(0, false);
        drop(before);
        let untouched = anchors.clone();
        for frame in 1..3 {
            let symbols = self.draw(&anchors);
            let moves: Vec<Vec<bool>> =
                symbols.iter().map(|level| level.iter().map(|s| *s != [0; 3]).collect()).collect();
            lap(0, true);
            for (level, moves) in moves.iter().enumerate() {
                self.seen += u64::from(anchors.followed(level, moves)[0]);
            }
            lap(frame, false);
            self.move_by(&mut anchors, &symbols, &moves);
            if frame == 1 {
                self.live(&mut anchors, &mut lap);
            }
        }
        let mut complete = untouched;
        lap(0, true);
        for level in 0..3 {
            self.seen += u64::from(complete.binding(level)[0]);
        }
        lap(3, false);
        self.anchors = Some(anchors);
        spent
    }

    /// Symbols of every anchor, 0 outside of what moves.
    fn draw(&mut self, anchors: &Anchors) -> Vec<Vec<[i32; 3]>> {
        for (center, velocity) in self.centers.iter_mut().zip(&mut self.velocities) {
            for axis in 0..3 {
                velocity[axis] = 0.95 * velocity[axis] + 1.5 * self.random.normal();
                center[axis] += STEP * velocity[axis];
            }
        }
        let rows = [0, 1, 2].map(|axis| self.positions.row(axis));
        let mut squares: Vec<f64> = self.find_movers(rows).iter().map(|&(s, _)| s).collect();
        squares.sort_by(f64::total_cmp);
        let mut symbols = Vec::new();
        for (level, share) in anchors.levels().iter().zip(self.shares) {
            let [x, y, z] = &level.positions;
            let anchors = self.find_movers([x, y, z]);
            let reach = squares[(share * squares.len() as f64) as usize];
            let symbol = |&(square, mover): &(f64, usize)| {
                let third = self.velocities[mover].map(|v| v / 3.0 + 0.4 * self.random.normal());
                third.map(|v| if square < reach { v.round() as i32 } else { 0 })
            };
            symbols.push(anchors.iter().map(symbol).collect());
        }
        symbols
    }

    /// The squared distance to the nearest mover, and which it is.
    fn find_movers(&self, positions: [&[i32]; 3]) -> Vec<(f64, usize)> {
        let mover = |i: usize| {
            let square = |center: &[f64; 3]| {
                let apart = |axis: usize| center[axis] - f64::from(positions[axis][i]);
                (0..3).map(|axis| apart(axis) * apart(axis)).sum::<f64>()
            };
            let squares = self.centers.iter().map(square).enumerate();
            squares.fold((f64::MAX, 0), |best, (i, s)| if s < best.0 { (s, i) } else { best })
        };
        (0..positions[0].len()).map(mover).collect()
    }

    fn count_followers(&mut self) -> [f64; 3] {
        let mut anchors = self.anchors.take().expect("a round");
        let symbols = self.draw(&anchors);
        let share = [0, 1, 2].map(|level| {
            let follows = |&&a: &&u32| symbols[level][a as usize] != [0; 3];
            let binding = anchors.binding(level);
            binding.iter().filter(follows).count() as f64 / binding.len() as f64
        });
        self.anchors = Some(anchors);
        share
    }

    fn move_by(&mut self, anchors: &mut Anchors, symbols: &[Vec<[i32; 3]>], moves: &[Vec<bool>]) {
        for (level, (symbols, moves)) in symbols.iter().zip(moves).enumerate() {
            let followed = anchors.followed(level, moves);
            for (axis, row) in self.positions.rows_mut().enumerate() {
                for (at, &anchor) in row.iter_mut().zip(followed) {
                    let by = symbols.get(anchor as usize).map_or(0, |symbol| symbol[axis]);
                    *at = (*at + STEP as i32 * by).clamp(-8_388_607, 8_388_607);
                }
            }
        }
    }

    /// Let 150 Gaussians die and 150 be born.
    fn live(&mut self, anchors: &mut Anchors, lap: &mut impl FnMut(usize, bool)) {
        let mut gone: Vec<u32> =
            (0..150).map(|_| self.random.below(self.ids.len()) as u32).collect();
        gone.sort_unstable();
        gone.dedup();
        let newborn: Vec<Vec<i32>> = self
            .positions
            .rows_mut()
            .map(|row| gone.iter().map(|&i| row[(i as usize * 7) % row.len()] + 5).collect())
            .collect();
        let next = self.ids[self.ids.len() - 1] + 1;
        let mut place = 0;
        self.ids.retain(|_| {
            place += 1;
            gone.binary_search(&(place - 1)).is_err()
        });
        self.ids.extend(next..next + gone.len() as u32);
        self.positions.remove(&gone);
        let old = self.positions.columns();
        self.positions.grow(gone.len());
        for (row, newborn) in self.positions.rows_mut().zip(&newborn) {
            row[old..].copy_from_slice(newborn);
        }
        lap(4, true);
        anchors.remove(&gone);
        anchors.append(&[&newborn[0], &newborn[1], &newborn[2]]);
        lap(4, false);
    }

    fn write(&self, path: &str) {
        let last = self.anchors.as_ref().expect("a round");
        let phase = 2 * SAMPLINGS as u32 + 1;
        let mut anchors = last.sample_again(&self.header, phase, &self.ids, &self.positions);
        let mut bytes = Vec::new();
        let mut put = |number: u32| bytes.extend_from_slice(&number.to_le_bytes());
        put(phase);
        self.ids.iter().for_each(|&id| put(id));
        (0..3).for_each(|axis| self.positions.row(axis).iter().for_each(|&at| put(at as u32)));
        (0..3).for_each(|level| anchors.binding(level).iter().for_each(|&a| put(a)));
        std::fs::write(path, bytes).expect("a file that can be written");
    }
}

fn header(gaussians_per_anchor: u16) -> Header {
    Header {
        level: 31,
        timescale: 30,
        frame_ticks: 1,
        lattice_exponent: 12,
        position_step: 4,
        translation_step: STEP as u16,
        rotation_unity: 64,
        rotation_components: 3,
        rotation_bits: 6,
        log_scale_step: 0.125,
        opacity_step: 0.125,
        sh_dc_step: 0.0625,
        sh_rest_step: 0.0625,
        sh_degree: 1,
        level_count: 3,
        gaussians_per_anchor,
        anchor_ratio: 3,
        resample_interval: 2,
        full_crc_interval: 30,
        seed: 1,
        right_handed: true,
        up_axis: 0,
        meters_per_unit: 1.0,
        color_space: 1,
        updates: false,
        snapshots: false,
    }
}
