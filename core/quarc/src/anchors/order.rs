//! Gaussians in Morton order, in which every cell of SPEC 6.3 is a run.

use crate::constants::LATTICE_OFFSET;
use crate::morton::interleave;

/// Bits of the key of a position: three axes of LATTICE_BITS.
pub const KEY_BITS: usize = 72;
const INDEX_BITS: u32 = 32;
const LOW_BITS: u32 = 3; // of an axis, that `interleave` has no room for
const SPREAD: [u64; 8] = [0, 1, 8, 9, 64, 65, 72, 73]; // three bits, two places apart
const PATIENCE: usize = 8;

/// The Gaussians of a scene in Morton order, those of equal positions in ascending index.
#[derive(Clone, Debug, Default)]
pub struct Order {
    entries: Vec<u128>, // key and index
    /// How many low bits of the key of each are not surely those of the one before it: 0 at the
    /// same place, `KEY_BITS + 1` for the first.
    pub merges: Vec<u8>,
}

impl Order {
    /// Sort Gaussians at positions; the nearer they stand to that order in `hint`, a permutation
    /// of their indices, the faster.
    pub fn new(positions: [&[i32]; 3], hint: impl Iterator<Item = u32>) -> Self {
        let [x, y, z] = positions;
        let mut entries: Vec<u128> = hint
            .map(|index| {
                let i = index as usize;
                u128::from(index) | key_of(x[i], y[i], z[i]) << INDEX_BITS
            })
            .collect();
        sort_nearly_sorted(&mut entries);
        let mut merges = Vec::with_capacity(entries.len());
        merges.push(KEY_BITS as u8 + 1);
        merges.extend(entries.windows(2).map(|pair| merge(pair[0], pair[1])));
        Order { entries, merges }
    }

    /// The index of each, in order.
    pub fn indices(&self) -> impl Iterator<Item = u32> + '_ {
        self.entries.iter().map(|&entry| entry as u32)
    }

    /// The index of the Gaussian at a place.
    pub fn index(&self, place: u32) -> u32 {
        self.entries[place as usize] as u32
    }

    /// What `merges` would say of the Gaussian at a place if one before it were its predecessor.
    pub fn merge_with(&self, before: u32, place: u32) -> u8 {
        merge(self.entries[before as usize], self.entries[place as usize])
    }
}

/// The 72 bits of a position's key.
fn key_of(x: i32, y: i32, z: i32) -> u128 {
    let [x, y, z] = [x, y, z].map(|coordinate| (coordinate + LATTICE_OFFSET) as u32);
    let high = interleave(x >> LOW_BITS, y >> LOW_BITS, z >> LOW_BITS);
    let low = |coordinate: u32| SPREAD[(coordinate & 7) as usize];
    u128::from(high) << (3 * LOW_BITS) | u128::from(low(x) << 2 | low(y) << 1 | low(z))
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

fn merge(before: u128, entry: u128) -> u8 {
    (u128::BITS - (before ^ entry).leading_zeros()).saturating_sub(INDEX_BITS) as u8
}

/// Sort different numbers that mostly ascend: what does not is sorted aside and merged in.
fn sort_nearly_sorted(numbers: &mut [u128]) {
    let (mut kept, mut dropped, mut in_a_row) = (0, Vec::new(), 0);
    let mut i = 0;
    while i < numbers.len() {
        let number = numbers[i];
        if kept == 0 || numbers[kept - 1] < number {
            numbers[kept] = number;
            (kept, in_a_row) = (kept + 1, 0);
        } else if in_a_row < PATIENCE {
            dropped.push(number);
            in_a_row += 1;
        } else {
            // So many are not all out of place: the one before them is.
            dropped.truncate(dropped.len() - in_a_row);
            i -= in_a_row;
            kept -= 1;
            dropped.push(numbers[kept]);
            in_a_row = 0;
            continue;
        }
        i += 1;
    }
    dropped.sort_unstable();
    let mut last = kept;
    for place in (0..dropped.len()).rev() {
        while last > 0 && numbers[last - 1] > dropped[place] {
            numbers[last + place] = numbers[last - 1];
            last -= 1;
        }
        numbers[last + place] = dropped[place];
    }
}
