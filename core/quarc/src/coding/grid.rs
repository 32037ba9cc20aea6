//! The bounding box that positions of a canonical frame are relative to: SPEC 5.4, 8.5.

use crate::arithmetic::bit_length;
use crate::morton::interleave;

/// Maximum bits of a position relative to the origin.
pub const AXIS_BITS_LIMIT: u32 = 20;

/// Bounding box of the positions in a CANO or SNAP (SPEC 5.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// Minimum xyz, in position steps.
    pub origin: [i32; 3],
    /// Bits per axis of a position relative to the origin.
    pub axis_bits: u8,
}

impl Grid {
    /// The smallest box that contains the positions `[3, n]`, in position steps.
    ///
    /// `None` if they span 2^20 steps or more.
    #[must_use]
    pub fn around(positions: &[Vec<i32>; 3]) -> Option<Grid> {
        let mut grid = Grid { origin: [0; 3], axis_bits: 0 };
        for (origin, row) in grid.origin.iter_mut().zip(positions) {
            let least = row.iter().min().copied().unwrap_or(0);
            let most = row.iter().max().copied().unwrap_or(0);
            let bits = bit_length((i64::from(most) - i64::from(least)) as u64);
            if bits > AXIS_BITS_LIMIT {
                return None;
            }
            *origin = least;
            grid.axis_bits = grid.axis_bits.max(bits as u8);
        }
        Some(grid)
    }

    /// Whether all positions `[3, n]` are inside the box.
    pub(super) fn holds(&self, positions: &[Vec<i32>; 3]) -> bool {
        let within = |(row, &origin): (&Vec<i32>, &i32)| {
            let mut offsets = row.iter().map(|&number| i64::from(number) - i64::from(origin));
            offsets.all(|offset| (0..1 << self.axis_bits).contains(&offset))
        };
        u32::from(self.axis_bits) <= AXIS_BITS_LIMIT
            && positions.iter().zip(&self.origin).all(within)
    }

    /// The Morton key of a position inside the box.
    fn key(&self, position: [i32; 3]) -> u64 {
        let [x, y, z] = [0, 1, 2].map(|axis| position[axis].wrapping_sub(self.origin[axis]) as u32);
        interleave(x, y, z)
    }

    /// The keys of all positions `[3, n]`.
    #[must_use]
    pub fn keys(&self, positions: &[Vec<i32>; 3]) -> Vec<u64> {
        let [xs, ys, zs] = positions;
        xs.iter().zip(ys).zip(zs).map(|((&x, &y), &z)| self.key([x, y, z])).collect()
    }
}
