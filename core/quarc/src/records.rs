//! The parsed content of chunks: SPEC 5.

use crate::constants::Level;

/// Coded planes of one kind (SPEC 8.1): the words of the entropy coder in the order of the stream.
pub type Section = Vec<u32>;

/// Parameters of the stream from its HEAD chunk (SPEC 5.3). Parsers check their ranges.
///
/// To make a header, begin with the default one, because versions may add fields:
///
/// ```
/// # use quarc::records::Header;
/// let header = Header { sh_degree: 0, timescale: 60, ..Header::default() };
/// assert!(header.check().is_ok());
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Header {
    /// Number of the conformance level (SPEC 3.2).
    pub level: u8,
    /// Ticks of the clock per second.
    pub timescale: u32,
    /// Ticks from one frame to the next.
    pub frame_ticks: u32,
    /// A lattice unit is 2^-lattice_exponent world units.
    pub lattice_exponent: u8,
    /// Step of canonical and new positions, lattice units.
    pub position_step: u16,
    /// Step of translation residuals, lattice units.
    pub translation_step: u16,
    /// The w of an identity residual, in rotation steps.
    pub rotation_unity: u16,
    /// 3 if residuals have no w, otherwise 4.
    pub rotation_components: u8,
    /// Fraction bits of the rotations of canonical frames and births.
    pub rotation_bits: u8,
    /// Step of the log-scale codes.
    pub log_scale_step: f32,
    /// Step of the opacity logit codes.
    pub opacity_step: f32,
    /// Step of the codes of SH degree 0.
    pub sh_dc_step: f32,
    /// Step of the codes of SH degree 1.
    pub sh_rest_step: f32,
    /// SH degree: 0 or 1.
    pub sh_degree: u8,
    /// Number of anchor levels, 1 to 3.
    pub level_count: u8,
    /// Gaussians per anchor of level 1.
    pub gaussians_per_anchor: u16,
    /// Anchors of a level per anchor of the next coarser level.
    pub anchor_ratio: u16,
    /// Frames from one sampling of anchors to the next.
    pub resample_interval: u16,
    /// Frames from one state CRC over all fields to the next.
    pub full_crc_interval: u16,
    /// Seed of the sampler.
    pub seed: u64,
    /// Whether the world frame is right-handed.
    pub right_handed: bool,
    /// Up axis: 0 unknown, otherwise 1 to 6 for +x, -x, +y, -y, +z, -z.
    pub up_axis: u8,
    /// Meters per world unit; 0 if unknown.
    pub meters_per_unit: f32,
    /// 1: colors are sRGB-encoded and blended without decoding.
    pub color_space: u8,
    /// Whether frames may update single Gaussians: feature bit 1 (SPEC 12).
    pub updates: bool,
    /// Whether canonical frames may be snapshots: feature bit 2.
    pub snapshots: bool,
}

/// A stream of level 10 with 30 frames per second and SH of degree 1, without optional features.
impl Default for Header {
    fn default() -> Self {
        Header {
            level: 10,
            timescale: 30,
            frame_ticks: 1,
            lattice_exponent: 12,
            position_step: 4,
            translation_step: 7,
            rotation_unity: 100,
            rotation_components: 3,
            rotation_bits: 8,
            log_scale_step: 1.0 / 16.0,
            opacity_step: 1.0 / 8.0,
            sh_dc_step: 1.0 / 32.0,
            sh_rest_step: 1.0 / 32.0,
            sh_degree: 1,
            level_count: 3,
            gaussians_per_anchor: 4,
            anchor_ratio: 3,
            resample_interval: 2,
            full_crc_interval: 32,
            seed: 0,
            right_handed: true,
            up_axis: 0,
            meters_per_unit: 0.0,
            color_space: 1,
            updates: false,
            snapshots: false,
        }
    }
}

impl Header {
    /// The limits of the stream's level.
    ///
    /// # Panics
    /// If the level is undefined; parsers reject such headers.
    #[must_use]
    pub fn limits(&self) -> Level {
        Level::of(self.level).expect("the level of a header is checked")
    }

    /// Number of attribute codes of a Gaussian: 7 for SH degree 0, 16 for degree 1.
    #[must_use]
    pub const fn code_planes(&self) -> usize {
        if self.sh_degree == 0 {
            7
        } else {
            16
        }
    }

    /// Number of symbols of an anchor: three of translation, three or four of rotation.
    #[must_use]
    pub const fn symbol_planes(&self) -> usize {
        3 + self.rotation_components as usize
    }
}

/// A coded canonical frame: the CANO chunk (SPEC 5.4).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CanonicalChunk {
    /// Ordinal of the frame in the stream.
    pub frame: u32,
    /// Number of Gaussians in the frame.
    pub gaussian_count: u32,
    /// Minimum xyz of the positions, in position steps.
    pub origin: [i32; 3],
    /// Bits per axis of a position relative to the origin.
    pub axis_bits: u8,
    /// Positions, SH DC, opacity, log-scales, rotations, SH rest.
    pub sections: [Section; 6],
    /// CRC-32 of the decoded state.
    pub state_crc: u32,
}

/// A coded frame that changes the previous one: the FRAM chunk (SPEC 5.5).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameChunk {
    /// Frames since the canonical frame.
    pub phase: u32,
    /// Whether the motion of the previous frame selects contexts.
    pub previous_contexts: bool,
    /// Gaussians deleted before the motion.
    pub death_count: u32,
    /// Gaussians added after the motion.
    pub birth_count: u32,
    /// The symbols of the anchors.
    pub motion: Section,
    /// Updates of single Gaussians; `None` if the stream has none.
    pub updates: Option<Section>,
    /// The births; empty if there are none.
    pub births: Section,
    /// CRC-32 of the decoded state.
    pub state_crc: u32,
}

/// A canonical frame coded against the last CANO: the SNAP chunk (SPEC 5.10).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SnapshotChunk {
    /// Ordinal of the frame in the stream.
    pub frame: u32,
    /// Ordinal of the CANO's frame.
    pub canonical: u32,
    /// Number of new Gaussians, which are not in the CANO.
    pub newborn_count: u32,
    /// Minimum xyz of their positions, in position steps.
    pub origin: [i32; 3],
    /// Bits per axis of their positions relative to the origin.
    pub axis_bits: u8,
    /// Which Gaussians of the CANO survive, and their differences.
    pub survivors: Section,
    /// Sections of the new Gaussians, as in a CANO.
    pub sections: [Section; 6],
    /// CRC-32 of the decoded state.
    pub state_crc: u32,
}

/// Coded Gaussians, in quantization steps (SPEC 5.4), plane by plane.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Gaussians {
    /// xyz, in position steps.
    pub positions: [Vec<i32>; 3],
    /// Index of the largest component, which is taken to be positive, then the other three in
    /// order, in units of 2^-rotation_bits.
    pub rotations: [Vec<i32>; 4],
    /// Log-scale 3, opacity 1, SH DC 3, SH rest 9 or none.
    pub codes: Vec<Vec<i32>>,
}

impl Gaussians {
    /// Number of Gaussians.
    #[must_use]
    pub fn count(&self) -> usize {
        self.positions[0].len()
    }
}

/// The births of a frame (SPEC 7.6).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Births {
    /// Index in the scene of the parent of each new Gaussian, ascending.
    pub parents: Vec<u32>,
    /// Positions relative to the parent's; rotations and codes are absolute.
    pub newborn: Gaussians,
}

/// Updates of single Gaussians in a frame (SPEC 7.8).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Updates {
    /// Index in the scene of each updated Gaussian, ascending.
    pub gaussians: Vec<u32>,
    /// Which of them are deleted.
    pub dies: Vec<bool>,
    /// `RESIDUAL_ROWS` planes of residuals, in steps; 0 for deleted Gaussians.
    pub residuals: Vec<Vec<i32>>,
}

/// The totals of a complete stream: the TAIL chunk (SPEC 5.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tail {
    /// Number of frames.
    pub frame_count: u32,
    /// Number of canonical frames.
    pub canonical_count: u32,
    /// Byte offset of INDX; 0 if there is none.
    pub index_offset: u64,
}

/// The position of a canonical frame: an entry of the INDX chunk (SPEC 5.9).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SeekPoint {
    /// Byte offset of the chunk in the stream.
    pub offset: u64,
    /// Its sequence number.
    pub sequence: u32,
    /// Ordinal of its frame.
    pub frame: u32,
}
