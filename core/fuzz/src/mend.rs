//! Correct the framing of arbitrary bytes: magic, sync words, lengths, CRCs of chunks and of
//! states. Mutated bytes then get as far as possible into the decoder.

use quarc::chunks::{
    build_chunk, read_fields, Kind, CANO, CHUNK_CRC_BYTES, CHUNK_HEADER_BYTES, FRAM, HEAD, MAGIC,
    SNAP,
};
use quarc::coding::canonical::read_canonical;
use quarc::coding::grid::Grid;
use quarc::coding::snapshot::read_snapshot;
use quarc::error::{Error, Reject, Result};
use quarc::records::{FrameChunk, Gaussians, Header};
use quarc::state::State;
use quarc::wire;
use std::sync::Arc;

/// Scenes with more Gaussians are not corrected, to bound the time per input.
pub const GAUSSIANS: usize = 1 << 12;

/// Frame the bytes of a stream again.
pub fn mend(data: &[u8]) -> Vec<u8> {
    let mut stream = MAGIC.to_vec();
    let mut mender = Mender::default();
    let mut rest = data.get(MAGIC.len()..).unwrap_or_default();
    while let Some((head, behind)) = rest.split_first_chunk::<CHUNK_HEADER_BYTES>() {
        let fields = read_fields(head, 0);
        let length = (fields.length as usize).min(behind.len().saturating_sub(CHUNK_CRC_BYTES));
        let payload = mender.mend(fields.kind, &behind[..length]);
        stream.extend(build_chunk(fields.kind, fields.sequence, &payload).expect("it fits"));
        rest = behind.get(length + CHUNK_CRC_BYTES..).unwrap_or_default();
    }
    stream
}

/// Decodes the states to know their CRCs.
#[derive(Default)]
struct Mender {
    header: Option<Arc<Header>>,
    state: Option<State>,
    canonical: Option<Gaussians>,
}

impl Mender {
    /// Correct the state CRC of a payload, as long as a state can be decoded.
    fn mend(&mut self, kind: Kind, payload: &[u8]) -> Vec<u8> {
        let mended = match kind {
            HEAD => {
                self.header = wire::parse_header(payload).ok().map(Arc::new);
                return payload.to_vec();
            }
            CANO => self.canonical(payload),
            SNAP => self.snapshot(payload),
            FRAM => self.frame(payload),
            _ => return payload.to_vec(),
        };
        mended.unwrap_or_else(|_| {
            self.state = None;
            payload.to_vec()
        })
    }

    fn known_header(&self) -> Result<Arc<Header>> {
        self.header.clone().ok_or_else(|| left("no HEAD"))
    }

    fn canonical(&mut self, payload: &[u8]) -> Result<Vec<u8>> {
        let header = self.known_header()?;
        let mut chunk = wire::parse_canonical(payload)?;
        let count = chunk.gaussian_count as usize;
        require_few(count)?;
        let grid = Grid { origin: chunk.origin, axis_bits: chunk.axis_bits };
        let gaussians = read_canonical(&chunk.sections, count, grid, header.code_planes())?;
        let state = State::begin(&header, chunk.frame, &gaussians)?;
        chunk.state_crc = state.state_crc();
        self.canonical = Some(gaussians);
        self.state = Some(state);
        wire::build_canonical(&chunk)
    }

    fn snapshot(&mut self, payload: &[u8]) -> Result<Vec<u8>> {
        let header = self.known_header()?;
        let canonical = self.canonical.as_ref().ok_or_else(|| left("no CANO"))?;
        let mut chunk = wire::parse_snapshot(payload)?;
        require_few(chunk.newborn_count as usize)?;
        let check = |count: u64| require_few(count as usize);
        let (gaussians, _) = read_snapshot(&chunk, canonical, check)?;
        let state = State::begin(&header, chunk.frame, &gaussians)?;
        chunk.state_crc = state.state_crc();
        self.state = Some(state);
        wire::build_snapshot(&chunk)
    }

    fn frame(&mut self, payload: &[u8]) -> Result<Vec<u8>> {
        let mut state = self.state.take().ok_or_else(|| left("no state"))?;
        let mut chunk = wire::parse_frame(payload, state.header().updates)?;
        require_few(state.count() + chunk.birth_count as usize)?;
        advance(&mut state, &chunk)?;
        chunk.state_crc = state.state_crc();
        self.state = Some(state);
        wire::build_frame(&chunk)
    }
}

/// The steps of a frame without the last one, its CRC.
fn advance(state: &mut State, chunk: &FrameChunk) -> Result<()> {
    state.begin_frame(chunk.death_count)?;
    let symbols = state.read_motion(&chunk.motion, chunk.previous_contexts)?;
    state.move_by(&symbols)?;
    if let Some(section) = &chunk.updates {
        let updates = state.read_updates(section)?;
        state.update(&updates)?;
    }
    let births = state.read_births(&chunk.births, chunk.birth_count)?;
    state.bear(&births)
}

fn require_few(count: usize) -> Result<()> {
    if count == 0 || count > GAUSSIANS {
        return Err(left("too many Gaussians, or none"));
    }
    Ok(())
}

/// Why a payload cannot be corrected.
fn left(why: &str) -> Error {
    Error::new(Reject::Count, why)
}
