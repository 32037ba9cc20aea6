//! Gaussians in Morton order, in which every cell of SPEC 6.3 is a run.

use super::NOBODY;
use crate::constants::LATTICE_OFFSET;

/// Bits of the key of a position: three axes of LATTICE_BITS.
pub const KEY_BITS: usize = 72;
const INDEX_BITS: u32 = 32;
const NEAR: usize = 32; // places that a Gaussian may be off and still be put right one by one

/// The Gaussians of a scene in Morton order, those of equal positions in ascending index.
#[derive(Clone, Debug, Default)]
pub struct Order {
    entries: Vec<u128>, // key and index
    /// The index of each.
    pub indices: Vec<u32>,
    /// How many low bits of the key of each are not surely those of the one before it: 0 at the
    /// same place, `KEY_BITS + 1` for the first.
    pub merges: Vec<u8>,
}

impl Order {
    /// Sort Gaussians by their positions.
    pub fn new(positions: [&[i32]; 3]) -> Self {
        let entry = |index| entry_of(positions, index as u32);
        let mut entries: Vec<u128> = (0..positions[0].len()).map(entry).collect();
        entries.sort_unstable();
        Order::of(entries)
    }

    /// The same, faster, where most stand about as they stood at the last time.
    ///
    /// `places` are the indices that those of the last time have now, or `NOBODY`; `newborn` are
    /// the indices that are not among these.
    pub fn again(last: &Order, places: &[u32], newborn: &[u32], positions: [&[i32]; 3]) -> Self {
        let mut entries: Vec<u128> = Vec::with_capacity(positions[0].len());
        let mut far: Vec<u128> = newborn.iter().map(|&i| entry_of(positions, i)).collect();
        for (place, &index) in last.indices.iter().enumerate() {
            let index = places[index as usize];
            if index == NOBODY {
                continue;
            }
            let entry = entry_of(positions, index);
            let low = place.checked_sub(NEAR).map_or(0, |place| last.entries[place]);
            let high = last.entries.get(place + NEAR).map_or(u128::MAX, |&entry| entry);
            if low <= entry && entry <= high {
                insert(&mut entries, entry); // passes by no more than twice NEAR others
            } else {
                far.push(entry);
            }
        }
        far.sort_unstable();
        merge_in(&mut entries, &far);
        Order::of(entries)
    }

    /// The order of sorted entries.
    fn of(entries: Vec<u128>) -> Self {
        let mut merges = Vec::with_capacity(entries.len());
        merges.push(KEY_BITS as u8 + 1);
        merges.extend(entries.windows(2).map(|pair| merge(pair[0], pair[1])));
        Order { indices: entries.iter().map(|&entry| entry as u32).collect(), entries, merges }
    }

    /// What `merges` would say of the Gaussian at a place if one before it were its predecessor.
    pub fn merge_with(&self, before: u32, place: u32) -> u8 {
        merge(self.entries[before as usize], self.entries[place as usize])
    }
}

/// Whether a position is before another in Morton order.
pub fn stands_before(position: [f32; 3], other: [f32; 3]) -> bool {
    let (mut widest, mut is_before) = (0, false);
    for axis in 0..3 {
        let [a, b] = [position, other].map(|at| at[axis] as i32 + LATTICE_OFFSET);
        // The axis that differs in the highest bit decides; of several, the first.
        if widest < (a ^ b) && widest < (a ^ b ^ widest) {
            (widest, is_before) = (a ^ b, a < b);
        }
    }
    is_before
}

/// The key of a Gaussian's position, and its index: bit b of x, y and z is bit 3b + 2, 3b + 1 and
/// 3b of the key, as in `crate::morton`, but for all 24 bits.
fn entry_of(positions: [&[i32]; 3], index: u32) -> u128 {
    let [x, y, z] = positions.map(|row| (row[index as usize] + LATTICE_OFFSET) as u32);
    let eight = |low: u32| {
        let spread = |coordinate: u32| u128::from(SPREAD[(coordinate >> low & 255) as usize]);
        spread(x) << 2 | spread(y) << 1 | spread(z)
    };
    (eight(16) << 48 | eight(8) << 24 | eight(0)) << INDEX_BITS | u128::from(index)
}

/// The bits of a number below 2^8, two places apart.
const SPREAD: [u32; 256] = {
    let mut spread = [0; 256];
    let mut number = 0;
    while number < 256 {
        let mut bit = 0;
        while bit < 8 {
            spread[number] |= (number as u32 >> bit & 1) << (3 * bit);
            bit += 1;
        }
        number += 1;
    }
    spread
};

fn merge(before: u128, entry: u128) -> u8 {
    (u128::BITS - (before ^ entry).leading_zeros()).saturating_sub(INDEX_BITS) as u8
}

/// Put an entry into an ascending list, near its end.
fn insert(entries: &mut Vec<u128>, entry: u128) {
    let mut place = entries.len();
    entries.push(entry);
    while place > 0 && entries[place - 1] > entry {
        entries[place] = entries[place - 1];
        place -= 1;
    }
    entries[place] = entry;
}

/// Merge an ascending list into another.
fn merge_in(entries: &mut Vec<u128>, others: &[u128]) {
    let mut left = entries.len();
    entries.resize(left + others.len(), 0);
    for (place, &other) in others.iter().enumerate().rev() {
        while left > 0 && entries[left - 1] > other {
            left -= 1;
            entries[left + place + 1] = entries[left];
        }
        entries[left + place] = other;
    }
}
