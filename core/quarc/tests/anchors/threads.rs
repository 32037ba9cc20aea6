//! The number of threads does not change the result.

use crate::scenes::{any_header, any_ids, any_scene, rows, Random};
use quarc::anchors::{AnchorLevel, Anchors};

const GAUSSIANS: usize = 40_000; // enough for several pieces of every shared task

/// Everything about the anchors of a scene after two samplings.
fn live(seed: u32) -> (Vec<AnchorLevel>, Vec<Vec<u32>>) {
    let mut random = Random::new(seed);
    let header = any_header(&mut random, 4);
    let (ids, mut points) = (any_ids(&mut random, GAUSSIANS), any_scene(&mut random, GAUSSIANS));
    let first = Anchors::sample(&header, 1, &ids, &rows(&points));
    let moved: Vec<bool> = ids.iter().map(|_| random.below(2) == 0).collect();
    for (point, _) in points.iter_mut().zip(&moved).filter(|(_, &moved)| moved) {
        let by = random.point(20);
        *point = [0, 1, 2].map(|axis| (point[axis] + by[axis]).clamp(-8_388_607, 8_388_607));
    }
    let mut again = first.sample_again(&header, 2, &ids, &rows(&points), &moved);
    let levels = again.levels().to_vec();
    let moves: Vec<Vec<bool>> = levels
        .iter()
        .map(|level| level.ids.iter().map(|_| random.below(9) == 0).collect())
        .collect();
    again.follow(&moves);
    let bindings = (0..levels.len()).map(|level| again.known(level)).collect();
    (levels, bindings)
}

#[test]
fn a_pool_gives_the_same_result_as_one_thread() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("a pool");
    for seed in 0..12 {
        assert_eq!(live(seed), pool.install(|| live(seed)), "seed {seed}");
    }
}
