//! Chunks: SPEC 5.1 and 5.2.
//!
//! Every chunk states its length and has CRCs of its header and payload, so that nothing is parsed
//! or decoded before it is known to be intact.

use crate::constants::Level;
use crate::error::{Error, Reject, Result};
use crate::records::Header;

/// The type of a chunk: four letters.
pub type Kind = [u8; 4];

/// Magic bytes at the start of a stream.
pub const MAGIC: [u8; 8] = [0x89, 0x51, 0x52, 0x43, 0x0D, 0x0A, 0x1A, 0x0A];
/// Sync word at the start of a chunk.
pub const SYNC: [u8; 4] = [0x9E, 0x51, 0x43, 0xF3];
/// Bytes of a chunk header.
pub const CHUNK_HEADER_BYTES: usize = 20;
/// Bytes of the CRC after the payload.
pub const CHUNK_CRC_BYTES: usize = 4;
/// Bytes of a TAIL payload (SPEC 5.8).
pub const TAIL_BYTES: u32 = 16;
/// Maximum bytes of a HEAD payload.
pub const HEAD_BYTES_LIMIT: u32 = 1024;

/// Parameters of the stream (SPEC 5.3).
pub const HEAD: Kind = *b"HEAD";
/// A canonical frame (SPEC 5.4).
pub const CANO: Kind = *b"CANO";
/// A frame coded as changes to the previous frame (SPEC 5.5).
pub const FRAM: Kind = *b"FRAM";
/// A canonical frame coded against an earlier one (SPEC 5.10).
pub const SNAP: Kind = *b"SNAP";
/// Positions of the canonical frames in the stream (SPEC 5.9).
pub const INDX: Kind = *b"INDX";
/// The totals of the stream (SPEC 5.8).
pub const TAIL: Kind = *b"TAIL";
/// Cameras (SPEC 5.6).
pub const CAME: Kind = *b"came";
/// Metadata (SPEC 5.7).
pub const META: Kind = *b"meta";

const ANCILLARY_BIT: u8 = 0x20;

/// Whether a type is defined in SPEC 5.
#[must_use]
pub fn is_known(kind: Kind) -> bool {
    [HEAD, CANO, FRAM, SNAP, INDX, TAIL, CAME, META].contains(&kind)
}

/// Whether a decoder may ignore chunks of this type.
#[must_use]
pub const fn is_ancillary(kind: Kind) -> bool {
    kind[0] & ANCILLARY_BIT != 0
}

/// Whether chunks of this type contain a canonical frame.
#[must_use]
pub fn is_canonical(kind: Kind) -> bool {
    kind == CANO || kind == SNAP
}

/// Whether chunks of this type contain a frame.
#[must_use]
pub fn is_frame(kind: Kind) -> bool {
    is_canonical(kind) || kind == FRAM
}

/// The type as text.
#[must_use]
pub fn kind_name(kind: Kind) -> String {
    kind.escape_ascii().to_string()
}

/// The fields of a chunk header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkHeader {
    /// Its type.
    pub kind: Kind,
    /// Its sequence number in the stream.
    pub sequence: u32,
    /// Bytes of its payload.
    pub length: u32,
    /// Byte offset of the chunk in the stream.
    pub offset: u64,
}

impl ChunkHeader {
    /// Byte offset of the payload in the stream.
    #[must_use]
    pub const fn payload_offset(&self) -> u64 {
        self.offset.saturating_add(CHUNK_HEADER_BYTES as u64)
    }

    /// Byte offset of the next chunk.
    #[must_use]
    pub const fn end(&self) -> u64 {
        self.payload_offset().saturating_add(self.length as u64 + CHUNK_CRC_BYTES as u64)
    }
}

/// Whether the 20 header bytes match their CRC.
#[must_use]
pub fn header_crc_holds(data: &[u8; CHUNK_HEADER_BYTES]) -> bool {
    crc32fast::hash(&data[..16]) == number_at(data, 16)
}

/// Read the fields of a header without checking them.
#[must_use]
pub fn read_fields(data: &[u8; CHUNK_HEADER_BYTES], offset: u64) -> ChunkHeader {
    let kind = [data[4], data[5], data[6], data[7]];
    ChunkHeader { kind, sequence: number_at(data, 8), length: number_at(data, 12), offset }
}

/// Parse a chunk header and check its sync word and CRC.
///
/// # Arguments
/// `data` is 20 bytes, or fewer if the stream ends; `offset` is their position in the stream.
///
/// # Errors
/// `bad-sync`, `truncated`, `header-crc`.
pub fn parse_chunk_header(data: &[u8], offset: u64) -> Result<ChunkHeader> {
    let shown = data.len().min(SYNC.len());
    if data[..shown] != SYNC[..shown] {
        return Err(Error::new(Reject::BadSync, "a chunk must begin here").at(offset));
        // [5.2-1]
    }
    let Some(bytes) = data.get(..CHUNK_HEADER_BYTES).and_then(|data| data.try_into().ok()) else {
        let message = "the stream ends before its TAIL chunk";
        return Err(Error::new(Reject::Truncated, message).at(offset)); // [5.1-4]
    };
    if !header_crc_holds(bytes) {
        return Err(Error::new(Reject::HeaderCrc, "the chunk's header is damaged").at(offset));
        // [5.2-2]
    }
    Ok(read_fields(bytes, offset))
}

/// Check the CRC of a payload against the bytes stored after it: four, or fewer if the stream ends.
///
/// # Errors
/// `truncated`, `payload-crc`.
pub fn prove_payload(header: &ChunkHeader, crc: u32, stored: &[u8]) -> Result<()> {
    if stored.len() < CHUNK_CRC_BYTES {
        let message = "the stream ends inside a chunk";
        return Err(Error::new(Reject::Truncated, message).at(header.offset)); // [5.1-4]
    }
    if crc != number_at(stored, 0) {
        let message = "the chunk's payload is damaged";
        return Err(Error::new(Reject::PayloadCrc, message).at(header.offset)); // [5.2-3]
    }
    Ok(())
}

/// Build a chunk from its payload.
///
/// # Errors
/// [`Error::Encode`] if the payload is too long.
pub fn build_chunk(kind: Kind, sequence: u32, payload: &[u8]) -> Result<Vec<u8>> {
    let length = u32::try_from(payload.len())
        .map_err(|_| Error::Encode(format!("a payload of {} bytes", payload.len())))?;
    let mut chunk = Vec::with_capacity(CHUNK_HEADER_BYTES + payload.len() + CHUNK_CRC_BYTES);
    chunk.extend_from_slice(&SYNC);
    chunk.extend_from_slice(&kind);
    chunk.extend_from_slice(&sequence.to_le_bytes());
    chunk.extend_from_slice(&length.to_le_bytes());
    chunk.extend_from_slice(&crc32fast::hash(&chunk).to_le_bytes());
    chunk.extend_from_slice(payload);
    chunk.extend_from_slice(&crc32fast::hash(payload).to_le_bytes());
    Ok(chunk)
}

/// The chunk order of a stream. Checks each header against the state so far.
#[derive(Clone, Debug)]
pub struct ChunkOrder {
    /// Byte offset of the next chunk.
    pub offset: u64,
    /// Sequence number of the next chunk; 2^32, which no chunk has, after the last possible number.
    pub sequence: u64,
    before: Option<Kind>,
    limit: u32,
    snapshots: bool,
}

impl Default for ChunkOrder {
    fn default() -> Self {
        let offset = MAGIC.len() as u64;
        ChunkOrder { offset, sequence: 0, before: None, limit: HEAD_BYTES_LIMIT, snapshots: false }
    }
}

impl ChunkOrder {
    /// Use the level and features of this HEAD for the checks that follow.
    ///
    /// # Panics
    /// If the level is undefined; parsers reject such headers.
    pub fn keep_to(&mut self, header: &Header) {
        self.limit = header.limits().chunk_bytes;
        self.snapshots = header.snapshots;
    }

    /// Maximum bytes of the next payload (SPEC 3.2).
    #[must_use]
    pub const fn limit(&self) -> u32 {
        self.limit
    }

    /// Whether TAIL has been passed.
    #[must_use]
    pub fn is_past_tail(&self) -> bool {
        self.before == Some(TAIL)
    }

    /// Check the header of the next chunk, in the order of SPEC 11.4.
    ///
    /// # Arguments
    /// `data` is the 20 bytes at `offset`, or fewer if the stream ends.
    ///
    /// # Errors
    /// `bad-sync`, `truncated`, `header-crc`, `sequence`, `bad-chunk-type`, `unknown-critical`,
    /// `chunk-order`, `chunk-exceeds-level`; [`Error::Limit`] at the unlimited level.
    pub fn accept(&self, data: &[u8]) -> Result<ChunkHeader> {
        let header = parse_chunk_header(data, self.offset)?; // [5.2-5]
        self.check(&header).map_err(|error| error.at(self.offset))?;
        Ok(header)
    }

    /// Advance past a chunk.
    pub fn pass(&mut self, header: &ChunkHeader) {
        self.offset = header.end();
        self.sequence = u64::from(header.sequence) + 1;
        self.before = Some(header.kind);
    }

    /// Continue at a chunk whose predecessor is unknown.
    pub fn go_to(&mut self, offset: u64, sequence: u64) {
        self.offset = offset;
        self.sequence = sequence;
        self.before = None;
    }

    fn check(&self, header: &ChunkHeader) -> Result<()> {
        if u64::from(header.sequence) != self.sequence {
            let (found, due) = (header.sequence, self.sequence);
            let message = format!("found chunk {found} where chunk {due} was expected");
            return Err(Error::new(Reject::Sequence, message)); // [5.2-4]
        }
        self.check_type(header.kind)?;
        if (header.kind == HEAD) != (header.sequence == 0) {
            let message = "the first chunk must be HEAD, and no other chunk may be HEAD";
            return Err(Error::new(Reject::ChunkOrder, message)); // [5.1-2]
        }
        if self.before == Some(INDX) && header.kind != TAIL {
            return Err(Error::new(Reject::ChunkOrder, "TAIL must follow INDX"));
            // [5.1-6]
        }
        let describe =
            |limit| format!("a payload of {} bytes exceeds the limit of {limit}", header.length);
        if header.length > self.limit {
            return Err(Error::new(Reject::ChunkExceedsLevel, describe(self.limit)));
            // [3.2-4] [5.2-6] [5.2-7]
        }
        let own_limit = bounded_limit(self.limit);
        if header.length > own_limit && is_known(header.kind) {
            return Err(Error::Limit(describe(own_limit)));
        }
        Ok(())
    }

    fn check_type(&self, kind: Kind) -> Result<()> {
        if !is_type(kind) {
            let message = format!("{} is not a chunk type", kind_name(kind));
            return Err(Error::new(Reject::BadChunkType, message)); // [5.2-8]
        }
        let known = if kind == SNAP { self.snapshots } else { is_known(kind) };
        if !known && !is_ancillary(kind) {
            let message = format!("critical chunk {} is unknown", kind_name(kind));
            return Err(Error::new(Reject::UnknownCritical, message)); // [5.2-9]
        }
        Ok(())
    }
}

/// A payload limit or, at the unlimited level, that of level 30: it bounds what this decoder holds in
/// memory (SPEC 13) and the effort of a recovery (SPEC 11.4).
#[must_use]
pub fn bounded_limit(limit: u32) -> u32 {
    let bounded = Level::of(30).map_or(limit, |level| level.chunk_bytes);
    limit.min(bounded)
}

/// Whether the letters match a pattern of SPEC 5.2: all have the case of the first, except the
/// second, where the other case marks a private type.
pub(crate) fn is_type(kind: Kind) -> bool {
    let [first, _, third, fourth] = kind.map(|letter| letter & ANCILLARY_BIT);
    kind.iter().all(u8::is_ascii_alphabetic) && first == third && first == fourth
}

/// The little-endian u32 at a byte position.
fn number_at(data: &[u8], place: usize) -> u32 {
    u32::from_le_bytes([data[place], data[place + 1], data[place + 2], data[place + 3]])
}
