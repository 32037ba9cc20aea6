//! Decoding of damaged streams: SPEC 11.4.
//!
//! All losses are reported: every byte of a stream is either in a decoded chunk or in a reported
//! gap.

mod search;

use crate::chunks::{is_ancillary, ChunkHeader, TAIL};
use crate::error::{Error, Reject, Result};
use crate::reader::{trailing_data, ChunkReader};
use crate::seek::take_head;
use crate::source::Source;
use crate::state::State;
use crate::stream::StateDecoder;
use search::{Resumption, Searches, Wanted};
use std::collections::VecDeque;
use std::ops::Deref;

/// A part of the stream that was skipped. [11.4-2]
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Byte offset of its start.
    pub offset: u64,
    /// Number of bytes.
    pub bytes: u64,
    /// Why its start was rejected (SPEC 3.3).
    pub reject: Reject,
    /// The reason, for people.
    pub message: String,
    /// Number of frames lost in it; `None` if unknown.
    pub frames_lost: Option<u64>,
}

/// An item of a stream that may be damaged.
#[derive(Debug)]
pub enum Recovered<'a> {
    /// The state of a frame.
    Frame(&'a State),
    /// A gap before the next frame.
    Gap(Gap),
}

/// Decodes the frames of a stream that may be damaged, and reports the gaps between them.
///
/// After damage, decoding continues at the next CANO with correct CRCs, or at a snapshot coded
/// against a CANO that was decoded. Damaged ancillary chunks are skipped alone. The decoder derefs
/// to its [`StateDecoder`], which has the other information on the stream.
///
/// ```
/// use quarc::recover::{Recovered, Recovery};
///
/// let mut stream = std::fs::read("../../conformance/streams/journey.quarc")?;
/// stream[1000] ^= 1;
/// let mut recovery = Recovery::new(&stream[..])?;
/// let (mut frames, mut lost) = (Vec::new(), Vec::new());
/// while let Some(found) = recovery.pull()? {
///     match found {
///         Recovered::Frame(state) => frames.push(state.frame_ordinal()),
///         Recovered::Gap(gap) => lost.push(gap.frames_lost),
///     }
/// }
/// assert_eq!((frames, lost), (vec![0, 1, 2, 6, 7, 8], vec![Some(3)]));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct Recovery<S> {
    reader: ChunkReader<S>,
    states: StateDecoder,
    searches: Searches,
    first: Option<u32>, // ordinal of the first frame of the stream, if it was decoded
    due: Option<u64>,   // ordinal of the next frame
    gaps: VecDeque<Gap>,
    is_over: bool,
    failure: Option<Error>,
}

impl<S> Deref for Recovery<S> {
    type Target = StateDecoder;

    fn deref(&self) -> &StateDecoder {
        &self.states
    }
}

impl<S: Source> Recovery<S> {
    /// A decoder of a stream whose HEAD is intact.
    ///
    /// # Errors
    /// Those of reading HEAD.
    pub fn new(source: S) -> Result<Self> {
        let mut reader = ChunkReader::new(source)?;
        let mut states = StateDecoder::default();
        take_head(&mut reader, &mut states)?;
        Ok(Recovery {
            searches: Searches::new(reader.order.limit()),
            reader,
            states,
            first: None,
            due: None,
            gaps: VecDeque::new(),
            is_over: false,
            failure: None,
        })
    }

    /// Return the next frame, or a gap before it; `None` at the end of the stream.
    ///
    /// # Errors
    /// `unknown-critical`, also on further calls; [`Error::Limit`]; [`Error::Source`].
    pub fn pull(&mut self) -> Result<Option<Recovered<'_>>> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        match self.advance() {
            Ok(true) => Ok(self.states.state().map(Recovered::Frame)),
            Ok(false) => Ok(self.gaps.pop_front().map(Recovered::Gap)),
            Err(error) => {
                self.failure = Some(error.clone());
                self.states.lose();
                Err(error)
            }
        }
    }

    /// Decode up to the next frame; false if a gap comes first or the stream ends.
    fn advance(&mut self) -> Result<bool> {
        while self.gaps.is_empty() && !self.is_over {
            let begin = self.reader.order.offset;
            let mut accepted = None;
            match self.take_chunk(&mut accepted) {
                Ok(true) => return Ok(true),
                Ok(false) => {}
                Err(error) => match error.reject() {
                    None | Some(Reject::UnknownCritical) => return Err(error),
                    Some(reject) => self.leave_out(begin, accepted, reject, &error)?,
                },
            }
        }
        Ok(false)
    }

    /// Read and decode a chunk; returns whether it is a frame. `accepted` is set to its header once
    /// this is accepted.
    fn take_chunk(&mut self, accepted: &mut Option<ChunkHeader>) -> Result<bool> {
        let Some(header) = self.reader.read_header()? else { return Ok(false) };
        *accepted = Some(header);
        let chunk = self.reader.take(header)?;
        let is_frame = self.states.push(&header, &chunk.payload)?;
        if let Some(state) = self.states.state().filter(|_| is_frame) {
            let ordinal = state.frame_ordinal();
            if self.due.is_none() {
                self.first = Some(ordinal);
            }
            self.due = Some(u64::from(ordinal) + 1);
        }
        if header.kind == TAIL {
            self.end()?;
        }
        Ok(is_frame)
    }

    /// Handle the end of the stream, after TAIL.
    fn end(&mut self) -> Result<()> {
        self.is_over = true;
        let (place, size) = (self.reader.order.offset, self.reader.source.size()?);
        if place < size {
            let error = trailing_data(place);
            self.add_gap(place, size, Reject::TrailingData, &error, None);
        }
        Ok(())
    }

    /// Continue after a rejected chunk.
    fn leave_out(
        &mut self,
        begin: u64,
        accepted: Option<ChunkHeader>,
        reject: Reject,
        error: &Error,
    ) -> Result<()> {
        match accepted {
            Some(header) if is_ancillary(header.kind) && reject != Reject::Truncated => {
                self.reader.order.pass(&header);
                self.add_gap(begin, header.end(), reject, error, Some(0));
                return Ok(());
            }
            Some(header) if reject == Reject::PayloadCrc => self.searches.spend(header.length),
            _ => {}
        }
        self.states.lose(); // [11.4-3]
        self.resume(begin, reject, error)
    }

    fn resume(&mut self, begin: u64, reject: Reject, error: &Error) -> Result<()> {
        let wanted = Wanted {
            offset: self.reader.order.offset,
            sequence: self.reader.order.sequence,
            frame: self.due.unwrap_or(0), // [11.4-1]
            canonical: self.states.reference().map(|reference| reference.frame),
        };
        let Some(found) = self.searches.find(&mut self.reader.source, &wanted)? else {
            return self.give_up(begin, reject, error);
        };
        let Resumption { header, .. } = found;
        let lost = self.count_lost(&found);
        self.add_gap(begin, header.offset, reject, error, lost);
        self.reader.order.go_to(header.offset, header.sequence.into());
        Ok(())
    }

    /// Report the rest of the stream as a gap, as decoding cannot resume in it.
    fn give_up(&mut self, begin: u64, reject: Reject, error: &Error) -> Result<()> {
        self.is_over = true;
        let size = self.reader.source.size()?;
        self.add_gap(begin, size, reject, error, None);
        if reject != Reject::Truncated {
            let message = "the stream ends without a chunk at which decoding can resume";
            let cut = Error::new(Reject::Truncated, message).at(size);
            self.add_gap(size, size, Reject::Truncated, &cut, None);
        }
        Ok(())
    }

    /// Return the number of frames lost before the chunk at which decoding resumes, and expect its
    /// ordinal next; at TAIL, expect the ordinal after the last frame, if known.
    fn count_lost(&mut self, found: &Resumption) -> Option<u64> {
        let number = u64::from(found.number);
        let due = if found.header.kind == TAIL {
            self.first.map(|first| u64::from(first) + number)
        } else {
            Some(number)
        };
        let before = std::mem::replace(&mut self.due, due);
        due?.checked_sub(before?)
    }

    fn add_gap(&mut self, begin: u64, end: u64, reject: Reject, error: &Error, lost: Option<u64>) {
        let bytes = end.saturating_sub(begin);
        let message = error.to_string();
        self.gaps.push_back(Gap { offset: begin, bytes, reject, message, frames_lost: lost });
    }
}
