//! Seeking to a frame: SPEC 11.2.
//!
//! The position is taken from INDX if the stream has one, and otherwise found by reading chunk
//! headers. Neither is trusted: the chunk found is checked against what pointed to it. A snapshot
//! also needs the CANO that it is coded against.

mod way;

pub use way::find_index;
use way::Search;

use crate::error::{Error, Result};
use crate::preview::Preview;
use crate::reader::ChunkReader;
use crate::source::Source;
use crate::state::State;
use crate::stream::StateDecoder;
use std::ops::Deref;

/// Decodes the frames of a stream from a given one on, and reads only the necessary parts of what
/// precedes it. The decoder derefs to its [`StateDecoder`], which has the other information on the
/// stream.
///
/// ```
/// use quarc::seek::SeekDecoder;
/// use quarc::source::IoSource;
///
/// let file = std::fs::File::open("../../conformance/streams/journey.quarc")?;
/// let mut decoder = SeekDecoder::new(IoSource(file), 7)?;
/// let mut frames = Vec::new();
/// while let Some(state) = decoder.pull()? {
///     frames.push((state.frame_ordinal(), state.count()));
/// }
/// assert_eq!(frames, [(7, 12), (8, 13)]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct SeekDecoder<S> {
    reader: ChunkReader<S>,
    states: StateDecoder,
    start: u32,
    /// Until the start is found.
    search: Option<Search>,
    preview: Option<Preview>,
    failure: Option<Error>,
}

impl<S> Deref for SeekDecoder<S> {
    type Target = StateDecoder;

    fn deref(&self) -> &StateDecoder {
        &self.states
    }
}

impl<S: Source> SeekDecoder<S> {
    /// A decoder whose first frame is that of ordinal `start`, or the first one after it. The frame
    /// is found by the first [`SeekDecoder::pull`].
    ///
    /// # Errors
    /// Those of reading HEAD.
    pub fn new(source: S, start: u32) -> Result<Self> {
        let mut reader = ChunkReader::new(source)?;
        let mut states = StateDecoder::default();
        take_head(&mut reader, &mut states)?;
        let search = (start > 0).then(|| Search::new(&reader, start));
        Ok(SeekDecoder { reader, states, start, search, preview: None, failure: None })
    }

    /// Return the state of the next frame; `None` after TAIL.
    ///
    /// # Errors
    /// The stream is malformed; further calls return the same error. All frames before it have been
    /// returned. After [`Error::Source`], decoding can continue.
    pub fn pull(&mut self) -> Result<Option<&State>> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        match self.find_start().and_then(|()| self.advance()) {
            Ok(true) => Ok(self.states.state()),
            Ok(false) => Ok(None),
            Err(error) => {
                // The source may have the bytes later.
                if !matches!(error, Error::Source(_)) {
                    self.failure = Some(error.clone());
                    self.states.lose();
                }
                Err(error)
            }
        }
    }

    /// A preview of a canonical frame whose chunk has not fully arrived, if another section has
    /// arrived since the last call: the number of sections decoded, and the state so far.
    ///
    /// Call this after [`SeekDecoder::pull`] has reported missing bytes. Errors in the chunk are
    /// reported only when it is complete.
    pub fn preview(&mut self) -> Option<(usize, State)> {
        self.advance_preview().ok().flatten()
    }

    fn advance_preview(&mut self) -> Result<Option<(usize, State)>> {
        if self.search.is_some() {
            return Ok(None);
        }
        let place = self.reader.order.offset;
        if self.preview.as_ref().map_or(true, |preview| preview.offset() != place) {
            let Some(header) = self.states.header() else { return Ok(None) };
            let Some(chunk) = self.reader.read_header()? else { return Ok(None) };
            self.preview = Preview::new(&mut self.reader.source, header, &chunk)?;
        }
        let Some(preview) = &mut self.preview else { return Ok(None) };
        if !preview.advance(&mut self.reader.source)? {
            return Ok(None);
        }
        Ok(Some((preview.sections(), preview.state()?)))
    }

    /// Byte offset of the next chunk in the stream; `None` while the start has not been found.
    #[must_use]
    pub fn offset(&self) -> Option<u64> {
        self.search.is_none().then_some(self.reader.order.offset)
    }

    fn find_start(&mut self) -> Result<()> {
        let Some(search) = &mut self.search else { return Ok(()) };
        let way = search.advance(&mut self.reader)?;
        if let Some((chunk, point)) = way.reference {
            self.states.refer_to(&chunk.header, &chunk.payload, point)?;
        }
        self.states.skip_to(way.points);
        self.search = None;
        Ok(())
    }

    /// Decode up to the next wanted frame; false at the end.
    fn advance(&mut self) -> Result<bool> {
        while let Some(chunk) = self.reader.read_chunk()? {
            let is_frame = self.states.push(&chunk.header, &chunk.payload)?;
            let ordinal = self.states.state().map_or(0, State::frame_ordinal);
            if is_frame && ordinal >= self.start {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Read HEAD.
pub(crate) fn take_head<S: Source>(
    reader: &mut ChunkReader<S>,
    states: &mut StateDecoder,
) -> Result<()> {
    if let Some(chunk) = reader.read_chunk()? {
        states.push(&chunk.header, &chunk.payload)?;
    }
    if let Some(header) = states.header() {
        reader.order.keep_to(header);
    }
    Ok(())
}
