//! Finding the canonical frame at which decoding begins: SPEC 11.2.

use super::take_head;
use crate::chunks::{
    is_canonical, is_frame, kind_name, parse_chunk_header, prove_payload, ChunkHeader, ChunkOrder,
    Kind, CANO, CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, INDX, SNAP, TAIL, TAIL_BYTES,
};
use crate::error::{Error, Reject, Result};
use crate::reader::{Chunk, ChunkReader};
use crate::records::{SeekPoint, Tail};
use crate::source::{read, Source};
use crate::stream::StateDecoder;
use crate::wire;

const FRAME_BYTES: u32 = 4;
const TAIL_CHUNK_BYTES: u64 = (CHUNK_HEADER_BYTES + TAIL_BYTES as usize + CHUNK_CRC_BYTES) as u64;

/// The result of seeking to a frame.
#[derive(Debug, Default)]
pub struct Way {
    /// All seek points up to that of the reader's position; empty if the reader has not moved,
    /// because the stream has no such frame.
    pub points: Vec<SeekPoint>,
    /// If the frame found is a snapshot, the CANO that it is coded against, and its seek point.
    pub reference: Option<(Chunk, SeekPoint)>,
}

/// A search for the last canonical frame at or before a frame. If bytes are missing, it can be
/// continued later, without reading the same chunk headers again.
#[derive(Debug)]
pub struct Search {
    frame: u32,
    /// The position after HEAD.
    start: ChunkOrder,
    /// The position up to which chunk headers have been read, and the seek points before it.
    walked: ChunkOrder,
    points: Vec<SeekPoint>,
    /// The ordinal expected at that position.
    due: u64,
}

impl Search {
    /// A search that begins at the position of a reader that has read HEAD.
    pub fn new<S>(reader: &ChunkReader<S>, frame: u32) -> Self {
        let start = reader.order.clone();
        Search { frame, walked: start.clone(), start, points: Vec::new(), due: 0 }
    }

    /// Move the reader to the last canonical frame at or before the frame.
    ///
    /// # Errors
    /// The bytes that were read are malformed. After [`Error::Source`], call it again.
    pub fn advance<S: Source>(&mut self, reader: &mut ChunkReader<S>) -> Result<Way> {
        let mut points = match read_index(reader)? {
            Some(points) => points,
            None => self.walk_headers(reader)?.to_vec(),
        };
        points.retain(|point| point.frame <= self.frame);
        let Some(&last) = points.last() else {
            reader.order = self.start.clone();
            return Ok(Way::default());
        };
        let header = go_to(reader, last.offset, last.sequence.into(), &[CANO, SNAP])?; // [11.2-4]
        let mut reference = None;
        if header.kind == SNAP {
            reference = Some(take_reference(reader, &header, &points)?);
            reader.order.go_to(header.offset, header.sequence.into());
        }
        Ok(Way { points, reference })
    }

    /// The seek points up to the frame, and possibly one after it, found by reading chunk headers.
    fn walk_headers<S: Source>(&mut self, reader: &mut ChunkReader<S>) -> Result<&[SeekPoint]> {
        reader.order = self.walked.clone();
        let end = loop {
            if self.due > u64::from(self.frame) {
                break Ok(());
            }
            match walk_header(reader, &mut self.points, self.due) {
                Ok(Some(next)) => self.due = next,
                Ok(None) => break Ok(()),
                Err(error) if error.reject() == Some(Reject::Truncated) => break Ok(()), // it ends
                Err(error) => break Err(error),
            }
        };
        self.walked = reader.order.clone();
        end.map(|()| &self.points[..])
    }
}

/// Read the CANO that a snapshot is coded against. [11.2-5]
fn take_reference<S: Source>(
    reader: &mut ChunkReader<S>,
    header: &ChunkHeader,
    points: &[SeekPoint],
) -> Result<(Chunk, SeekPoint)> {
    let canonical = read_number(reader, header, FRAME_BYTES)?;
    let Some(&point) = points.iter().find(|point| point.frame == canonical) else {
        let message = format!("frame {canonical}, which a snapshot refers to, has no seek point");
        return Err(Error::new(Reject::IndexMismatch, message).at(header.offset));
    };
    let found = go_to(reader, point.offset, point.sequence.into(), &[CANO])?;
    Ok((reader.take(found)?, point))
}

/// The entries of INDX; `None` if the stream has none or is not complete.
fn read_index<S: Source>(reader: &mut ChunkReader<S>) -> Result<Option<Vec<SeekPoint>>> {
    let size = reader.source.size()?;
    let Some((header, tail)) = read_tail(&mut reader.source, size)? else { return Ok(None) };
    if tail.index_offset == 0 {
        return Ok(None);
    }
    let mismatch = |message: &str| {
        Error::new(Reject::IndexMismatch, message).at(tail.index_offset) // [11.2-2] [11.2-3]
    };
    let before = u64::from(header.sequence).wrapping_sub(1); // matches no chunk if TAIL is the first
    let found = go_to(reader, tail.index_offset, before, &[INDX])?;
    let index = reader.take(found)?;
    if found.end() != header.offset {
        return Err(mismatch("INDX does not end where TAIL begins"));
    }
    let points = wire::parse_index(&index.payload).map_err(|error| error.at(found.offset))?;
    if points.len() != tail.canonical_count as usize {
        return Err(mismatch("INDX does not have one seek point per canonical frame"));
    }
    Ok(Some(points))
}

/// TAIL and INDX of a complete stream; `None` if it has none or is not complete.
///
/// # Errors
/// Those of reading HEAD and INDX.
pub fn find_index<S: Source>(source: S) -> Result<Option<(Tail, Vec<SeekPoint>)>> {
    let mut reader = ChunkReader::new(source)?;
    take_head(&mut reader, &mut StateDecoder::default())?;
    let points = read_index(&mut reader)?;
    let size = reader.source.size()?;
    let tail = read_tail(&mut reader.source, size)?;
    Ok(tail.map(|(_, tail)| tail).zip(points))
}

/// The TAIL chunk at the end of a stream; `None` if there is no valid one.
fn read_tail<S: Source>(source: &mut S, size: u64) -> Result<Option<(ChunkHeader, Tail)>> {
    let Some(offset) = size.checked_sub(TAIL_CHUNK_BYTES) else { return Ok(None) };
    let data = read(source, offset, TAIL_CHUNK_BYTES)?;
    if data.len() as u64 != TAIL_CHUNK_BYTES {
        return Ok(None); // truncated meanwhile
    }
    Ok(prove_tail(&data, offset).ok())
}

fn prove_tail(data: &[u8], offset: u64) -> Result<(ChunkHeader, Tail)> {
    let header = parse_chunk_header(data, offset)?;
    if header.kind != TAIL || header.length != TAIL_BYTES {
        return Err(Error::new(Reject::ChunkOrder, "the last chunk is not a TAIL"));
    }
    let (payload, stored) = data[CHUNK_HEADER_BYTES..].split_at(TAIL_BYTES as usize);
    prove_payload(&header, crc32fast::hash(payload), stored)?;
    Ok((header, wire::parse_tail(payload)?))
}

/// Pass one chunk and return the ordinal expected after it; `None` after TAIL.
fn walk_header<S: Source>(
    reader: &mut ChunkReader<S>,
    points: &mut Vec<SeekPoint>,
    due: u64,
) -> Result<Option<u64>> {
    let Some(header) = reader.read_header()? else { return Ok(None) };
    let mut here = due;
    if is_canonical(header.kind) {
        let frame = read_number(reader, &header, 0)?;
        points.push(SeekPoint { offset: header.offset, sequence: header.sequence, frame });
        here = frame.into();
    }
    reader.order.pass(&header);
    Ok(Some(here + u64::from(is_frame(header.kind))))
}

/// Read an ordinal at an offset in a payload.
fn read_number<S: Source>(
    reader: &mut ChunkReader<S>,
    header: &ChunkHeader,
    place: u32,
) -> Result<u32> {
    if header.length < place + FRAME_BYTES {
        let message =
            format!("a payload of {} bytes is too short for a frame number", header.length);
        return Err(Error::new(Reject::Field, message).at(header.offset));
    }
    let at = header.payload_offset() + u64::from(place);
    let data = read(&mut reader.source, at, FRAME_BYTES.into())?;
    let number = <[u8; 4]>::try_from(data).map(u32::from_le_bytes);
    let message = "the stream ends inside a chunk";
    number.map_err(|_| Error::new(Reject::Truncated, message).at(header.offset))
}

/// Move a reader to a chunk, and check that it exists and has one of these types.
fn go_to<S: Source>(
    reader: &mut ChunkReader<S>,
    offset: u64,
    sequence: u64,
    kinds: &[Kind],
) -> Result<ChunkHeader> {
    reader.order.go_to(offset, sequence);
    let message = match reader.read_header() {
        Ok(Some(header)) if kinds.contains(&header.kind) => return Ok(header),
        Err(error) if error.reject().is_none() => return Err(error),
        Err(error) => format!("no chunk at the stated position: {error}"),
        Ok(_) => format!("chunk {sequence} is not a {}", kind_name(kinds[0])),
    };
    Err(Error::new(Reject::IndexMismatch, message).at(offset))
}
