//! From chunks to states, with the checks across chunks: SPEC 5.8, 5.9, 7.2, 7.4, 7.9.

use crate::chunks::{ChunkHeader, CAME, CANO, FRAM, HEAD, INDX, META, SNAP, TAIL};
use crate::error::{Error, Reject, Result};
use crate::records::{Gaussians, Header, SeekPoint, Tail};
use crate::state::State;
use crate::wire;
use std::sync::Arc;

/// The CANO that snapshots are coded against (SPEC 7.9).
#[derive(Clone, Debug)]
pub struct Reference {
    /// Ordinal of its frame.
    pub frame: u32,
    /// Its Gaussians, as coded.
    pub gaussians: Gaussians,
}

/// Takes the chunks of a stream one by one and returns the state of every frame.
///
/// If the bytes arrive in order, use [`Decoder`](super::Decoder); this type is for callers that
/// read chunks from arbitrary positions.
#[derive(Clone, Debug, Default)]
pub struct StateDecoder {
    header: Option<Arc<Header>>,
    state: Option<State>,
    previous: Option<u32>, // ordinal of the previous frame; None if any may follow
    cameras: Vec<wire::Camera>,
    metadata: wire::Metadata,
    index: Option<Vec<SeekPoint>>,
    tail: Option<Tail>,
    points: Vec<SeekPoint>, // including those skipped
    frame_count: i64,       // signed, because a malformed stream may skip a negative number
    index_offset: u64,
    sought: Option<SeekPoint>,
    lost: bool,
    reference: Option<Reference>,
    canonical_indices: Vec<i32>,
}

impl StateDecoder {
    /// The content of HEAD; `None` before it.
    #[must_use]
    pub fn header(&self) -> Option<&Arc<Header>> {
        self.header.as_ref()
    }

    /// The state of the last frame; `None` before the first, and after an error.
    #[must_use]
    pub fn state(&self) -> Option<&State> {
        self.state.as_ref()
    }

    /// The cameras of the last `came`.
    #[must_use]
    pub fn cameras(&self) -> &[wire::Camera] {
        &self.cameras
    }

    /// The entries of the last `meta`.
    #[must_use]
    pub fn metadata(&self) -> &[(String, String)] {
        &self.metadata
    }

    /// The seek points of INDX; `None` before it.
    #[must_use]
    pub fn index(&self) -> Option<&[SeekPoint]> {
        self.index.as_deref()
    }

    /// TAIL; `None` before it.
    #[must_use]
    pub fn tail(&self) -> Option<&Tail> {
        self.tail.as_ref()
    }

    /// The CANO that a snapshot may be coded against; `None` before the first, and in streams
    /// without snapshots.
    #[must_use]
    pub fn reference(&self) -> Option<&Reference> {
        self.reference.as_ref()
    }

    /// For each Gaussian of the last canonical frame, its index in the CANO, or -1 if it is new;
    /// empty in streams without snapshots.
    #[must_use]
    pub fn canonical_indices(&self) -> &[i32] {
        &self.canonical_indices
    }

    /// Expect the frame of the last of these seek points next (SPEC 11.2).
    ///
    /// # Arguments
    /// All seek points of the stream up to that one. If there are none, nothing is skipped.
    pub fn skip_to(&mut self, mut points: Vec<SeekPoint>) {
        if let Some(sought) = points.pop() {
            let first = points.first().unwrap_or(&sought).frame;
            self.frame_count = i64::from(sought.frame) - i64::from(first);
            self.sought = Some(sought);
            self.points = points;
        }
    }

    /// Decode the CANO that the next snapshot is coded against, without returning its state; it
    /// must match the seek point.
    ///
    /// # Errors
    /// The chunk is malformed.
    pub fn refer_to(
        &mut self,
        chunk: &ChunkHeader,
        payload: &[u8],
        point: SeekPoint,
    ) -> Result<()> {
        self.decode_canonical(chunk, payload, Some(point))
            .map(drop)
            .map_err(|error| error.at(chunk.offset))
    }

    /// Mark the chunks up to the next canonical frame, or TAIL, as lost (SPEC 11.4).
    pub fn lose(&mut self) {
        self.state = None;
        self.previous = None;
        self.lost = true;
    }

    /// Decode the next chunk, whose CRCs are correct. Returns whether it is a frame, whose state is
    /// then [`StateDecoder::state`].
    ///
    /// # Errors
    /// The chunk is malformed. After that, only [`StateDecoder::lose`] may be called, unless the
    /// chunk was ancillary.
    pub fn push(&mut self, chunk: &ChunkHeader, payload: &[u8]) -> Result<bool> {
        self.take(chunk, payload).map_err(|error| error.at(chunk.offset))
    }

    fn take(&mut self, chunk: &ChunkHeader, payload: &[u8]) -> Result<bool> {
        match chunk.kind {
            HEAD => self.header = Some(Arc::new(wire::parse_header(payload)?)),
            CAME => self.cameras = wire::parse_cameras(payload)?,
            META => self.metadata = wire::parse_metadata(payload)?,
            INDX => self.take_index(chunk, wire::parse_index(payload)?)?,
            TAIL => self.take_tail(wire::parse_tail(payload)?)?,
            CANO => {
                let state = self.decode_canonical(chunk, payload, self.sought)?;
                self.keep_canonical(chunk, state);
            }
            SNAP => {
                let state = self.decode_snapshot(chunk, payload)?;
                self.keep_canonical(chunk, state);
            }
            FRAM => self.take_frame(payload)?,
            _ => {} // ancillary, of an unknown type [5.2-10]
        }
        Ok(matches!(chunk.kind, CANO | SNAP | FRAM))
    }

    fn known_header(&self) -> Result<Arc<Header>> {
        let message = "HEAD must be the first chunk"; // [5.1-2]
        self.header.clone().ok_or_else(|| Error::new(Reject::ChunkOrder, message))
    }

    fn decode_canonical(
        &mut self,
        chunk: &ChunkHeader,
        payload: &[u8],
        sought: Option<SeekPoint>,
    ) -> Result<State> {
        let header = self.known_header()?;
        let canonical = wire::parse_canonical(payload)?;
        self.check_place(chunk, canonical.frame, sought)?;
        let (state, gaussians) = State::canonical(&header, &canonical)?;
        if header.snapshots {
            self.canonical_indices = (0..).take(gaussians.count()).collect();
            self.reference = Some(Reference { frame: canonical.frame, gaussians });
        }
        Ok(state)
    }

    fn decode_snapshot(&mut self, chunk: &ChunkHeader, payload: &[u8]) -> Result<State> {
        let header = self.known_header()?;
        let message = "a snapshot must follow a CANO"; // [5.1-3]
        let reference =
            self.reference.as_ref().ok_or_else(|| Error::new(Reject::ChunkOrder, message))?;
        let snapshot = wire::parse_snapshot(payload)?;
        self.check_place(chunk, snapshot.frame, self.sought)?;
        if snapshot.canonical != reference.frame {
            let (said, last) = (snapshot.canonical, reference.frame);
            let message =
                format!("coded against frame {said}, where the last CANO is frame {last}");
            return Err(Error::new(Reject::FrameOrder, message)); // [7.9-2]
        }
        let (state, canonical_indices) = State::snapshot(&header, &snapshot, &reference.gaussians)?;
        self.canonical_indices = canonical_indices;
        Ok(state)
    }

    fn take_frame(&mut self, payload: &[u8]) -> Result<()> {
        let message = "a frame must follow a canonical frame"; // [5.1-3]
        let mut state = self.state.take().ok_or_else(|| Error::new(Reject::ChunkOrder, message))?;
        let frame = wire::parse_frame(payload, state.header().updates)?;
        state.frame(&frame)?;
        self.keep(state);
        Ok(())
    }

    fn keep_canonical(&mut self, chunk: &ChunkHeader, state: State) {
        self.points.push(name(chunk, state.frame_ordinal()));
        self.sought = None;
        self.keep(state);
    }

    fn keep(&mut self, state: State) {
        self.frame_count += 1;
        self.previous = Some(state.frame_ordinal());
        self.state = Some(state);
    }

    /// Check the ordinal of a canonical frame, and the seek point that led to it.
    fn check_place(
        &self,
        chunk: &ChunkHeader,
        frame: u32,
        sought: Option<SeekPoint>,
    ) -> Result<()> {
        if let Some(previous) = self.previous {
            if previous.checked_add(1) != Some(frame) {
                let message = format!("frame {frame} follows frame {previous}");
                return Err(Error::new(Reject::FrameOrder, message)); // [7.2-1] [7.9-1]
            }
        }
        if sought.map_or(false, |sought| sought != name(chunk, frame)) {
            let message = format!("the seek point of frame {frame} does not match the frame");
            return Err(Error::new(Reject::IndexMismatch, message)); // [11.2-4]
        }
        Ok(())
    }

    fn take_index(&mut self, chunk: &ChunkHeader, index: Vec<SeekPoint>) -> Result<()> {
        if !self.lost && index != self.points {
            let message = "INDX does not list the canonical frames of the stream";
            return Err(Error::new(Reject::IndexMismatch, message)); // [5.9-1] [5.9-2] [11.4-3]
        }
        self.index = Some(index);
        self.index_offset = chunk.offset;
        Ok(())
    }

    fn take_tail(&mut self, tail: Tail) -> Result<()> {
        let is_seen = i64::from(tail.frame_count) == self.frame_count
            && tail.canonical_count as usize == self.points.len()
            && tail.index_offset == self.index_offset;
        if !self.lost && !is_seen {
            let message = format!(
                "TAIL says {} frames, {} of them canonical, and INDX at byte {}; \
                 the stream has {}, {} and {}",
                tail.frame_count,
                tail.canonical_count,
                tail.index_offset,
                self.frame_count,
                self.points.len(),
                self.index_offset
            );
            return Err(Error::new(Reject::TailMismatch, message)); // [5.8-1] [5.8-2] [11.4-3]
        }
        self.tail = Some(tail);
        Ok(())
    }
}

fn name(chunk: &ChunkHeader, frame: u32) -> SeekPoint {
    SeekPoint { offset: chunk.offset, sequence: chunk.sequence, frame }
}
