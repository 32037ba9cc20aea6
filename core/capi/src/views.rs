//! The structs of the C interface.

use quarc::floats::{Redone, Splats};
use quarc::records::Header;
use quarc::recover::Gap;
use quarc::state::State;
use quarc::wire::Camera;
use std::ffi::{c_char, CStr};

/// Bit of `quarc_splats.changed`: the positions changed.
pub const QUARC_POSITIONS: u32 = 1;
/// Bit of `quarc_splats.changed`: the rotations changed.
pub const QUARC_ROTATIONS: u32 = 2;
/// Bit of `quarc_splats.changed`: log-scales, opacities and SH changed.
pub const QUARC_CODES: u32 = 4;

/// Parameters of the stream from its HEAD chunk (SPEC 5.3) that a player needs.
#[repr(C)]
pub struct HeadView {
    /// Frames per second are `timescale / frame_ticks`.
    pub timescale: u32,
    /// Ticks per frame.
    pub frame_ticks: u32,
    /// The level of the stream: 10, 20, 30, or 31 for none (SPEC 3.2).
    pub level: u32,
    /// Positions of the state are in units of 2^-lattice_exponent world units.
    pub lattice_exponent: u32,
    /// Quantization step of the log-scale codes.
    pub log_scale_step: f32,
    /// Quantization step of the opacity codes.
    pub opacity_step: f32,
    /// Quantization step of the codes of SH degree 0.
    pub sh_dc_step: f32,
    /// Quantization step of the codes of SH degree 1.
    pub sh_rest_step: f32,
    /// SH degree: 0 or 1.
    pub sh_degree: u32,
    /// 1 if the world is right-handed, else 0.
    pub right_handed: u32,
    /// 0 unknown, else 1 to 6 for +x, -x, +y, -y, +z, -z.
    pub up_axis: u32,
    /// Size of a world unit in meters; 0 if unknown.
    pub meters_per_unit: f32,
    /// 1 if frames may change the codes of single Gaussians, else 0: then a Gaussian keeps its
    /// codes up to the next canonical frame.
    pub updates: u32,
}

impl HeadView {
    pub(crate) fn of(header: &Header) -> Self {
        HeadView {
            timescale: header.timescale,
            frame_ticks: header.frame_ticks,
            level: header.level.into(),
            lattice_exponent: header.lattice_exponent.into(),
            log_scale_step: header.log_scale_step,
            opacity_step: header.opacity_step,
            sh_dc_step: header.sh_dc_step,
            sh_rest_step: header.sh_rest_step,
            sh_degree: header.sh_degree.into(),
            right_handed: header.right_handed.into(),
            up_axis: header.up_axis.into(),
            meters_per_unit: header.meters_per_unit,
            updates: header.updates.into(),
        }
    }
}

/// The integer state of a frame (SPEC 7.1), in the memory of the decoder.
///
/// A row is `count` contiguous numbers; rows are `stride` numbers apart:
/// the y of Gaussian i is `positions[positions_stride + i]`.
#[repr(C)]
pub struct StateView {
    /// Ordinal of the frame in the stream.
    pub frame: u32,
    /// Frames since the last canonical frame; 0 for a canonical frame.
    pub phase: u32,
    /// Number of Gaussians, N.
    pub count: usize,
    /// N ids, ascending.
    pub ids: *const u32,
    /// 3 rows: xyz, lattice units.
    pub positions: *const i32,
    /// Distance between rows of positions, in numbers.
    pub positions_stride: usize,
    /// 4 rows: wxyz of unit quaternions with 22 fraction bits.
    pub rotations: *const i32,
    /// Distance between rows of rotations, in numbers.
    pub rotations_stride: usize,
    /// `code_rows` rows: log-scale 3, opacity 1, SH DC 3, SH rest 9 or none.
    pub codes: *const i16,
    /// Distance between rows of codes, in numbers.
    pub codes_stride: usize,
    /// 7 at SH degree 0, 16 at 1.
    pub code_rows: usize,
}

impl StateView {
    pub(crate) fn of(state: &State) -> Self {
        let (positions, rotations, codes) = (state.positions(), state.rotations(), state.codes());
        StateView {
            frame: state.frame_ordinal(),
            phase: state.phase(),
            count: state.count(),
            ids: state.ids().as_ptr(),
            positions: positions.numbers().as_ptr(),
            positions_stride: positions.stride(),
            rotations: rotations.numbers().as_ptr(),
            rotations_stride: rotations.stride(),
            codes: codes.numbers().as_ptr(),
            codes_stride: codes.stride(),
            code_rows: codes.rows(),
        }
    }
}

/// A state as floats (SPEC 10.1), one row per Gaussian and without activation, as 3DGS stores them.
#[repr(C)]
pub struct SplatsView {
    /// Number of Gaussians, N.
    pub count: usize,
    /// N x 3: xyz, world units.
    pub positions: *const f32,
    /// N x 4: wxyz, unit to within 2^-21.
    pub rotations: *const f32,
    /// N x 3: natural logarithms of the standard deviations, world units.
    pub log_scales: *const f32,
    /// N: logits.
    pub opacities: *const f32,
    /// N x `sh_coefficients` x 3: red, green, blue of each coefficient.
    pub sh: *const f32,
    /// 1 at SH degree 0, 4 at 1.
    pub sh_coefficients: usize,
    /// Bits QUARC_POSITIONS, QUARC_ROTATIONS, QUARC_CODES: the arrays that differ from the state
    /// dequantized before; the other arrays are unchanged.
    pub changed: u32,
}

impl SplatsView {
    pub(crate) fn of(state: &State, splats: &Splats, redone: Redone) -> Self {
        let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
        SplatsView {
            count: state.count(),
            positions: splats.positions.as_ptr(),
            rotations: splats.rotations.as_ptr(),
            log_scales: splats.log_scales.as_ptr(),
            opacities: splats.opacities.as_ptr(),
            sh: splats.sh.as_ptr(),
            sh_coefficients: (state.header().code_planes() - 4) / 3,
            changed: bit(redone.positions, QUARC_POSITIONS)
                | bit(redone.rotations, QUARC_ROTATIONS)
                | bit(redone.codes, QUARC_CODES),
        }
    }
}

/// A part of a damaged stream that was skipped (SPEC 11.4).
#[repr(C)]
pub struct GapView {
    /// Offset of its first byte.
    pub offset: u64,
    /// Its length in bytes.
    pub bytes: u64,
    /// Number of frames lost; -1 if unknown.
    pub frames_lost: i64,
    /// Reject id of SPEC 3.3: why decoding stopped at its beginning.
    pub reject_id: *const c_char,
}

impl GapView {
    pub(crate) fn of(gap: &Gap, reject_id: &CStr) -> Self {
        let lost = gap.frames_lost.and_then(|lost| i64::try_from(lost).ok());
        GapView {
            offset: gap.offset,
            bytes: gap.bytes,
            frames_lost: lost.unwrap_or(-1),
            reject_id: reject_id.as_ptr(),
        }
    }
}

/// UTF-8 text. It is not zero-terminated and may contain zeros.
#[repr(C)]
pub struct TextView {
    /// The bytes of the text.
    pub bytes: *const u8,
    /// Number of bytes.
    pub length: usize,
}

impl TextView {
    fn of(text: &str) -> Self {
        TextView { bytes: text.as_ptr(), length: text.len() }
    }
}

/// A camera of the capture (SPEC 5.6).
#[repr(C)]
pub struct CameraView {
    /// Its name in the capture.
    pub name: TextView,
    /// 1 if the camera was held out of training, else 0.
    pub held_out: u32,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// fx and fy, pixels.
    pub focal: [f32; 2],
    /// cx and cy, pixels; the center of the first pixel is (0.5, 0.5).
    pub center: [f32; 2],
    /// Rotation from world to camera, row-major.
    pub rotation: [f32; 9],
    /// Translation from world to camera, world units.
    pub translation: [f32; 3],
    /// Near plane: the smallest visible depth, world units.
    pub near_plane: f32, // Windows defines `near` as a macro
}

impl CameraView {
    pub(crate) fn of(camera: &Camera) -> Self {
        CameraView {
            name: TextView::of(&camera.name),
            held_out: camera.held_out.into(),
            width: camera.width,
            height: camera.height,
            focal: camera.focal,
            center: camera.center,
            rotation: camera.rotation,
            translation: camera.translation,
            near_plane: camera.near,
        }
    }
}

/// An entry of the metadata (SPEC 5.7).
#[repr(C)]
pub struct EntryView {
    /// The key; unique in the stream.
    pub key: TextView,
    /// The value.
    pub value: TextView,
}

impl EntryView {
    pub(crate) fn of((key, value): &(String, String)) -> Self {
        EntryView { key: TextView::of(key), value: TextView::of(value) }
    }
}
