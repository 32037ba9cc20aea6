//! Anchors, parents and bindings of many scenes, against a direct implementation of the text.

use crate::oracle::{choose, follow};
use crate::scenes::{any_header, any_ids, any_scene, plain_header, rows, Point, Random, LIMIT};
use quarc::anchors::{count_anchors, Anchors};
use quarc::records::Header;

fn check(header: &Header, phase: u32, ids: &[u32], points: &[Point]) {
    let mut anchors = Anchors::sample(header, phase, ids, &rows(points));
    let counts = count_anchors(header, ids.len());
    assert_eq!(anchors.levels().len(), counts.len());
    let mut finer: Option<Vec<usize>> = None;
    for (level, count) in counts.into_iter().enumerate() {
        let chosen = choose(header, phase, ids, points, level + 1, count);
        let found = anchors.levels()[level].clone();
        assert_eq!(found.ids, chosen.iter().map(|&i| ids[i]).collect::<Vec<_>>());
        for (axis, row) in found.positions.iter().enumerate() {
            assert_eq!(*row, chosen.iter().map(|&i| points[i][axis]).collect::<Vec<_>>());
        }
        let bound: Vec<u32> = points.iter().map(|&at| follow(at, &found.positions)).collect();
        assert_eq!(anchors.binding(level), bound);
        if let Some(owners) = finer {
            let parents = anchors.parents(level - 1, &vec![true; found.ids.len()]);
            assert_eq!(parents, owners.iter().map(|&i| bound[i]).collect::<Vec<_>>());
        }
        finer = Some(chosen);
    }
}

#[test]
fn small_scenes_match_the_text() {
    for seed in 0..400 {
        let mut random = Random::new(seed);
        let count = 1 + random.below(120) as usize;
        let (header, points) = (any_header(&mut random, 4), any_scene(&mut random, count));
        let ids = any_ids(&mut random, count);
        check(&header, 1 + random.below(1000), &ids, &points);
    }
}

#[test]
fn wide_scenes_match_the_text() {
    for seed in 1000..1030 {
        let mut random = Random::new(seed);
        let count = 1000 + random.below(1500) as usize;
        let (header, points) = (any_header(&mut random, 4), any_scene(&mut random, count));
        check(&header, 1, &any_ids(&mut random, count), &points);
    }
}

#[test]
fn a_scene_of_one_gaussian_has_one_anchor_at_every_level() {
    let header = Header { level_count: 3, gaussians_per_anchor: u16::MAX, ..plain_header() };
    check(&header, u32::MAX, &[u32::MAX], &[[LIMIT, LIMIT, -LIMIT]]);
}

#[test]
fn all_gaussians_may_be_anchors() {
    let points: Vec<Point> = (0..700).map(|i| [i % 9, i % 7, i % 5]).collect();
    let ids: Vec<u32> = (0..700).collect();
    check(&plain_header(), 1, &ids, &points);
}

/// Squared distances whose order f32 cannot represent, at all scales.
#[test]
fn nearly_equidistant_anchors_are_distinguished() {
    for (seed, shift) in (0..19).enumerate() {
        let mut random = Random::new(seed as u32);
        let center = random.point(LIMIT - (16 << shift));
        let mut points = vec![center; 40];
        for _ in 0..200 {
            let side = (2 * random.within(0, 1) - 1) * (15 << shift);
            let mut point = center.map(|at| at + random.within(-2, 2));
            point[random.below(3) as usize] += side;
            points.push(point.map(|at| at.clamp(-LIMIT, LIMIT)));
        }
        let ids: Vec<u32> = (0..points.len() as u32).collect();
        let header = Header { gaussians_per_anchor: 2, seed: seed as u64, ..plain_header() };
        check(&header, 1, &ids, &points);
    }
}

/// Scenes that make naive searches slow: comparing every Gaussian with all anchors would take
/// minutes for each.
#[test]
fn hostile_scenes_take_no_longer_than_others() {
    let count = 60_000;
    let ids: Vec<u32> = (0..count).collect();
    let mut random = Random::new(1);
    let ends = |i: u32| [if i % 2 == 0 { LIMIT } else { -LIMIT }; 3];
    let far = |i: u32, random: &mut Random| {
        if i < 3000 {
            random.point(LIMIT)
        } else {
            random.point(30)
        }
    };
    let scenes: [Vec<Point>; 6] = [
        (0..count).map(|_| [1, 2, 3]).collect(),
        (0..count).map(ends).collect(),
        (0..count).map(|i| [i as i32 * 200 - 6_000_000, 5, 5]).collect(),
        (0..count).map(|i| [i as i32 % 3, i as i32 % 2, 0]).collect(),
        (0..count).map(|i| far(i, &mut random)).collect(),
        (0..count)
            .map(|i| [1 << (i % 24), 1 << (i / 24 % 24), -1])
            .map(|p: Point| p.map(|at| at.min(LIMIT)))
            .collect(),
    ];
    for points in &scenes {
        let header = Header { level_count: 3, gaussians_per_anchor: 2, ..plain_header() };
        let mut anchors = Anchors::sample(&header, 1, &ids, &rows(points));
        for level in 0..3 {
            let positions = anchors.levels()[level].positions.clone();
            let bound = anchors.binding(level);
            for i in (0..count as usize).step_by(997) {
                assert_eq!(bound[i], follow(points[i], &positions));
            }
        }
    }
}
