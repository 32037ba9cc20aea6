//! Writing of a stream chunk by chunk: SPEC 5.1, 5.8, 5.9.
//!
//! The writer maintains sequence numbers, seek points and totals; the caller is responsible for the
//! payloads. Every method returns the bytes to be appended to the stream.
//!
//! ```
//! use quarc::chunks::CANO;
//! use quarc::coding::canonical::{blank, sort, write_canonical};
//! use quarc::records::{CanonicalChunk, Header};
//! use quarc::state::State;
//! use quarc::stream::Decoder;
//! use quarc::wire::build_canonical;
//! use quarc::writer::StreamWriter;
//! use std::sync::Arc;
//!
//! let header = Arc::new(Header::default());
//!
//! // A frame of two Gaussians, as integers; floats are rounded to the steps of the header.
//! let mut gaussians = blank(header.code_planes(), 2);
//! gaussians.positions[0] = vec![30, -20];
//! let (grid, gaussians) = sort(&gaussians)?;
//! let state = State::begin(&header, 0, &gaussians)?;
//! let frame = CanonicalChunk {
//!     frame: 0,
//!     gaussian_count: 2,
//!     origin: grid.origin,
//!     axis_bits: grid.axis_bits,
//!     sections: write_canonical(&gaussians, grid)?,
//!     state_crc: state.state_crc(),
//! };
//! let (mut writer, mut stream) = StreamWriter::new(&header)?;
//! stream.extend(writer.write(CANO, &build_canonical(&frame)?)?);
//! stream.extend(writer.finish()?);
//!
//! let mut decoder = Decoder::new();
//! decoder.push(&stream);
//! assert_eq!(decoder.pull()?.map(State::digest), Some(state.digest()));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The frames that follow are changes of the state, in the steps of [`state`](crate::state). Their
//! sections are fields of a [`FrameChunk`](crate::records::FrameChunk).

use crate::chunks::{
    build_chunk, is_canonical, is_frame, is_type, kind_name, Kind, HEAD, INDX, MAGIC, TAIL,
};
use crate::error::{Error, Result};
use crate::records::{Header, SeekPoint, Tail};
use crate::wire;

/// Wraps payloads into numbered chunks and maintains the index of a stream.
#[derive(Clone, Debug)]
pub struct StreamWriter {
    offset: u64,
    sequence: Option<u32>, // of the next chunk; None after the last possible number
    limit: u32,
    frame_count: u32,
    points: Vec<SeekPoint>,
}

impl StreamWriter {
    /// A writer, and the first bytes of the stream: magic and HEAD.
    ///
    /// # Errors
    /// [`Error::Encode`] if a field of the header is out of range.
    pub fn new(header: &Header) -> Result<(Self, Vec<u8>)> {
        let head = wire::build_header(header)?;
        let mut writer = StreamWriter {
            offset: MAGIC.len() as u64,
            sequence: Some(0),
            limit: header.limits().chunk_bytes,
            frame_count: 0,
            points: Vec::new(),
        };
        let mut bytes = MAGIC.to_vec();
        bytes.extend(writer.append(HEAD, &head)?);
        Ok((writer, bytes))
    }

    /// Byte offset of the next chunk.
    #[must_use]
    pub const fn offset(&self) -> u64 {
        self.offset
    }

    /// Number of frame chunks so far.
    #[must_use]
    pub const fn frame_count(&self) -> u32 {
        self.frame_count
    }

    /// Write a chunk of any type but HEAD, INDX and TAIL.
    ///
    /// # Errors
    /// [`Error::Encode`] if it is one of these types or not a type at all, the payload is longer than
    /// the level allows, a canonical frame has no ordinal, or the sequence numbers are used up.
    pub fn write(&mut self, kind: Kind, payload: &[u8]) -> Result<Vec<u8>> {
        if !is_type(kind) || [HEAD, INDX, TAIL].contains(&kind) {
            let message = format!("{} is not a type that can be written", kind_name(kind));
            return Err(Error::Encode(message)); // [5.1-2] [5.1-6] [5.2-8]
        }
        if payload.len() as u64 > u64::from(self.limit) {
            let (found, most) = (payload.len(), self.limit);
            let message = format!("{} has {found} bytes; the limit is {most}", kind_name(kind));
            return Err(Error::Encode(message)); // [3.2-4]
        }
        let point = is_canonical(kind).then(|| self.name(payload)).transpose()?;
        let bytes = self.append(kind, payload)?;
        self.points.extend(point);
        self.frame_count += u32::from(is_frame(kind));
        Ok(bytes)
    }

    /// Write INDX and TAIL; INDX is omitted if it is longer than the level allows.
    ///
    /// # Errors
    /// [`Error::Encode`] if the sequence numbers are used up.
    pub fn finish(mut self) -> Result<Vec<u8>> {
        let index = wire::build_index(&self.points)?;
        let (mut bytes, mut index_offset) = (Vec::new(), 0);
        if index.len() as u64 <= u64::from(self.limit) {
            index_offset = self.offset;
            bytes = self.append(INDX, &index)?;
        }
        let canonical_count = self.points.len() as u32; // at most the number of chunks
        let tail = Tail { frame_count: self.frame_count, canonical_count, index_offset };
        bytes.extend(self.append(TAIL, &wire::build_tail(&tail))?);
        Ok(bytes)
    }

    fn append(&mut self, kind: Kind, payload: &[u8]) -> Result<Vec<u8>> {
        let message = "a stream has 2^32 chunks at most"; // [5.2-4]
        let sequence = self.sequence.ok_or_else(|| Error::Encode(message.to_owned()))?;
        let bytes = build_chunk(kind, sequence, payload)?;
        self.offset += bytes.len() as u64;
        self.sequence = sequence.checked_add(1);
        Ok(bytes)
    }

    /// The seek point of a canonical frame before it is written.
    fn name(&self, payload: &[u8]) -> Result<SeekPoint> {
        let ordinal = payload.get(..4).and_then(|bytes| bytes.try_into().ok());
        let frame = ordinal
            .map(u32::from_le_bytes)
            .ok_or_else(|| Error::Encode("a canonical frame without an ordinal".to_owned()))?;
        let sequence = self.sequence.unwrap_or(u32::MAX);
        Ok(SeekPoint { offset: self.offset, sequence, frame })
    }
}
