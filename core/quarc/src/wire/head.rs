//! HEAD: SPEC 5.3 and 12.

use super::fields::{rejected, within, Fields, Payload};
use crate::constants::{Level, LEVEL_COUNT_LIMIT, VERSION_MAJOR, VERSION_MINOR};
use crate::error::{Error, Reject, Result};
use crate::records::Header;

const FEATURE_UPDATES: u32 = 2;
const FEATURE_SNAPSHOTS: u32 = 4;
const KNOWN_INCOMPATIBLE_FEATURES: u32 = FEATURE_UPDATES | FEATURE_SNAPSHOTS;
const LATTICE_EXPONENT_LIMIT: u8 = 24;
const ROTATION_UNITY_LIMIT: u16 = 256;
const ROTATION_BITS_LIMIT: u8 = 14;
const STEP_LIMIT: u32 = 1024;
const METERS_LIMIT: u32 = 1_000_000;

/// Parse HEAD.
///
/// # Errors
/// `unsupported-version`, `unsupported-feature`, `field`, `trailing-data`.
pub fn parse_header(payload: &[u8]) -> Result<Header> {
    let mut fields = Fields::new(payload);
    let features = read_features(&mut fields)?; // [5.3-1] before all other fields
    let header = Header {
        level: fields.u8()?,
        timescale: fields.u32()?,
        frame_ticks: fields.u32()?,
        lattice_exponent: fields.u8()?,
        position_step: fields.u16()?,
        translation_step: fields.u16()?,
        rotation_unity: fields.u16()?,
        rotation_components: fields.u8()?,
        rotation_bits: fields.u8()?,
        log_scale_step: fields.f32()?,
        opacity_step: fields.f32()?,
        sh_dc_step: fields.f32()?,
        sh_rest_step: fields.f32()?,
        sh_degree: fields.u8()?,
        level_count: fields.u8()?,
        gaussians_per_anchor: fields.u16()?,
        anchor_ratio: fields.u16()?,
        resample_interval: fields.u16()?,
        full_crc_interval: fields.u16()?,
        seed: fields.u64()?,
        right_handed: fields.flag("right_handed")?,
        up_axis: fields.u8()?,
        meters_per_unit: fields.f32()?,
        color_space: fields.u8()?,
        updates: features & FEATURE_UPDATES != 0,
        snapshots: features & FEATURE_SNAPSHOTS != 0,
    };
    fields.end()?;
    check_ranges(&header).map_err(rejected)?;
    Ok(header)
}

/// Build the payload of HEAD, with the lowest version that has the features used.
///
/// # Errors
/// [`Error::Encode`] if a field is out of range.
pub fn build_header(header: &Header) -> Result<Vec<u8>> {
    header.check()?;
    let mut payload = Payload::default();
    write_features(&mut payload, header);
    payload.u8(header.level);
    payload.u32(header.timescale);
    payload.u32(header.frame_ticks);
    payload.u8(header.lattice_exponent);
    payload.u16(header.position_step);
    payload.u16(header.translation_step);
    payload.u16(header.rotation_unity);
    payload.u8(header.rotation_components);
    payload.u8(header.rotation_bits);
    payload.f32s(&steps(header).map(|(_, step)| step));
    payload.u8(header.sh_degree);
    payload.u8(header.level_count);
    payload.u16(header.gaussians_per_anchor);
    payload.u16(header.anchor_ratio);
    payload.u16(header.resample_interval);
    payload.u16(header.full_crc_interval);
    payload.u64(header.seed);
    payload.u8(header.right_handed.into());
    payload.u8(header.up_axis);
    payload.f32s(&[header.meters_per_unit]);
    payload.u8(header.color_space);
    Ok(payload.bytes)
}

impl Header {
    /// Check the ranges of SPEC 5.3.
    ///
    /// # Errors
    /// [`Error::Encode`] if a field is out of range.
    pub fn check(&self) -> Result<()> {
        check_ranges(self).map_err(Error::Encode)
    }
}

/// Check the version and the incompatible features, and return the features.
fn read_features(fields: &mut Fields) -> Result<u32> {
    let (major, minor) = (fields.u8()?, fields.u8()?);
    if major != VERSION_MAJOR {
        let message = format!("version {major}.{minor}; this decoder reads {VERSION_MAJOR}.x");
        return Err(Error::new(Reject::UnsupportedVersion, message)); // [12-1]
    }
    let features = fields.u32()?;
    if features & !KNOWN_INCOMPATIBLE_FEATURES != 0 {
        let message = format!("incompatible features {features:#x} are not supported");
        return Err(Error::new(Reject::UnsupportedFeature, message)); // [12-2]
    }
    fields.u32()?; // any compatible features are accepted [12-3]
    Ok(features)
}

fn write_features(payload: &mut Payload, header: &Header) {
    let mut features = 0;
    if header.updates {
        features |= FEATURE_UPDATES;
    }
    if header.snapshots {
        features |= FEATURE_SNAPSHOTS;
    }
    payload.u8(VERSION_MAJOR);
    payload.u8(if features == 0 { 0 } else { VERSION_MINOR });
    payload.u32(features);
    payload.u32(0);
}

fn steps(header: &Header) -> [(&'static str, f32); 4] {
    [
        ("log_scale_step", header.log_scale_step),
        ("opacity_step", header.opacity_step),
        ("sh_dc_step", header.sh_dc_step),
        ("sh_rest_step", header.sh_rest_step),
    ]
}

/// Check the ranges of SPEC 5.3. [5-3]
fn check_ranges(header: &Header) -> std::result::Result<(), String> {
    if Level::of(header.level).is_none() {
        return Err(format!("level {} is undefined", header.level));
    }
    within("timescale", header.timescale, 1, u32::MAX)?;
    within("frame_ticks", header.frame_ticks, 1, u32::MAX)?;
    within("lattice_exponent", header.lattice_exponent, 0, LATTICE_EXPONENT_LIMIT)?;
    within("position_step", header.position_step, 1, u16::MAX)?;
    within("translation_step", header.translation_step, 1, u16::MAX)?;
    within("rotation_unity", header.rotation_unity, 1, ROTATION_UNITY_LIMIT)?;
    within("rotation_components", header.rotation_components, 3, 4)?;
    within("rotation_bits", header.rotation_bits, 1, ROTATION_BITS_LIMIT)?;
    for (name, step) in steps(header) {
        if !(step > 0.0 && step <= STEP_LIMIT as f32) {
            return Err(format!("{name} must be above 0 and at most {STEP_LIMIT}"));
        }
    }
    within("sh_degree", header.sh_degree, 0, 1)?;
    within("level_count", usize::from(header.level_count), 1, LEVEL_COUNT_LIMIT)?;
    within("gaussians_per_anchor", header.gaussians_per_anchor, 1, u16::MAX)?;
    within("anchor_ratio", header.anchor_ratio, 2, u16::MAX)?;
    within("resample_interval", header.resample_interval, 1, u16::MAX)?;
    within("full_crc_interval", header.full_crc_interval, 1, u16::MAX)?;
    within("up_axis", header.up_axis, 0, 6)?;
    if !(0.0..=METERS_LIMIT as f32).contains(&header.meters_per_unit) {
        return Err(format!("meters_per_unit must be from 0 to {METERS_LIMIT}"));
    }
    within("color_space", header.color_space, 1, 1)
}
