//! The choice of the Gaussians that become anchors: SPEC 6.1 to 6.3.

use super::order::{Order, KEY_BITS};
use crate::parallel::{each, piece};
use crate::philox::philox;
use crate::records::Header;

const DOMAIN_SAMPLER: u32 = 1;
const DRAWN: usize = 1 << 12; // minimum number of words per task

/// The number of anchors of each level, level 1 first (6.1).
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

/// Chooses the anchors of all levels of a scene.
pub struct Sampler<'a> {
    order: &'a Order,
    words: [Vec<u32>; 3],
    occupied: [usize; KEY_BITS / 3 + 1],
}

impl<'a> Sampler<'a> {
    /// Draw the random words of the Gaussians of an order; `ids` by index (6.2).
    pub fn new(header: &Header, phase: u32, ids: &[u32], order: &'a Order) -> Self {
        let key = [header.seed as u32, (header.seed >> 32) as u32];
        let mut words = [0; 3].map(|_| vec![0; ids.len()]);
        let size = piece(ids.len(), DRAWN);
        let [first, second, third] = &mut words;
        let rows = first.chunks_mut(size).zip(second.chunks_mut(size)).zip(third.chunks_mut(size));
        let pieces = order.indices.chunks(size).zip(rows).collect();
        each(pieces, &|(indices, ((first, second), third))| {
            let ids: Vec<u32> = indices.iter().map(|&index| ids[index as usize]).collect();
            for (((&id, first), second), third) in ids.iter().zip(first).zip(second).zip(third) {
                [*first, *second, *third, _] = philox([id, phase, 0, DOMAIN_SAMPLER], key);
            }
        });
        Sampler { order, words, occupied: count_cells(&order.merges) }
    }

    /// The places in the order, ascending, of a level's `count` anchors (6.3).
    pub fn choose(&self, level: usize, count: usize) -> Vec<u32> {
        // 1: the least shift at which at most `count` cells are occupied
        let shift = self.occupied.iter().position(|&cells| cells <= count).unwrap_or(0);
        let firsts = self.first_of_cells(level, 3 * shift as u8, self.occupied[shift]);
        let missing = count - firsts.len();
        if missing == 0 {
            return firsts;
        }
        let others = self.first_of_others(level, &firsts, missing);
        merge_ascending(&firsts, &others)
    }

    /// 2: the Gaussian of least rank in every cell of `bits` bits; `cells` are occupied.
    fn first_of_cells(&self, level: usize, bits: u8, cells: usize) -> Vec<u32> {
        let mut firsts = vec![0; cells + 1];
        let (mut found, mut least, mut first) = (0, u64::MAX, 0);
        let words = self.words[level].iter().zip(&self.order.indices).zip(&self.order.merges);
        for (place, ((&word, &index), &merge)) in words.enumerate() {
            let rank = u64::from(word) << 32 | u64::from(index); // as (word, id): ids ascend
            let begins = merge > bits;
            found += usize::from(begins);
            least |= u64::from(begins).wrapping_neg(); // the maximum where a cell begins
            first = if rank <= least { place as u32 } else { first };
            least = least.min(rank);
            firsts[found] = first; // the last value written for a cell remains
        }
        firsts.remove(0);
        firsts
    }

    /// 3: of all others, the `missing` ones of least rank, ascending.
    fn first_of_others(&self, level: usize, firsts: &[u32], missing: usize) -> Vec<u32> {
        let words = &self.words[level];
        let rank = |place: u32| {
            let word = words[place as usize];
            u64::from(word) << 32 | u64::from(self.order.indices[place as usize])
        };
        let mut is_first = vec![false; words.len()];
        for &place in firsts {
            is_first[place as usize] = true;
        }
        let mut places = self.below(level, likely_bound(firsts.len() + missing, words.len()));
        places.retain(|&place| !is_first[place as usize]);
        if places.len() < missing {
            places = self.below(level, u32::MAX);
            places.retain(|&place| !is_first[place as usize]);
        }
        let mut ranks: Vec<u64> = places.iter().map(|&place| rank(place)).collect();
        let last = *ranks.select_nth_unstable(missing - 1).1;
        places.retain(|&place| rank(place) <= last);
        places
    }

    /// The places of all words up to a bound.
    fn below(&self, level: usize, bound: u32) -> Vec<u32> {
        let mut places = vec![0; self.words[level].len() + 1];
        let mut found = 0;
        for (place, &word) in self.words[level].iter().enumerate() {
            places[found] = place as u32; // no branch: places not taken are overwritten
            found += usize::from(word <= bound);
        }
        places.truncate(found);
        places
    }
}

/// A bound below which at least `wanted` of all words very likely are.
fn likely_bound(wanted: usize, all: usize) -> u32 {
    let wanted = wanted as f64;
    let share = (wanted + 6.0 * wanted.sqrt() + 16.0) / all as f64;
    (share * f64::from(u32::MAX)) as u32 // saturates
}

/// The number of occupied cells at each shift.
fn count_cells(merges: &[u8]) -> [usize; KEY_BITS / 3 + 1] {
    let mut joined = [[0_usize; 256]; 2]; // alternating, because equal numbers often follow each other
    for pair in merges.chunks(2) {
        for (joined, &merge) in joined.iter_mut().zip(pair) {
            joined[usize::from(merge)] += 1;
        }
    }
    let mut occupied = [0; KEY_BITS / 3 + 1];
    for (shift, cells) in occupied.iter_mut().enumerate() {
        *cells = joined.iter().map(|joined| joined[3 * shift + 1..].iter().sum::<usize>()).sum();
    }
    occupied
}

/// Merge two ascending lists without common elements.
fn merge_ascending(some: &[u32], others: &[u32]) -> Vec<u32> {
    let (mut i, mut j) = (0, 0);
    let mut all = vec![0; some.len() + others.len()];
    for to in &mut all {
        let number = some.get(i).map_or(u32::MAX, |&number| number);
        let other = others.get(j).map_or(u32::MAX, |&number| number);
        *to = number.min(other);
        i += usize::from(number < other);
        j += usize::from(other < number);
    }
    all
}
