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
    /// The check of the last payload of an unknown type, which may not have fully arrived.
    check: Option<PayloadCheck>,
}

impl<S: Source> ChunkReader<S> {
    /// A reader whose next chunk is HEAD.
    ///
    /// # Errors
    /// `bad-magic`, `truncated`.
    pub fn new(mut source: S) -> Result<Self> {
        check_magic(&read(&mut source, 0, MAGIC.len() as u64)?)?;
        Ok(ChunkReader { source, order: ChunkOrder::default(), check: None })
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

    /// Read the chunk of this header, of any type, and advance past it. After [`Error::Source`],
    /// call it again: the payload of an unknown type is then checked from where bytes were missing.
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
            self.check_unknown(header)?; // [5.2-10]
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

    fn check_unknown(&mut self, header: ChunkHeader) -> Result<()> {
        if matches!(&self.check, Some(check) if check.header.offset != header.offset) {
            self.check = None;
        }
        self.check.get_or_insert_with(|| PayloadCheck::new(header)).finish(&mut self.source)
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

/// Checks the CRC of a payload in pieces, without keeping it.
#[derive(Debug)]
pub struct PayloadCheck {
    header: ChunkHeader,
    place: u64, // of the next piece
    hasher: crc32fast::Hasher,
}

impl PayloadCheck {
    /// The check of the payload that follows a header.
    #[must_use]
    pub fn new(header: ChunkHeader) -> Self {
        PayloadCheck { header, place: header.payload_offset(), hasher: crc32fast::Hasher::new() }
    }

    /// Read the rest of the payload, and check it. After [`Error::Source`], call it again.
    ///
    /// # Errors
    /// `truncated`, `payload-crc`.
    pub fn finish<S: Source>(&mut self, source: &mut S) -> Result<()> {
        let end = self.header.end() - CHUNK_CRC_BYTES as u64;
        let mut piece = Vec::new();
        while self.place < end {
            piece.clear();
            source.read(self.place, (end - self.place).min(PIECE_BYTES), &mut piece)?;
            if piece.is_empty() {
                return prove_payload(&self.header, 0, &[]);
            }
            self.hasher.update(&piece);
            self.place += piece.len() as u64;
        }
        let stored = read(source, end, CHUNK_CRC_BYTES as u64)?;
        prove_payload(&self.header, self.hasher.clone().finalize(), &stored)
    }
}
