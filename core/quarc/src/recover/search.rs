//! After damage: the next chunk that decoding can resume at (`resume` of SPEC 11.4).
//!
//! A search looks at every sync word once. Each payload whose CRC is checked in vain is counted
//! over all searches of a stream, so that their time stays in proportion to the stream, also
//! where it was made to look like chunks. [13-2]

use crate::chunks::{
    effort_limit, header_crc_holds, read_fields, ChunkHeader, CANO, CHUNK_HEADER_BYTES, SNAP, SYNC,
    TAIL, TAIL_BYTES,
};
use crate::error::{Reject, Result};
use crate::reader::check_payload;
use crate::source::{read, Source};

const FIRST_WINDOW_BYTES: u64 = 1 << 12; // what is looked for is often near
const WINDOW_BYTES: u64 = 1 << 20;
const EFFORT: u64 = 16;
const CANONICAL_BYTES: u32 = 4; // the ordinal of the frame
const SNAPSHOT_BYTES: u32 = 8; // and that of the CANO

/// What a chunk must be that decoding can resume at.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted {
    /// First byte to look at.
    pub offset: u64,
    /// Least number of a chunk that is still to come.
    pub sequence: u64,
    /// Least ordinal of a frame that is still to come.
    pub frame: u64,
    /// Ordinal of the CANO that a snapshot may be coded against, if there is one.
    pub canonical: Option<u32>,
}

/// A chunk that decoding can resume at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Resumption {
    /// Its header.
    pub header: ChunkHeader,
    /// The ordinal of its frame; at TAIL, how many frames the stream has.
    pub number: u32,
}

/// All searches in one stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Searches {
    limit: u32,
    spent: u64,
}

impl Searches {
    /// Searches in a stream whose payloads have so many bytes at most.
    pub fn new(limit: u32) -> Self {
        Searches { limit, spent: 0 }
    }

    /// Count a payload that was checked in vain.
    pub fn spend(&mut self, length: u32) {
        self.spent += u64::from(length);
    }

    /// The first chunk that is wanted and whose CRCs hold; `None` where the stream has none.
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
            start += size - CHUNK_HEADER_BYTES as u64 + 1; // no header is cut in both windows
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
        offset + u64::from(effort_limit(self.limit))
    }

    /// Whether a chunk may be one to resume at, by its header.
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

/// A chunk as one to resume at, if its payload CRC holds and it is still to come.
fn prove<S: Source>(
    source: &mut S,
    header: &ChunkHeader,
    wanted: &Wanted,
) -> Result<Option<Resumption>> {
    if let Err(error) = check_payload(source, header) {
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

/// Where sync words stand in some bytes.
fn find_syncs(bytes: &[u8]) -> impl Iterator<Item = usize> + '_ {
    let places = bytes.windows(SYNC.len()).enumerate();
    places.filter(|(_, word)| *word == SYNC).map(|(place, _)| place)
}
