//! Which Gaussians are anchors: SPEC 6.1 to 6.3.

use crate::constants::LATTICE_OFFSET;
use crate::philox::philox;
use crate::records::Header;
use std::collections::HashMap;

const DOMAIN_SAMPLER: u32 = 1;

/// How many anchors each level has, level 1 first (6.1).
#[must_use]
pub fn count_anchors(header: &Header, gaussians: usize) -> Vec<usize> {
    let per = usize::from(header.gaussians_per_anchor);
    let mut counts = vec![(gaussians + per - 1) / per];
    while counts.len() < usize::from(header.level_count) {
        let finer = counts[counts.len() - 1];
        counts.push((finer / usize::from(header.anchor_ratio)).max(1));
    }
    counts
}

/// The indices of each level's anchors, ascending; level 1 first (6.3).
pub fn sample(header: &Header, phase: u32, ids: &[u32], positions: [&[i32]; 3]) -> Vec<Vec<u32>> {
    let key = [header.seed as u32, (header.seed >> 32) as u32];
    let words: Vec<[u32; 4]> =
        ids.iter().map(|&id| philox([id, phase, 0, DOMAIN_SAMPLER], key)).collect();
    let cell = |i: usize, shift: u32| {
        [0, 1, 2].map(|axis: usize| (positions[axis][i] + LATTICE_OFFSET) >> shift)
    };
    let choose = |level: usize, count: usize| {
        let mut cells = HashMap::new();
        for shift in 0..=24 {
            cells.clear();
            for (i, words) in words.iter().enumerate() {
                let rank = (words[level], i);
                let least = cells.entry(cell(i, shift)).or_insert(rank);
                *least = rank.min(*least);
            }
            if cells.len() <= count {
                break;
            }
        }
        let mut chosen = vec![false; ids.len()];
        for &(_, i) in cells.values() {
            chosen[i] = true;
        }
        let mut rest: Vec<(u32, usize)> =
            (0..ids.len()).filter(|&i| !chosen[i]).map(|i| (words[i][level], i)).collect();
        rest.sort_unstable();
        for &(_, i) in rest.iter().take(count - cells.len()) {
            chosen[i] = true;
        }
        (0..ids.len()).filter(|&i| chosen[i]).map(|i| i as u32).collect()
    };
    count_anchors(header, ids.len())
        .into_iter()
        .enumerate()
        .map(|(level, count)| choose(level, count))
        .collect()
}
