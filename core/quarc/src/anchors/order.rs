//! Gaussians in Morton order, in which every cell of SPEC 6.3 is a run.

use super::runs::{Points, LANES};
use super::survivors::Survivors;
use crate::constants::LATTICE_OFFSET;
use crate::parallel::{both, each, ranges};
use std::ops::Range;

/// Bits of the key of a position: three axes of LATTICE_BITS.
pub const KEY_BITS: usize = 72;
const INDEX_BITS: u32 = 32;
const SORTED: usize = 1 << 12; // places of a piece of work, at least
const NEAR: usize = 32; // places that a Gaussian may be off and still be put right one by one

/// The Gaussians of a scene in Morton order, those of equal positions in ascending index.
#[derive(Clone, Debug, Default)]
pub struct Order {
    entries: Vec<u128>, // key and index
    /// The index of each.
    pub indices: Vec<u32>,
    /// Where each is.
    pub points: Points,
    /// How many low bits of the key of each are not surely those of the one before it: 0 at the
    /// same place, `KEY_BITS + 1` for the first.
    pub merges: Vec<u8>,
}

/// A Gaussian on its way to its place: key and index, and where it is.
#[derive(Clone, Copy, Default)]
struct Placed {
    entry: u128,
    at: [f32; 3],
}

impl Placed {
    fn of(index: u32, positions: [&[i32]; 3]) -> Self {
        let at = positions.map(|row| row[index as usize]);
        Placed { entry: entry_of(at, index), at: at.map(|coordinate| coordinate as f32) }
    }
}

impl Order {
    /// Sort Gaussians by their positions.
    pub fn new(positions: [&[i32]; 3]) -> Self {
        let indices = 0..positions[0].len() as u32;
        let mut placed: Vec<Placed> = indices.map(|index| Placed::of(index, positions)).collect();
        placed.sort_unstable_by_key(|placed| placed.entry);
        Order::of(&placed)
    }

    /// The same, faster, where most stand about as they stood at the last time.
    ///
    /// `survivors` tell which of them are left, the first of those that there are now, and `moved`
    /// which of these stand elsewhere.
    pub fn again(
        last: &Order,
        survivors: &Survivors,
        moved: &[bool],
        positions: [&[i32]; 3],
    ) -> Self {
        let newborn = survivors.count() as u32..positions[0].len() as u32;
        let mut far: Vec<Placed> = newborn.map(|index| Placed::of(index, positions)).collect();
        let pieces = ranges(last.indices.len(), SORTED);
        let pieces = each(pieces, &|places| last.place_again(places, survivors, moved, positions));
        let mut pieces = pieces.into_iter();
        let (mut placed, others) = pieces.next().unwrap_or_default();
        far.extend(others);
        placed.reserve_exact(positions[0].len() - placed.len());
        for (near, others) in pieces {
            append(&mut placed, &near);
            far.extend(others);
        }
        far.sort_unstable_by_key(|placed| placed.entry);
        merge_in(&mut placed, &far);
        Order::of(&placed)
    }

    /// Those at some places that are left: in order those that are still about there, and the
    /// others.
    fn place_again(
        &self,
        places: Range<usize>,
        survivors: &Survivors,
        moved: &[bool],
        positions: [&[i32]; 3],
    ) -> (Vec<Placed>, Vec<Placed>) {
        let (mut near, mut far) = (Vec::with_capacity(places.len()), Vec::new());
        let [xs, ys, zs] = [0, 1, 2].map(|axis: usize| &self.points[axis][places.clone()]);
        let points = xs.iter().zip(ys).zip(zs).map(|((&x, &y), &z)| [x, y, z]);
        let known = self.indices[places.clone()].iter().zip(&self.entries[places.clone()]);
        for (place, ((&index, &entry), at)) in places.zip(known.zip(points)) {
            let Some(index) = survivors.place(index) else { continue };
            if !moved[index as usize] {
                let entry = entry >> INDEX_BITS << INDEX_BITS | u128::from(index);
                insert(&mut near, Placed { entry, at });
                continue;
            }
            let now = Placed::of(index, positions);
            let low = place.checked_sub(NEAR).map_or(0, |place| self.entries[place]);
            let high = self.entries.get(place + NEAR).map_or(u128::MAX, |&entry| entry);
            if low <= now.entry && now.entry <= high {
                insert(&mut near, now); // passes by no more than twice NEAR others
            } else {
                far.push(now);
            }
        }
        (near, far)
    }

    /// The order of what is sorted.
    fn of(placed: &[Placed]) -> Self {
        let row = |axis: usize| {
            let mut row: Vec<f32> = Vec::with_capacity(placed.len() + LANES);
            row.extend(placed.iter().map(|placed| placed.at[axis]));
            row.resize(placed.len() + LANES, 0.0);
            row
        };
        let merges = || {
            let pairs = placed.windows(2).map(|pair| merge(pair[0].entry, pair[1].entry));
            std::iter::once(KEY_BITS as u8 + 1).chain(pairs).collect()
        };
        let (points, (merges, (entries, indices))) = both(
            || [row(0), row(1), row(2)],
            || {
                both(merges, || {
                    let indices = placed.iter().map(|placed| placed.entry as u32).collect();
                    (placed.iter().map(|placed| placed.entry).collect(), indices)
                })
            },
        );
        Order { entries, indices, points, merges }
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

/// Put one into an ascending list, near its end.
fn insert(all: &mut Vec<Placed>, placed: Placed) {
    let mut place = all.len();
    all.push(placed);
    while place > 0 && all[place - 1].entry > placed.entry {
        all[place] = all[place - 1];
        place -= 1;
    }
    all[place] = placed;
}

/// Append an ascending list of which no more than the beginning belongs before the end of another.
fn append(all: &mut Vec<Placed>, others: &[Placed]) {
    for (number, &placed) in others.iter().enumerate() {
        if all.last().map_or(true, |last| last.entry < placed.entry) {
            all.extend_from_slice(&others[number..]);
            return;
        }
        insert(all, placed);
    }
}

/// Merge an ascending list into another.
fn merge_in(all: &mut Vec<Placed>, others: &[Placed]) {
    let mut left = all.len();
    all.resize(left + others.len(), Placed::default());
    for (place, &other) in others.iter().enumerate().rev() {
        while left > 0 && all[left - 1].entry > other.entry {
            left -= 1;
            all[left + place + 1] = all[left];
        }
        all[left + place] = other;
    }
}
