//! Preview of a canonical frame while its chunk is still arriving: SPEC 8.5.
//!
//! A player renders it before the payload is complete. Nothing in it is verified, because the CRCs
//! of payload and state come last. It is therefore never returned as a frame, and errors in it are
//! reported only when the chunk is complete.

use crate::chunks::{ChunkHeader, CANO};
use crate::coding::canonical::CanonicalReader;
use crate::coding::grid::Grid;
use crate::error::{Error, Reject, Result};
use crate::records::Header;
use crate::source::{read, Source};
use crate::state::{require_gaussians, State};
use crate::wire::{parse_canonical_start, parse_section, CANONICAL_START_BYTES};
use std::sync::Arc;

const SECTIONS: usize = 6;
const COUNT_BYTES: u64 = 4;
const WORD_BYTES: u64 = 4;
/// Maximum ratio of Gaussians to bytes for a preview, because a damaged count can be arbitrarily
/// large.
const GAUSSIANS_PER_BYTE: u64 = 8;

/// Decodes the sections of a CANO chunk as they arrive.
#[derive(Debug)]
pub struct Preview {
    header: Arc<Header>,
    frame: u32,
    offset: u64, // of the chunk
    end: u64,    // of its payload
    place: u64,  // of the next section
    reader: CanonicalReader,
}

impl Preview {
    /// A preview of a chunk; `None` if it is not a CANO, or if its header states too many
    /// Gaussians.
    ///
    /// # Errors
    /// [`Error::Source`] if the start of the payload is missing; otherwise those of its fields.
    pub fn new<S: Source>(
        source: &mut S,
        header: &Arc<Header>,
        chunk: &ChunkHeader,
    ) -> Result<Option<Self>> {
        if chunk.kind != CANO {
            return Ok(None);
        }
        let begin = chunk.payload_offset();
        let start = read(source, begin, CANONICAL_START_BYTES as u64)?;
        let start = parse_canonical_start(&start)?;
        let count = start.gaussian_count;
        require_gaussians(header, count.into())?;
        if u64::from(count) > GAUSSIANS_PER_BYTE * u64::from(chunk.length) {
            return Ok(None);
        }
        let grid = Grid { origin: start.origin, axis_bits: start.axis_bits };
        Ok(Some(Preview {
            header: Arc::clone(header),
            frame: start.frame,
            offset: chunk.offset,
            end: begin.saturating_add(chunk.length.into()),
            place: begin.saturating_add(CANONICAL_START_BYTES as u64),
            reader: CanonicalReader::new(count as usize, grid, header.code_planes()),
        }))
    }

    /// Byte offset of the chunk in the stream.
    #[must_use]
    pub const fn offset(&self) -> u64 {
        self.offset
    }

    /// Number of sections decoded, in the order of SPEC 8.5.
    #[must_use]
    pub const fn sections(&self) -> usize {
        self.reader.sections
    }

    /// Decode the sections that have arrived since the last call, and return whether there were
    /// any.
    ///
    /// # Errors
    /// Those of decoding a section.
    pub fn advance<S: Source>(&mut self, source: &mut S) -> Result<bool> {
        let before = self.sections();
        while self.sections() < SECTIONS {
            let Some(bytes) = self.next_section(source)? else { break };
            self.place += bytes.len() as u64;
            if let Err(error) = parse_section(&bytes).and_then(|section| self.reader.read(&section))
            {
                self.end = 0; // do not try further sections
                return Err(error);
            }
        }
        Ok(self.sections() > before)
    }

    /// The state so far: rotations are the identity until their section is decoded, and all other
    /// missing numbers are 0.
    ///
    /// # Errors
    /// A number is out of range.
    pub fn state(&self) -> Result<State> {
        State::begin(&self.header, self.frame, &self.reader.gaussians)
    }

    /// The bytes of the next section, if it is complete.
    fn next_section<S: Source>(&self, source: &mut S) -> Result<Option<Vec<u8>>> {
        let Some(count) = read_some(source, self.place, COUNT_BYTES)? else { return Ok(None) };
        let words = count.iter().rev().fold(0, |number, &byte| number << 8 | u64::from(byte));
        let length = COUNT_BYTES + WORD_BYTES * words;
        if length > self.end.saturating_sub(self.place) {
            return Err(Error::new(Reject::Field, "a section goes beyond its chunk"));
        }
        read_some(source, self.place, length)
    }
}

/// Read `length` bytes; `None` unless all have arrived.
fn read_some<S: Source>(source: &mut S, place: u64, length: u64) -> Result<Option<Vec<u8>>> {
    match read(source, place, length) {
        Ok(bytes) if bytes.len() as u64 == length => Ok(Some(bytes)),
        Ok(_) | Err(Error::Source(_)) => Ok(None),
        Err(error) => Err(error),
    }
}
