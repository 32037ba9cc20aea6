//! What chunks hold, parsed: SPEC 5.

use crate::constants::Level;

/// The planes of one subject, coded (SPEC 8.1): the coder's words in the order of the stream.
pub type Section = Vec<u32>;

/// What a stream chooses for itself: the HEAD chunk (SPEC 5.3), its ranges checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Number of the level that the stream keeps to (SPEC 3.2).
    pub level: u8,
    /// Ticks of the clock per second.
    pub timescale: u32,
    /// Frames follow each other by so many ticks.
    pub frame_ticks: u32,
    /// A lattice unit is 2^-lattice_exponent world units.
    pub lattice_exponent: u8,
    /// Step of canonical and newborn positions, lattice units.
    pub position_step: u16,
    /// Step of translation residuals, lattice units.
    pub translation_step: u16,
    /// The w of an identity residual, in rotation steps.
    pub rotation_unity: u16,
    /// 3 where residuals have no w, else 4.
    pub rotation_components: u8,
    /// Fraction bits of canonical and newborn rotations.
    pub rotation_bits: u8,
    /// Step of the log-scale codes.
    pub log_scale_step: f32,
    /// Step of the opacity logit codes.
    pub opacity_step: f32,
    /// Step of the codes of SH degree 0.
    pub sh_dc_step: f32,
    /// Step of the codes of SH degree 1.
    pub sh_rest_step: f32,
    /// 0 or 1.
    pub sh_degree: u8,
    /// Levels of anchors, 1 to 3.
    pub level_count: u8,
    /// Gaussians to an anchor of level 1.
    pub gaussians_per_anchor: u16,
    /// Anchors of a level to one of the next coarser.
    pub anchor_ratio: u16,
    /// Frames from one sampling of anchors to the next.
    pub resample_interval: u16,
    /// Frames from one state CRC over all fields to the next.
    pub full_crc_interval: u16,
    /// Seed of the sampler.
    pub seed: u64,
    /// Whether the world frame is right-handed.
    pub right_handed: bool,
    /// 0 unknown, else 1 to 6 for +x, -x, +y, -y, +z, -z.
    pub up_axis: u8,
    /// Size of a world unit, 0 where unknown.
    pub meters_per_unit: f32,
    /// 1: sRGB-encoded, blended as encoded.
    pub color_space: u8,
    /// Whether frames may update single Gaussians: feature bit 1 (SPEC 12).
    pub updates: bool,
    /// Whether canonical frames may be snapshots: feature bit 2.
    pub snapshots: bool,
}

impl Header {
    /// What the stream's level allows.
    ///
    /// # Panics
    /// If the level is none: no parser makes such a header.
    #[must_use]
    pub fn limits(&self) -> Level {
        Level::of(self.level).expect("the level of a header is checked")
    }

    /// Attribute codes of a Gaussian: 7 at SH degree 0, 16 at 1.
    #[must_use]
    pub const fn code_planes(&self) -> usize {
        if self.sh_degree == 0 {
            7
        } else {
            16
        }
    }

    /// Symbols of an anchor: three of translation, three or four of rotation.
    #[must_use]
    pub const fn symbol_planes(&self) -> usize {
        3 + self.rotation_components as usize
    }
}

/// A canonical frame as coded: the CANO chunk (SPEC 5.4).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CanonicalChunk {
    /// Ordinal of the frame in the stream.
    pub frame: u32,
    /// Gaussians in the frame.
    pub gaussian_count: u32,
    /// Least xyz of the positions, in position steps.
    pub origin: [i32; 3],
    /// Width of a position less the origin.
    pub axis_bits: u8,
    /// Positions, SH DC, opacity, log-scales, rotations, SH rest.
    pub sections: [Section; 6],
    /// CRC-32 of the decoded state.
    pub state_crc: u32,
}

/// A frame that moves the one before it, as coded: the FRAM chunk (SPEC 5.5).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameChunk {
    /// Frames since the canonical one.
    pub phase: u32,
    /// Whether the last frame's motion gives contexts.
    pub previous_contexts: bool,
    /// Gaussians that leave before the motion.
    pub death_count: u32,
    /// Gaussians that join after it.
    pub birth_count: u32,
    /// The anchors' symbols.
    pub motion: Section,
    /// What changes single Gaussians; `None` in a stream without updates.
    pub updates: Option<Section>,
    /// The newborn; empty where there are none.
    pub births: Section,
    /// CRC-32 of the decoded state.
    pub state_crc: u32,
}

/// A canonical frame as coded against the last CANO: the SNAP chunk (SPEC 5.10).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SnapshotChunk {
    /// Ordinal of the frame in the stream.
    pub frame: u32,
    /// Ordinal of the frame of the CANO.
    pub canonical: u32,
    /// Gaussians that the CANO has not.
    pub newborn_count: u32,
    /// Least xyz of their positions, in position steps.
    pub origin: [i32; 3],
    /// Width of a position less the origin.
    pub axis_bits: u8,
    /// Which Gaussians of the CANO are still there, and how they differ.
    pub survivors: Section,
    /// Of the newborn, as a CANO has them.
    pub sections: [Section; 6],
    /// CRC-32 of the decoded state.
    pub state_crc: u32,
}

/// Gaussians as they are coded, in steps (SPEC 5.4); plane by plane.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gaussians {
    /// xyz, in position steps.
    pub positions: [Vec<i32>; 3],
    /// Index of the largest component, then the other three in order, in units of
    /// 2^-rotation_bits of it being positive.
    pub rotations: [Vec<i32>; 4],
    /// Log-scale 3, opacity 1, SH DC 3, SH rest 9 or none.
    pub codes: Vec<Vec<i32>>,
}

impl Gaussians {
    /// How many.
    #[must_use]
    pub fn count(&self) -> usize {
        self.positions[0].len()
    }
}

/// The newborn of a frame (SPEC 7.6).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Births {
    /// Index in the scene of each newborn's parent, ascending.
    pub parents: Vec<u32>,
    /// Positions less the parent's; rotations and codes as they are.
    pub newborn: Gaussians,
}

/// What a frame does to single Gaussians (SPEC 7.8).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Updates {
    /// Index in the scene of each Gaussian that is updated, ascending.
    pub gaussians: Vec<u32>,
    /// Which of them leave.
    pub dies: Vec<bool>,
    /// `RESIDUAL_ROWS` planes of residuals, in steps; zero for those that leave.
    pub residuals: Vec<Vec<i32>>,
}

/// The totals of a finished stream: the TAIL chunk (SPEC 5.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tail {
    /// Frames of the stream.
    pub frame_count: u32,
    /// Canonical frames of it.
    pub canonical_count: u32,
    /// Where INDX begins; 0 without one.
    pub index_offset: u64,
}

/// Where a canonical frame stands: an entry of the INDX chunk (SPEC 5.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeekPoint {
    /// Where the chunk begins in the stream.
    pub offset: u64,
    /// Its sequence number.
    pub sequence: u32,
    /// Ordinal of its frame.
    pub frame: u32,
}
