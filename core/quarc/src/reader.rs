//! The chunks of a stream with random access, in order: SPEC 5.1.
//!
//! Whenever possible, a chunk is rejected by its header, before its payload is read or allocated.

use crate::chunks::{
    is_known, prove_payload, ChunkHeader, ChunkOrder, CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, MAGIC,
};
use crate::error::{Error, Reject, Result};
use crate::source::{read, Source};

const PIECE_BYTES: u64 = 1 << 16;

/// A chunk with correct CRCs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Chunk {
    /// Its header.
    pub header: ChunkHeader,
    /// Its payload; empty if the type is unknown.
    pub payload: Vec<u8>,
}

/// Reads a stream chunk by chunk. A rejected read leaves the position unchanged.
#[derive(Debug)]
pub struct ChunkReader<S> {
    /// The stream.
    pub source: S,
    /// The position and the order of chunks.
    pub order: ChunkOrder,
}

impl<S: Source> ChunkReader<S> {
    /// A reader whose next chunk is HEAD.
    ///
    /// # Errors
    /// `bad-magic`, `truncated`.
    pub fn new(mut source: S) -> Result<Self> {
        check_magic(&read(&mut source, 0, MAGIC.len() as u64)?)?;
        Ok(ChunkReader { source, order: ChunkOrder::default() })
    }

    /// Read the header of the next chunk without advancing; `None` after TAIL.
    ///
    /// # Errors
    /// Those of [`ChunkOrder::accept`], and `trailing-data`.
    pub fn read_header(&mut self) -> Result<Option<ChunkHeader>> {
        if self.order.is_past_tail() {
            return self.check_end().map(|()| None);
        }
        let length = CHUNK_HEADER_BYTES as u64;
        let data = read(&mut self.source, self.order.offset, length)?;
        self.order.accept(&data).map(Some)
    }

    /// Read the chunk of this header, of any type, and advance past it.
    ///
    /// # Errors
    /// `truncated`, `payload-crc`.
    pub fn take(&mut self, header: ChunkHeader) -> Result<Chunk> {
        let mut payload = Vec::new();
        if is_known(header.kind) {
            let length = u64::from(header.length) + CHUNK_CRC_BYTES as u64;
            self.source.read(header.payload_offset(), length, &mut payload)?;
            let held = payload.len().min(header.length as usize);
            let (proved, stored) = payload.split_at(held);
            prove_payload(&header, crc32fast::hash(proved), stored)?;
            payload.truncate(held);
        } else {
            check_payload(&mut self.source, &header)?; // [5.2-10]
        }
        self.order.pass(&header);
        Ok(Chunk { header, payload })
    }

    /// Read the next chunk, of any type; `None` after TAIL.
    ///
    /// # Errors
    /// Those of `read_header` and `take`.
    pub fn read_chunk(&mut self) -> Result<Option<Chunk>> {
        match self.read_header()? {
            Some(header) => self.take(header).map(Some),
            None => Ok(None),
        }
    }

    fn check_end(&mut self) -> Result<()> {
        let place = self.order.offset;
        if read(&mut self.source, place, 1)?.is_empty() {
            return Ok(());
        }
        Err(trailing_data(place))
    }
}

/// Check the magic at the start of a stream; `bytes` has fewer than eight if the stream ends.
/// [5.1-1]
pub(crate) fn check_magic(bytes: &[u8]) -> Result<()> {
    let shown = bytes.len().min(MAGIC.len());
    if bytes[..shown] != MAGIC[..shown] {
        return Err(Error::new(Reject::BadMagic, "this is not a .quarc stream").at(0));
    }
    if shown < MAGIC.len() {
        return Err(Error::new(Reject::Truncated, "the stream ends inside its magic bytes").at(0));
    }
    Ok(())
}

/// The rejection of bytes after TAIL. [5.1-5]
pub(crate) fn trailing_data(place: u64) -> Error {
    Error::new(Reject::TrailingData, "bytes follow TAIL").at(place)
}

/// Check the CRC of a payload in pieces, without keeping it.
///
/// # Errors
/// `truncated`, `payload-crc`.
pub fn check_payload<S: Source>(source: &mut S, header: &ChunkHeader) -> Result<()> {
    let (mut place, mut left) = (header.payload_offset(), u64::from(header.length));
    let mut hasher = crc32fast::Hasher::new();
    let mut piece = Vec::new();
    while left > 0 {
        piece.clear();
        source.read(place, left.min(PIECE_BYTES), &mut piece)?;
        if piece.is_empty() {
            return prove_payload(header, 0, &[]);
        }
        hasher.update(&piece);
        place += piece.len() as u64;
        left -= piece.len() as u64;
    }
    let stored = read(source, place, CHUNK_CRC_BYTES as u64)?;
    prove_payload(header, hasher.finalize(), &stored)
}
