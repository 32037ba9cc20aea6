//! Search for the next chunk at which decoding can resume after damage (`resume` of SPEC 11.4).
//!
//! A search looks at every sync word once. Payloads whose CRC does not match are counted over all
//! searches of a stream, so that the time stays proportional to the size of the stream, even for
//! streams that contain many false chunks. [13-2]

use crate::chunks::{
    bounded_limit, header_crc_holds, read_fields, ChunkHeader, CANO, CHUNK_HEADER_BYTES, SNAP,
    SYNC, TAIL, TAIL_BYTES,
};
use crate::error::{Reject, Result};
use crate::reader::PayloadCheck;
use crate::source::{read, Source};

const FIRST_WINDOW_BYTES: u64 = 1 << 12; // the next chunk is often near
const WINDOW_BYTES: u64 = 1 << 20;
const EFFORT: u64 = 16;
const CANONICAL_BYTES: u32 = 4; // the ordinal of the frame
const SNAPSHOT_BYTES: u32 = 8; // and that of the CANO

/// Requirements on a chunk at which decoding can resume.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// First byte to examine.
    pub offset: u64,
    /// Minimum sequence number of the chunk.
    pub sequence: u64,
    /// Minimum ordinal of its frame.
    pub frame: u64,
    /// Ordinal of the CANO that a snapshot may be coded against, if any.
    pub canonical: Option<u32>,
}

/// A chunk at which decoding can resume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Resumption {
    /// Its header.
    pub header: ChunkHeader,
    /// The ordinal of its frame; for TAIL, the number of frames of the stream.
    pub number: u32,
}

/// The effort of all searches in a stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Searches {
    limit: u32,
    spent: u64,
}

impl Searches {
    /// The searches of a stream whose payloads have at most `limit` bytes.
    pub fn new(limit: u32) -> Self {
        Searches { limit, spent: 0 }
    }

    /// Count a payload whose CRC did not match.
    pub fn spend(&mut self, length: u32) {
        self.spent += u64::from(length);
    }

    /// The first wanted chunk with correct CRCs; `None` if there is none.
    pub fn find<S: Source>(
        &mut self,
        source: &mut S,
        wanted: &Wanted,
    ) -> Result<Option<Resumption>> {
        let (mut start, mut size) = (wanted.offset, FIRST_WINDOW_BYTES);
        let mut window = Vec::new();
        loop {
            window.clear();
            source.read(start, size, &mut window)?;
            for place in find_syncs(&window) {
                let offset = start + place as u64;
                if let Some(found) = self.try_at(source, &window[place..], offset, wanted)? {
                    return Ok(Some(found));
                }
            }
            if (window.len() as u64) < size {
                return Ok(None);
            }
            start += size - CHUNK_HEADER_BYTES as u64 + 1; // windows overlap, so that no header is cut in both
            size = (2 * size).min(WINDOW_BYTES);
        }
    }

    fn try_at<S: Source>(
        &mut self,
        source: &mut S,
        data: &[u8],
        offset: u64,
        wanted: &Wanted,
    ) -> Result<Option<Resumption>> {
        let bytes = data.get(..CHUNK_HEADER_BYTES).and_then(|data| data.try_into().ok());
        let Some(bytes) = bytes.filter(header_crc_holds) else { return Ok(None) };
        let header = read_fields(&bytes, offset);
        if !self.admits(&header, wanted) || self.spent > EFFORT * self.bound(offset) {
            return Ok(None);
        }
        let found = prove(source, &header, wanted)?;
        if found.is_none() {
            self.spend(header.length);
        }
        Ok(found)
    }

    fn bound(&self, offset: u64) -> u64 {
        offset + u64::from(bounded_limit(self.limit))
    }

    /// Whether a header may be that of a wanted chunk.
    fn admits(&self, header: &ChunkHeader, wanted: &Wanted) -> bool {
        if u64::from(header.sequence) < wanted.sequence || header.length > self.limit {
            return false;
        }
        match header.kind {
            TAIL => header.length == TAIL_BYTES,
            SNAP => wanted.canonical.is_some() && header.length >= SNAPSHOT_BYTES,
            CANO => header.length >= CANONICAL_BYTES,
            _ => false,
        }
    }
}

/// Return the chunk if its payload CRC matches and its frame is wanted.
fn prove<S: Source>(
    source: &mut S,
    header: &ChunkHeader,
    wanted: &Wanted,
) -> Result<Option<Resumption>> {
    if let Err(error) = PayloadCheck::new(*header).finish(source) {
        let in_vain = matches!(error.reject(), Some(Reject::PayloadCrc | Reject::Truncated));
        return if in_vain { Ok(None) } else { Err(error) };
    }
    let payload = read(source, header.payload_offset(), SNAPSHOT_BYTES.into())?;
    let numbers: Vec<u32> = payload
        .chunks_exact(4)
        .map(|bytes| bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte)))
        .collect();
    let [number, canonical] = numbers[..] else { return Ok(None) };
    let fits = match header.kind {
        TAIL => read(source, header.end(), 1)?.is_empty(),
        SNAP => wanted.canonical == Some(canonical) && u64::from(number) >= wanted.frame,
        _ => u64::from(number) >= wanted.frame,
    };
    Ok(fits.then_some(Resumption { header: *header, number }))
}

/// The positions of sync words in `bytes`.
fn find_syncs(bytes: &[u8]) -> impl Iterator<Item = usize> + '_ {
    let places = bytes.windows(SYNC.len()).enumerate();
    places.filter(|(_, word)| *word == SYNC).map(|(place, _)| place)
}
