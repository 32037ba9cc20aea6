//! Chunks other than frames: `came`, `meta`, TAIL and INDX (SPEC 5.6 to 5.9).

use super::fields::{count, rejected, within, Fields, Payload};
use crate::error::{Error, Result};
use crate::records::{SeekPoint, Tail};

/// A pinhole camera (SPEC 5.6), which looks along its +z axis, with x to the right and y down.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Its name in the capture.
    pub name: String,
    /// Whether it was excluded from training.
    pub held_out: bool,
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
    /// Focal length along x and y, pixels.
    pub focal: [f32; 2],
    /// Principal point, pixels; the center of the first pixel is (0.5, 0.5).
    pub center: [f32; 2],
    /// Rotation from world to camera, row by row.
    pub rotation: [f32; 9],
    /// Translation from world to camera, world units.
    pub translation: [f32; 3],
    /// Minimum depth that the camera sees, world units.
    pub near: f32,
}

/// Texts by unique keys, in the order of the stream (SPEC 5.7).
pub type Metadata = Vec<(String, String)>;

/// Parse `came`.
///
/// # Errors
/// `field`, `trailing-data`.
pub fn parse_cameras(payload: &[u8]) -> Result<Vec<Camera>> {
    let mut fields = Fields::new(payload);
    let number = fields.u16()?;
    let cameras = (0..number).map(|_| read_camera(&mut fields)).collect::<Result<_>>()?;
    fields.end()?;
    Ok(cameras)
}

/// Build the payload of `came`.
///
/// # Errors
/// [`Error::Encode`] if a field is out of range, or if there are too many cameras.
pub fn build_cameras(cameras: &[Camera]) -> Result<Vec<u8>> {
    let mut payload = Payload::default();
    payload.u16(count(cameras.len(), "cameras")?);
    for camera in cameras {
        check_camera(camera).map_err(Error::Encode)?;
        payload.text8(&camera.name)?;
        payload.u8(camera.held_out.into());
        payload.u32(camera.width);
        payload.u32(camera.height);
        payload.f32s(&camera.focal);
        payload.f32s(&camera.center);
        payload.f32s(&camera.rotation);
        payload.f32s(&camera.translation);
        payload.f32s(&[camera.near]);
    }
    Ok(payload.bytes)
}

/// Parse `meta`. If a key occurs more than once, the last entry counts.
///
/// # Errors
/// `field`, `trailing-data`.
pub fn parse_metadata(payload: &[u8]) -> Result<Metadata> {
    let mut fields = Fields::new(payload);
    let mut metadata = Metadata::new();
    let mut order: Vec<u16> = Vec::new(); // places in `metadata`, by key
    for _ in 0..fields.u16()? {
        let length = fields.u8()?;
        let key = fields.text(length.into())?;
        let length = fields.u32()?;
        let value = fields.text(length as usize)?;
        match order.binary_search_by(|&place| metadata[usize::from(place)].0.cmp(&key)) {
            Ok(found) => metadata[usize::from(order[found])].1 = value,
            Err(place) => {
                order.insert(place, metadata.len() as u16);
                metadata.push((key, value));
            }
        }
    }
    fields.end()?;
    Ok(metadata)
}

/// Build the payload of `meta`.
///
/// # Errors
/// [`Error::Encode`] if there are too many entries, or an entry is too long.
pub fn build_metadata(metadata: &[(String, String)]) -> Result<Vec<u8>> {
    let mut payload = Payload::default();
    payload.u16(count(metadata.len(), "entries")?);
    for (key, value) in metadata {
        payload.text8(key)?;
        payload.text32(value)?;
    }
    Ok(payload.bytes)
}

/// Parse TAIL.
///
/// # Errors
/// `field`, `trailing-data`.
pub fn parse_tail(payload: &[u8]) -> Result<Tail> {
    let mut fields = Fields::new(payload);
    let tail = Tail {
        frame_count: fields.u32()?,
        canonical_count: fields.u32()?,
        index_offset: fields.u64()?,
    };
    fields.end()?;
    Ok(tail)
}

/// Build the payload of TAIL.
#[must_use]
pub fn build_tail(tail: &Tail) -> Vec<u8> {
    let mut payload = Payload::default();
    payload.u32(tail.frame_count);
    payload.u32(tail.canonical_count);
    payload.u64(tail.index_offset);
    payload.bytes
}

/// Parse INDX.
///
/// # Errors
/// `field`, `trailing-data`.
pub fn parse_index(payload: &[u8]) -> Result<Vec<SeekPoint>> {
    let mut fields = Fields::new(payload);
    let number = fields.u32()?;
    let points = (0..number)
        .map(|_| {
            Ok(SeekPoint { offset: fields.u64()?, sequence: fields.u32()?, frame: fields.u32()? })
        })
        .collect::<Result<_>>()?;
    fields.end()?;
    Ok(points)
}

/// Build the payload of INDX.
///
/// # Errors
/// [`Error::Encode`] if there are too many seek points.
pub fn build_index(points: &[SeekPoint]) -> Result<Vec<u8>> {
    let mut payload = Payload::default();
    payload.u32(count(points.len(), "seek points")?);
    for point in points {
        payload.u64(point.offset);
        payload.u32(point.sequence);
        payload.u32(point.frame);
    }
    Ok(payload.bytes)
}

fn read_camera(fields: &mut Fields) -> Result<Camera> {
    let length = fields.u8()?;
    let camera = Camera {
        name: fields.text(length.into())?,
        held_out: fields.flag("held_out")?,
        width: fields.u32()?,
        height: fields.u32()?,
        focal: fields.f32s()?,
        center: fields.f32s()?,
        rotation: fields.f32s()?,
        translation: fields.f32s()?,
        near: fields.f32s::<1>()?[0],
    };
    check_camera(&camera).map_err(rejected)?;
    Ok(camera)
}

/// Check the ranges of SPEC 5.6. [5-3]
fn check_camera(camera: &Camera) -> std::result::Result<(), String> {
    within("width", camera.width, 1, u32::MAX)?;
    within("height", camera.height, 1, u32::MAX)?;
    let mut lengths = camera.focal.into_iter().chain([camera.near]);
    if !lengths.all(|number| number.is_finite() && number > 0.0) {
        return Err("fx, fy and near must be finite and above 0".into());
    }
    let mut numbers = camera.center.iter().chain(&camera.rotation).chain(&camera.translation);
    if !numbers.all(|number| number.is_finite()) {
        return Err("a number of a camera is not finite".into());
    }
    Ok(())
}
