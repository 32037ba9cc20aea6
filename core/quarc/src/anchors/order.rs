//! Gaussians in Morton order, in which the Gaussians of every cell of SPEC 6.3 are contiguous.

use super::runs::{Points, LANES};
use super::survivors::Survivors;
use crate::constants::LATTICE_OFFSET;
use crate::parallel::{both, each, ranges};
use std::ops::Range;

/// Bits of the key of a position: three axes of `LATTICE_BITS`.
pub const KEY_BITS: usize = 72;
const INDEX_BITS: u32 = 32;
const SORTED: usize = 1 << 12; // minimum number of places per task
const NEAR: usize = 32; // a Gaussian that moved by at most this many places is inserted directly

/// The Gaussians of a scene in Morton order; those at equal positions by ascending index.
#[derive(Clone, Debug, Default)]
pub struct Order {
    /// Key and index of each Gaussian, ascending.
    entries: Vec<u128>,
    /// Index of each Gaussian.
    pub indices: Vec<u32>,
    /// Position of each Gaussian.
    pub points: Points,
    /// Number of low bits in which the key of each Gaussian may differ from the previous one: 0
    /// at equal positions, `KEY_BITS + 1` for the first Gaussian.
    pub merges: Vec<u8>,
}

impl Order {
    /// Sort Gaussians by their positions.
    pub fn new(positions: [&[i32]; 3]) -> Self {
        let indices = 0..positions[0].len() as u32;
        let mut entries: Vec<u128> = indices.map(|index| entry_at(index, positions)).collect();
        entries.sort_unstable();
        Order::of(entries, positions)
    }

    /// The same result, computed faster if most Gaussians are close to their previous places.
    ///
    /// `survivors` are the Gaussians of the previous order that still exist, which come first in
    /// `positions`; `moved` has an entry for each of them: whether its position changed.
    pub fn again(
        last: &Order,
        survivors: &Survivors,
        moved: &[bool],
        positions: [&[i32]; 3],
    ) -> Self {
        let newborn = survivors.count() as u32..positions[0].len() as u32;
        let mut far: Vec<u128> = newborn.map(|index| entry_at(index, positions)).collect();
        let pieces = ranges(last.indices.len(), SORTED);
        let pieces = each(pieces, &|places| last.place_again(places, survivors, moved, positions));
        let mut pieces = pieces.into_iter();
        let (mut entries, others) = pieces.next().unwrap_or_default();
        far.extend(others);
        entries.reserve_exact(positions[0].len() - entries.len());
        for (near, others) in pieces {
            append(&mut entries, &near);
            far.extend(others);
        }
        far.sort_unstable();
        merge_in(&mut entries, &far);
        Order::of(entries, positions)
    }

    /// New entries of the survivors in a range of places: those that are still near their place,
    /// sorted, and the others, unsorted.
    fn place_again(
        &self,
        places: Range<usize>,
        survivors: &Survivors,
        moved: &[bool],
        positions: [&[i32]; 3],
    ) -> (Vec<u128>, Vec<u128>) {
        let (mut near, mut far) = (Vec::with_capacity(places.len()), Vec::new());
        let known = self.indices[places.clone()].iter().zip(&self.entries[places.clone()]);
        for (place, (&index, &entry)) in places.zip(known) {
            let Some(index) = survivors.place(index) else { continue };
            let now = if moved[index as usize] {
                let now = entry_at(index, positions);
                let low = place.checked_sub(NEAR).map_or(0, |place| self.entries[place]);
                let high = self.entries.get(place + NEAR).map_or(u128::MAX, |&entry| entry);
                if now < low || high < now {
                    far.push(now);
                    continue;
                }
                now
            } else {
                entry >> INDEX_BITS << INDEX_BITS | u128::from(index)
            };
            insert(&mut near, now); // moves at most 2 NEAR others
        }
        (near, far)
    }

    /// The order with these sorted entries.
    fn of(entries: Vec<u128>, positions: [&[i32]; 3]) -> Self {
        let indices: Vec<u32> = entries.iter().map(|&entry| entry as u32).collect();
        let row = |positions: &[i32]| {
            let mut row: Vec<f32> = Vec::with_capacity(indices.len() + LANES);
            row.extend(indices.iter().map(|&index| positions[index as usize] as f32));
            row.resize(indices.len() + LANES, 0.0);
            row
        };
        let [x, y, z] = positions;
        let ((merges, x), (y, z)) =
            both(|| both(|| find_merges(&entries), || row(x)), || both(|| row(y), || row(z)));
        Order { entries, indices, points: [x, y, z], merges }
    }

    /// The entry of `merges` for a place if the Gaussian before it were the one at `before`.
    pub fn merge_with(&self, before: u32, place: u32) -> u8 {
        merge(self.entries[before as usize], self.entries[place as usize])
    }
}

/// Whether a position precedes another in Morton order.
pub fn precedes(position: [f32; 3], other: [f32; 3]) -> bool {
    let (mut widest, mut is_before) = (0, false);
    for axis in 0..3 {
        let [a, b] = [position, other].map(|at| at[axis] as i32 + LATTICE_OFFSET);
        // The axis with the highest differing bit decides; of several, the first.
        if widest < (a ^ b) && widest < (a ^ b ^ widest) {
            (widest, is_before) = (a ^ b, a < b);
        }
    }
    is_before
}

/// The entry of a Gaussian: the key of its position, and its index.
///
/// Bit b of x, y and z is bit 3b + 2, 3b + 1 and 3b of the key, as in `crate::morton`, but for
/// all 24 bits.
#[inline]
fn entry_at(index: u32, positions: [&[i32]; 3]) -> u128 {
    let [x, y, z] = positions.map(|row| (row[index as usize] + LATTICE_OFFSET) as u32);
    let eight = |low: u32| {
        let spread = |coordinate: u32| SPREAD[(coordinate >> low & 255) as usize];
        u64::from(spread(x) << 2 | spread(y) << 1 | spread(z))
    };
    let key = u128::from(eight(16)) << 48 | u128::from(eight(8) << 24 | eight(0));
    key << INDEX_BITS | u128::from(index)
}

/// The bits of each number below 2^8, spread to every third bit.
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

fn find_merges(entries: &[u128]) -> Vec<u8> {
    let pairs = entries.windows(2).map(|pair| merge(pair[0], pair[1]));
    std::iter::once(KEY_BITS as u8 + 1).chain(pairs).collect()
}

#[inline]
fn merge(before: u128, entry: u128) -> u8 {
    (u128::BITS - (before ^ entry).leading_zeros()).saturating_sub(INDEX_BITS) as u8
}

/// Insert an entry into a sorted list, near its end.
#[inline]
fn insert(all: &mut Vec<u128>, entry: u128) {
    let mut place = all.len();
    all.push(entry);
    while place > 0 && all[place - 1] > entry {
        all[place] = all[place - 1];
        place -= 1;
    }
    all[place] = entry;
}

/// Append a sorted list of which only the beginning may belong before the end of the other.
fn append(all: &mut Vec<u128>, others: &[u128]) {
    for (number, &entry) in others.iter().enumerate() {
        if all.last().map_or(true, |&last| last < entry) {
            all.extend_from_slice(&others[number..]);
            return;
        }
        insert(all, entry);
    }
}

/// Merge a sorted list into another.
fn merge_in(all: &mut Vec<u128>, others: &[u128]) {
    let mut left = all.len();
    all.resize(left + others.len(), 0);
    for (place, &other) in others.iter().enumerate().rev() {
        while left > 0 && all[left - 1] > other {
            left -= 1;
            all[left + place + 1] = all[left];
        }
        all[left + place] = other;
    }
}
