//! Which Gaussians are anchors: SPEC 6.1 to 6.3.

use super::order::{Order, KEY_BITS};
use crate::philox::philox;
use crate::records::Header;

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

/// What the levels of a scene are chosen by.
pub struct Sampler<'a> {
    order: &'a Order,
    words: [Vec<u32>; 3],
    occupied: [usize; KEY_BITS / 3 + 1],
}

impl<'a> Sampler<'a> {
    /// Draw for the Gaussians of an order; `ids` by index.
    pub fn new(header: &Header, phase: u32, ids: &[u32], order: &'a Order) -> Self {
        let key = [header.seed as u32, (header.seed >> 32) as u32];
        let mut words = [0; 3].map(|_: u32| Vec::with_capacity(ids.len()));
        for &index in &order.indices {
            let drawn = philox([ids[index as usize], phase, 0, DOMAIN_SAMPLER], key);
            for (words, word) in words.iter_mut().zip(drawn) {
                words.push(word);
            }
        }
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

    /// 2: the Gaussian of least rank of every cell of so many bits.
    fn first_of_cells(&self, level: usize, bits: u8, cells: usize) -> Vec<u32> {
        let mut firsts = vec![0; cells + 1];
        let (mut found, mut least, mut first) = (0, u64::MAX, 0);
        let words = self.words[level].iter().zip(&self.order.indices).zip(&self.order.merges);
        for (place, ((&word, &index), &merge)) in words.enumerate() {
            let rank = u64::from(word) << 32 | u64::from(index); // as (word, id): ids ascend
            let begins = merge > bits;
            found += usize::from(begins);
            least = if begins { u64::MAX } else { least };
            first = if rank <= least { place as u32 } else { first };
            least = least.min(rank);
            firsts[found] = first; // the last to be written of a cell stays
        }
        firsts.remove(0);
        firsts
    }

    /// 3: of all others those of least rank, as many as are missing; ascending.
    fn first_of_others(&self, level: usize, firsts: &[u32], missing: usize) -> Vec<u32> {
        let words = &self.words[level];
        let mut is_first = vec![false; words.len()];
        for &place in firsts {
            is_first[place as usize] = true;
        }
        let wanted = (firsts.len() + missing) as f64;
        let share = (wanted + 6.0 * wanted.sqrt() + 16.0) / words.len() as f64;
        let mut below = (share * 4_294_967_296.0).min(4_294_967_295.0) as u32;
        let mut places = Vec::new();
        loop {
            places.resize(words.len(), 0);
            let mut found = 0;
            for (place, (&word, &is_first)) in words.iter().zip(&is_first).enumerate() {
                places[found] = place as u32;
                found += usize::from(word <= below && !is_first);
            }
            places.truncate(found);
            if found >= missing {
                break;
            }
            below = u32::MAX;
        }
        let rank = |place: u32| {
            u64::from(words[place as usize]) << 32 | u64::from(self.order.indices[place as usize])
        };
        let mut ranks: Vec<u64> = places.iter().map(|&place| rank(place)).collect();
        let last = *ranks.select_nth_unstable(missing - 1).1;
        places.retain(|&place| rank(place) <= last);
        places
    }
}

/// How many cells are occupied at each shift.
fn count_cells(merges: &[u8]) -> [usize; KEY_BITS / 3 + 1] {
    let mut joined = [0_usize; 256];
    for &merge in merges {
        joined[usize::from(merge)] += 1;
    }
    let mut occupied = [0; KEY_BITS / 3 + 1];
    for (shift, cells) in occupied.iter_mut().enumerate() {
        *cells = joined[3 * shift + 1..].iter().sum();
    }
    occupied
}

fn merge_ascending(some: &[u32], others: &[u32]) -> Vec<u32> {
    let mut all = Vec::with_capacity(some.len() + others.len());
    let mut rest = others;
    for &number in some {
        let before = rest.iter().position(|&other| other > number).unwrap_or(rest.len());
        all.extend_from_slice(&rest[..before]);
        all.push(number);
        rest = &rest[before..];
    }
    all.extend_from_slice(rest);
    all
}
