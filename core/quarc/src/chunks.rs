//! Chunks: SPEC 5.1 and 5.2.
//!
//! Every chunk names its length and proves its header and its payload by a CRC, so that nothing
//! is parsed, let alone decoded, before it is known whole.

use crate::constants::Level;
use crate::error::{Error, Reject, Result};
use crate::records::Header;

/// The type of a chunk: four letters.
pub type Kind = [u8; 4];

/// What a stream begins with.
pub const MAGIC: [u8; 8] = [0x89, 0x51, 0x52, 0x43, 0x0D, 0x0A, 0x1A, 0x0A];
/// What a chunk begins with.
pub const SYNC: [u8; 4] = [0x9E, 0x51, 0x43, 0xF3];
/// Bytes of a chunk before its payload.
pub const CHUNK_HEADER_BYTES: usize = 20;
/// Bytes of a chunk after its payload.
pub const CHUNK_CRC_BYTES: usize = 4;
/// Bytes of a TAIL payload (SPEC 5.8).
pub const TAIL_BYTES: u32 = 16;
/// Bytes of the payload of HEAD, at most.
pub const HEAD_BYTES_LIMIT: u32 = 1024;

/// What the stream chooses for itself (SPEC 5.3).
pub const HEAD: Kind = *b"HEAD";
/// A canonical frame (SPEC 5.4).
pub const CANO: Kind = *b"CANO";
/// A frame that moves the one before it (SPEC 5.5).
pub const FRAM: Kind = *b"FRAM";
/// A canonical frame that is coded against another (SPEC 5.10).
pub const SNAP: Kind = *b"SNAP";
/// Where the canonical frames stand (SPEC 5.9).
pub const INDX: Kind = *b"INDX";
/// The totals of the stream (SPEC 5.8).
pub const TAIL: Kind = *b"TAIL";
/// Cameras (SPEC 5.6).
pub const CAME: Kind = *b"came";
/// Metadata (SPEC 5.7).
pub const META: Kind = *b"meta";

const ANCILLARY_BIT: u8 = 0x20;

/// Whether a type is one of those of SPEC 5.
#[must_use]
pub fn is_known(kind: Kind) -> bool {
    [HEAD, CANO, FRAM, SNAP, INDX, TAIL, CAME, META].contains(&kind)
}

/// Whether a decoder may do without chunks of a type.
#[must_use]
pub const fn is_ancillary(kind: Kind) -> bool {
    kind[0] & ANCILLARY_BIT != 0
}

/// Whether chunks of a type hold a canonical frame.
#[must_use]
pub fn is_canonical(kind: Kind) -> bool {
    kind == CANO || kind == SNAP
}

/// Whether chunks of a type hold a frame.
#[must_use]
pub fn is_frame(kind: Kind) -> bool {
    is_canonical(kind) || kind == FRAM
}

/// A type as text.
#[must_use]
pub fn kind_name(kind: Kind) -> String {
    kind.escape_ascii().to_string()
}

/// What is known of a chunk before its payload is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChunkHeader {
    /// Its type.
    pub kind: Kind,
    /// Its ordinal in the stream.
    pub sequence: u32,
    /// Bytes of its payload.
    pub length: u32,
    /// Where it begins in the stream.
    pub offset: u64,
}

impl ChunkHeader {
    /// Where the payload begins in the stream.
    #[must_use]
    pub const fn payload_offset(&self) -> u64 {
        self.offset.saturating_add(CHUNK_HEADER_BYTES as u64)
    }

    /// Where the next chunk begins.
    #[must_use]
    pub const fn end(&self) -> u64 {
        self.payload_offset().saturating_add(self.length as u64 + CHUNK_CRC_BYTES as u64)
    }
}

/// Whether the 20 bytes of a header match their CRC.
#[must_use]
pub fn header_crc_holds(data: &[u8; CHUNK_HEADER_BYTES]) -> bool {
    crc32fast::hash(&data[..16]) == number_at(data, 16)
}

/// The fields of a header, whatever they are.
#[must_use]
pub fn read_fields(data: &[u8; CHUNK_HEADER_BYTES], offset: u64) -> ChunkHeader {
    let kind = [data[4], data[5], data[6], data[7]];
    ChunkHeader { kind, sequence: number_at(data, 8), length: number_at(data, 12), offset }
}

/// The header of the chunk that begins with these bytes, proved by its CRC.
///
/// # Arguments
/// 20 bytes, fewer where the stream ends, and where they are in the stream.
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

/// Hold the CRC of a payload against the bytes that are stored behind it; fewer than four where
/// the stream ends.
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

/// A payload in its frame.
///
/// # Errors
/// [`Error::Encode`] where it is too long.
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

/// Which chunk is due in a stream; holds the header of each against it.
#[derive(Clone, Debug)]
pub struct ChunkOrder {
    /// Where the next chunk begins.
    pub offset: u64,
    /// Its number, which no chunk has behind the last that there can be.
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
    /// Take it that HEAD says this.
    pub fn keep_to(&mut self, header: &Header) {
        self.limit = header.limits().chunk_bytes;
        self.snapshots = header.snapshots;
    }

    /// Bytes of the next payload, at most (SPEC 3.2).
    #[must_use]
    pub const fn limit(&self) -> u32 {
        self.limit
    }

    /// Whether TAIL has been passed.
    #[must_use]
    pub fn is_past_tail(&self) -> bool {
        self.before == Some(TAIL)
    }

    /// The header of the chunk that is due, in the order of checks of SPEC 11.4.
    ///
    /// # Arguments
    /// The 20 bytes at `offset`, fewer where the stream ends.
    ///
    /// # Errors
    /// `bad-sync`, `truncated`, `header-crc`, `sequence`, `bad-chunk-type`, `unknown-critical`,
    /// `chunk-order`, `chunk-exceeds-level`.
    pub fn accept(&self, data: &[u8]) -> Result<ChunkHeader> {
        let header = parse_chunk_header(data, self.offset)?; // [5.2-5]
        self.check(&header).map_err(|error| error.at(self.offset))?;
        Ok(header)
    }

    /// Go on behind a chunk.
    pub fn pass(&mut self, header: &ChunkHeader) {
        self.offset = header.end();
        self.sequence = u64::from(header.sequence) + 1;
        self.before = Some(header.kind);
    }

    /// Go on at a chunk that is said to begin somewhere; the one before it is not known.
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
        if header.length > self.limit {
            let message =
                format!("a payload of {} bytes exceeds the limit of {}", header.length, self.limit);
            return Err(Error::new(Reject::ChunkExceedsLevel, message)); // [3.2-4] [5.2-6] [5.2-7]
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

/// The bound on payloads by which the effort of a recovery is measured (SPEC 11.4).
#[must_use]
pub fn effort_limit(limit: u32) -> u32 {
    let bounded = Level::of(30).map_or(limit, |level| level.chunk_bytes);
    limit.min(bounded)
}

/// Whether the letters keep to the patterns of SPEC 5.2: all have the case of the first, but for
/// the second, whose other case marks a private type.
fn is_type(kind: Kind) -> bool {
    let [first, _, third, fourth] = kind.map(|letter| letter & ANCILLARY_BIT);
    kind.iter().all(u8::is_ascii_alphabetic) && first == third && first == fourth
}

/// The little-endian u32 at a place.
fn number_at(data: &[u8], place: usize) -> u32 {
    u32::from_le_bytes([data[place], data[place + 1], data[place + 2], data[place + 3]])
}
