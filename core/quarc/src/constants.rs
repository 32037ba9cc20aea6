//! Constants of the format for all streams: SPEC 3.

/// The major version of the format that this crate reads and writes (SPEC 3.1).
pub const VERSION_MAJOR: u8 = 1;
/// The greatest minor version that it writes; it reads all of them.
pub const VERSION_MINOR: u8 = 1;

/// Maximum magnitude of a coordinate, in lattice units (SPEC 3.1).
pub const POSITION_LIMIT: i64 = (1 << 23) - 1;
/// Offset that makes every coordinate positive.
pub const LATTICE_OFFSET: i32 = 1 << 23;
/// Maximum magnitude of an attribute code.
pub const CODE_LIMIT: i64 = (1 << 15) - 1;
/// Frames after which an update of a Gaussian no longer counts as recent.
pub const RECENCY_LIMIT: u8 = 3;
/// Fraction bits of the rotations in a state.
pub const ROTATION_FRACTION_BITS: u32 = 22;
/// Maximum number of anchor levels.
pub const LEVEL_COUNT_LIMIT: usize = 3;
/// Residuals of an update: translation 3, rotation 3, log-scales 3, opacity 1, SH DC 3.
pub const RESIDUAL_ROWS: usize = 13;
/// Differences of a survivor: position 3, rotation 4, codes 7.
pub const SURVIVOR_ROWS: usize = 14;
/// The maximum frame ordinal, id and count.
pub const COUNTER_LIMIT: u64 = (1 << 32) - 1;

/// Resource limits of a conformance level (SPEC 3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Level {
    /// Maximum Gaussians of a frame.
    pub gaussians: u32,
    /// Maximum births of a frame.
    pub births: u32,
    /// Maximum bytes of a payload.
    pub chunk_bytes: u32,
}

impl Level {
    /// The limits of a level by its number; `None` if the level is undefined.
    #[must_use]
    pub const fn of(number: u8) -> Option<Level> {
        match number {
            10 => Some(Level { gaussians: 1 << 16, births: 1 << 12, chunk_bytes: 1 << 22 }),
            20 => Some(Level { gaussians: 1 << 18, births: 1 << 14, chunk_bytes: 1 << 24 }),
            30 => Some(Level { gaussians: 1 << 20, births: 1 << 16, chunk_bytes: 1 << 26 }),
            31 => Some(Level { gaussians: u32::MAX, births: u32::MAX, chunk_bytes: u32::MAX }),
            _ => None,
        }
    }
}
