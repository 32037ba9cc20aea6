//! Changes between two samplings: SPEC 6.5.

use crate::oracle::follow;
use crate::scenes::{any_header, any_ids, any_scene, rows, Point, Random, LIMIT};
use quarc::anchors::{AnchorLevel, Anchors, NOBODY};

/// A scene, its anchors, and the anchor of each Gaussian at each level, computed as the text says.
struct Scene {
    ids: Vec<u32>,
    points: Vec<Point>,
    /// Whether each Gaussian has moved since the sampling.
    moved: Vec<bool>,
    anchors: Anchors,
    binding: Vec<Vec<u32>>,
}

impl Scene {
    fn bind_by_the_text(&mut self) {
        let bind = |level: &AnchorLevel| {
            self.points.iter().map(|&at| follow(at, &level.positions)).collect()
        };
        self.binding = self.anchors.levels().iter().map(bind).collect();
    }

    fn remove(&mut self, random: &mut Random) {
        let dies: Vec<bool> = self.ids.iter().map(|_| random.below(9) == 0).collect();
        let mut gone: Vec<u32> = (0..dies.len() as u32).filter(|&i| dies[i as usize]).collect();
        gone.truncate(self.ids.len() - 1); // keep one
        let keep = |i: usize| gone.binary_search(&(i as u32)).is_err();
        self.anchors.remove(&gone);
        self.ids = pick(&self.ids, keep);
        self.points = pick(&self.points, keep);
        self.moved = pick(&self.moved, keep);
        for binding in &mut self.binding {
            *binding = pick(binding, keep);
        }
    }

    fn append(&mut self, random: &mut Random) {
        let count = random.below(12) as usize;
        let newborn = any_scene(random, count);
        let planes = rows(&newborn);
        self.anchors.append(&[planes.row(0), planes.row(1), planes.row(2)]);
        for (binding, level) in self.binding.iter_mut().zip(self.anchors.levels()) {
            binding.extend(newborn.iter().map(|&at| follow(at, &level.positions)));
        }
        let next = self.ids.last().map_or(0, |id| id + 1);
        self.ids.extend(next..next + count as u32);
        self.points.extend(newborn);
        self.moved.resize(self.points.len(), true);
    }

    fn move_some(&mut self, random: &mut Random) {
        let reach = random.within(1, 40);
        for (point, moved) in self.points.iter_mut().zip(&mut self.moved) {
            if random.below(3) > 0 {
                *moved = true;
                let by = random.point(reach);
                *point = [0, 1, 2].map(|axis| (point[axis] + by[axis]).clamp(-LIMIT, LIMIT));
            }
        }
    }

    /// Check the followers of some moving anchors.
    fn check_followed(&mut self, random: &mut Random) {
        for level in 0..self.binding.len() {
            let count = self.anchors.levels()[level].ids.len();
            let one_in = 1 + random.below(8);
            let moves: Vec<bool> = (0..count).map(|_| random.below(one_in) == 0).collect();
            let followed = self.anchors.followed(level, &moves);
            assert_eq!(followed, self.anchors.known(level));
            assert_eq!(followed.len(), self.binding[level].len());
            for (&found, &follows) in followed.iter().zip(&self.binding[level]) {
                if found == NOBODY {
                    assert!(!moves[follows as usize], "moving followers are complete");
                } else {
                    assert_eq!(found, follows);
                }
            }
        }
    }

    fn check_complete(&self) {
        let mut anchors = self.anchors.clone();
        for (level, binding) in self.binding.iter().enumerate() {
            assert_eq!(anchors.binding(level), *binding);
        }
    }
}

fn pick<T: Copy>(numbers: &[T], keep: impl Fn(usize) -> bool) -> Vec<T> {
    numbers.iter().enumerate().filter(|&(i, _)| keep(i)).map(|(_, &number)| number).collect()
}

fn live(seed: u32, most: u32) {
    let mut random = Random::new(seed);
    let header = any_header(&mut random, 4);
    let count = 1 + random.below(most) as usize;
    let (ids, points) = (any_ids(&mut random, count), any_scene(&mut random, count));
    let mut phase = 1 + random.below(100);
    let anchors = Anchors::sample(&header, phase, &ids, &rows(&points));
    let moved = vec![false; count];
    let mut scene = Scene { ids, points, moved, anchors, binding: Vec::new() };
    for _ in 0..3 {
        scene.bind_by_the_text();
        for frame in 0..3 {
            if frame > 0 {
                scene.remove(&mut random);
                scene.append(&mut random);
            }
            scene.check_followed(&mut random);
            scene.move_some(&mut random);
        }
        scene.check_complete();
        // Gaussians that are born and die in between are unknown to these anchors.
        phase += 3;
        let mut others = scene;
        others.remove(&mut random);
        let last = others.anchors.clone();
        others.append(&mut random);
        let planes = rows(&others.points);
        let fresh = Anchors::sample(&header, phase, &others.ids, &planes);
        let again = last.sample_again(&header, phase, &others.ids, &planes, &others.moved);
        assert_eq!(fresh.levels(), again.levels());
        others.moved.fill(false);
        scene = Scene { anchors: again, ..others };
    }
}

#[test]
fn small_scenes_keep_matching_the_text() {
    (0..150).for_each(|seed| live(seed, 80));
}

#[test]
fn wide_scenes_keep_matching_the_text() {
    (500..506).for_each(|seed| live(seed, 1500));
}

#[test]
fn anchors_of_another_scene_do_not_affect_the_result() {
    let mut random = Random::new(3);
    let header = any_header(&mut random, 3);
    let (one, other) = (any_scene(&mut random, 900), any_scene(&mut random, 500));
    let ids = |count| (0..count).collect::<Vec<u32>>();
    let last = Anchors::sample(&header, 9, &ids(900), &rows(&one));
    let fresh = Anchors::sample(&header, 1, &ids(500), &rows(&other));
    let again = last.sample_again(&header, 1, &ids(500), &rows(&other), &[true; 500]);
    assert_eq!(fresh.levels(), again.levels());
}
