//! Gaussians in Morton order, in which every cell of SPEC 6.3 is a run.

use super::runs::Points;
use super::survivors::Survivors;
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
        let mut entries: Vec<u128> = (0..positions[0].len())
            .map(|index| entry_of(positions.map(|row| row[index]), index as u32))
            .collect();
        entries.sort_unstable();
        Order::of(entries)
    }

    /// The same, faster, where most stand about as they stood at the last time.
    ///
    /// `points` are where they stood, in that order; `survivors` tell which of them are left, the
    /// first of those that there are now.
    pub fn again(
        last: &Order,
        points: &Points,
        survivors: &Survivors,
        positions: [&[i32]; 3],
    ) -> Self {
        let mut entries: Vec<u128> = Vec::with_capacity(positions[0].len());
        let mut far: Vec<u128> = (survivors.count()..positions[0].len())
            .map(|index| entry_of(positions.map(|row| row[index]), index as u32))
            .collect();
        for (place, (&index, &entry)) in last.indices.iter().zip(&last.entries).enumerate() {
            let Some(index) = survivors.place(index) else { continue };
            let at = positions.map(|row| row[index as usize]);
            if [0, 1, 2].iter().all(|&axis| at[axis] as f32 == points[axis][place]) {
                let key = entry >> INDEX_BITS << INDEX_BITS;
                insert(&mut entries, key | u128::from(index));
                continue;
            }
            let entry = entry_of(at, index);
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

/// The key of a position, and an index: bit b of x, y and z is bit 3b + 2, 3b + 1 and
/// 3b of the key, as in `crate::morton`, but for all 24 bits.
fn entry_of(position: [i32; 3], index: u32) -> u128 {
    let [x, y, z] = position.map(|coordinate| (coordinate + LATTICE_OFFSET) as u32);
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
