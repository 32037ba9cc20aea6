//! CANO, FRAM and SNAP: SPEC 5.4, 5.5 and 5.10.

use super::fields::{rejected, within, Fields, Payload};
use crate::error::{Error, Result};
use crate::records::{CanonicalChunk, FrameChunk, Section, SnapshotChunk};

const AXIS_BITS_LIMIT: u8 = 20;
const SECTIONS: usize = 6;

/// Bytes of a CANO payload before its sections.
pub const CANONICAL_START_BYTES: usize = 21;

/// Parse CANO.
///
/// # Errors
/// `field`, `trailing-data`.
pub fn parse_canonical(payload: &[u8]) -> Result<CanonicalChunk> {
    let mut fields = Fields::new(payload);
    let start = parse_canonical_start(fields.bytes(CANONICAL_START_BYTES)?)?;
    let chunk =
        CanonicalChunk { sections: read_sections(&mut fields)?, state_crc: fields.u32()?, ..start };
    fields.end()?;
    Ok(chunk)
}

/// Parse the first [`CANONICAL_START_BYTES`] of a CANO payload: the fields before its sections.
///
/// # Errors
/// `field`.
pub fn parse_canonical_start(payload: &[u8]) -> Result<CanonicalChunk> {
    let mut fields = Fields::new(payload);
    Ok(CanonicalChunk {
        frame: fields.u32()?,
        gaussian_count: fields.u32()?,
        origin: read_origin(&mut fields)?,
        axis_bits: read_axis_bits(&mut fields)?,
        sections: Default::default(),
        state_crc: 0,
    })
}

/// Parse a single section, with its number of words.
///
/// # Errors
/// `field`.
pub fn parse_section(bytes: &[u8]) -> Result<Section> {
    Fields::new(bytes).section()
}

/// Build the payload of CANO.
///
/// # Errors
/// [`Error::Encode`] if a field is out of range.
pub fn build_canonical(chunk: &CanonicalChunk) -> Result<Vec<u8>> {
    let mut payload = Payload::default();
    payload.u32(chunk.frame);
    payload.u32(chunk.gaussian_count);
    write_box(&mut payload, chunk.origin, chunk.axis_bits)?;
    for section in &chunk.sections {
        payload.section(section)?;
    }
    payload.u32(chunk.state_crc);
    Ok(payload.bytes)
}

/// Parse FRAM; `updates` is whether the stream has updates.
///
/// # Errors
/// `field`, `trailing-data`.
pub fn parse_frame(payload: &[u8], updates: bool) -> Result<FrameChunk> {
    let mut fields = Fields::new(payload);
    let chunk = FrameChunk {
        phase: fields.u32()?,
        previous_contexts: fields.flag("previous_contexts")?,
        death_count: fields.u32()?,
        birth_count: fields.u32()?,
        motion: fields.section()?,
        updates: if updates { Some(fields.section()?) } else { None },
        births: fields.section()?,
        state_crc: fields.u32()?,
    };
    fields.end()?;
    Ok(chunk)
}

/// Build the payload of FRAM, with updates if the chunk has them.
///
/// # Errors
/// [`Error::Encode`] if a section is too long.
pub fn build_frame(chunk: &FrameChunk) -> Result<Vec<u8>> {
    let mut payload = Payload::default();
    payload.u32(chunk.phase);
    payload.u8(chunk.previous_contexts.into());
    payload.u32(chunk.death_count);
    payload.u32(chunk.birth_count);
    payload.section(&chunk.motion)?;
    if let Some(updates) = &chunk.updates {
        payload.section(updates)?;
    }
    payload.section(&chunk.births)?;
    payload.u32(chunk.state_crc);
    Ok(payload.bytes)
}

/// Parse SNAP.
///
/// # Errors
/// `field`, `trailing-data`.
pub fn parse_snapshot(payload: &[u8]) -> Result<SnapshotChunk> {
    let mut fields = Fields::new(payload);
    let chunk = SnapshotChunk {
        frame: fields.u32()?,
        canonical: fields.u32()?,
        newborn_count: fields.u32()?,
        origin: read_origin(&mut fields)?,
        axis_bits: read_axis_bits(&mut fields)?,
        survivors: fields.section()?,
        sections: read_sections(&mut fields)?,
        state_crc: fields.u32()?,
    };
    fields.end()?;
    Ok(chunk)
}

/// Build the payload of SNAP.
///
/// # Errors
/// [`Error::Encode`] if a field is out of range.
pub fn build_snapshot(chunk: &SnapshotChunk) -> Result<Vec<u8>> {
    let mut payload = Payload::default();
    payload.u32(chunk.frame);
    payload.u32(chunk.canonical);
    payload.u32(chunk.newborn_count);
    write_box(&mut payload, chunk.origin, chunk.axis_bits)?;
    payload.section(&chunk.survivors)?;
    for section in &chunk.sections {
        payload.section(section)?;
    }
    payload.u32(chunk.state_crc);
    Ok(payload.bytes)
}

fn read_origin(fields: &mut Fields) -> Result<[i32; 3]> {
    Ok([fields.i32()?, fields.i32()?, fields.i32()?])
}

fn read_axis_bits(fields: &mut Fields) -> Result<u8> {
    let bits = fields.u8()?;
    within("axis_bits", bits, 0, AXIS_BITS_LIMIT).map_err(rejected)?; // [5-3]
    Ok(bits)
}

fn read_sections(fields: &mut Fields) -> Result<[Section; SECTIONS]> {
    let mut sections: [Section; SECTIONS] = Default::default();
    for section in &mut sections {
        *section = fields.section()?;
    }
    Ok(sections)
}

fn write_box(payload: &mut Payload, origin: [i32; 3], axis_bits: u8) -> Result<()> {
    within("axis_bits", axis_bits, 0, AXIS_BITS_LIMIT).map_err(Error::Encode)?;
    for number in origin {
        payload.i32(number);
    }
    payload.u8(axis_bits);
    Ok(())
}
