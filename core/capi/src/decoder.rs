//! A decoder of any of the three kinds, with one interface.

use crate::parts::SharedParts;
use quarc::error::{Error, Result};
use quarc::floats::{Dequantizer, Redone, Splats};
use quarc::records::{Header, SeekPoint, Tail};
use quarc::recover::{Gap, Recovered, Recovery};
use quarc::seek::{find_index, SeekDecoder};
use quarc::state::State;
use quarc::stream::{Decoder, StateDecoder};
use std::ffi::{CStr, CString};

/// How a stream is read.
enum Way {
    InOrder(Decoder),
    /// The bytes so far, and the decoder to open once they are complete.
    Gathering(Vec<u8>, Whole),
    Seeking(Box<SeekDecoder<SharedParts>>),
    /// From a frame on, reading byte ranges: the bytes read, and the decoder.
    Reading(SharedParts, u32, Option<Box<SeekDecoder<SharedParts>>>),
    Recovering(Recovery<SharedParts>),
    /// Opening a decoder failed.
    None,
}

/// A decoder that needs all bytes of a stream.
#[derive(Clone, Copy)]
enum Whole {
    Seek(u32),
    Recover,
}

/// The result of a pull.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pulled {
    /// More bytes are needed.
    More,
    /// A frame.
    Frame,
    /// A missing part of the stream.
    Gap,
    /// The end of the stream.
    End,
}

/// Decodes a stream in order, from a frame on, or past damage; keeps its last result.
pub struct AnyDecoder {
    way: Way,
    is_finished: bool,
    dequantizer: Dequantizer,
    gap: Option<(Gap, CString)>, // and its reject id
    preview: Option<State>,
    failure: Option<Failure>,
}

/// The error, and its texts as zero-terminated strings.
struct Failure {
    error: Error,
    id: Option<CString>,
    message: CString,
}

impl Failure {
    fn new(error: Error) -> Self {
        let id = error.reject().map(|reject| text(reject.id()));
        Failure { id, message: text(&error.to_string()), error }
    }
}

/// Messages contain no zeros; if one did, its zeros would be dropped.
fn text(said: &str) -> CString {
    CString::new(said.replace('\0', " ")).unwrap_or_default()
}

impl AnyDecoder {
    /// A decoder of frames in order, as their bytes arrive.
    pub fn in_order() -> Self {
        Self::of(Way::InOrder(Decoder::new()))
    }

    /// A decoder of the frames from one on.
    pub fn seek(start: u32) -> Self {
        Self::of(Way::Gathering(Vec::new(), Whole::Seek(start)))
    }

    /// A decoder of the intact frames of a damaged stream.
    pub fn recover() -> Self {
        Self::of(Way::Gathering(Vec::new(), Whole::Recover))
    }

    /// A decoder of the frames from one on that reads byte ranges.
    pub fn in_parts(start: u32) -> Self {
        Self::of(Way::Reading(SharedParts::default(), start, None))
    }

    fn of(way: Way) -> Self {
        let dequantizer = Dequantizer::default();
        AnyDecoder { way, is_finished: false, dequantizer, gap: None, preview: None, failure: None }
    }

    /// Append the next bytes; false if the stream was declared finished.
    pub fn push(&mut self, bytes: &[u8]) -> bool {
        match &mut self.way {
            _ if self.is_finished => return false,
            Way::InOrder(decoder) => decoder.push(bytes),
            Way::Gathering(known, _) => known.extend_from_slice(bytes),
            Way::Reading(..) => return false,
            Way::Seeking(_) | Way::Recovering(_) | Way::None => {}
        }
        true
    }

    /// Store bytes at an offset; false if the decoder does not read byte ranges.
    pub fn put(&mut self, offset: u64, bytes: &[u8]) -> bool {
        let parts = self.way.parts();
        parts.map(|parts| parts.0.borrow_mut().put(offset, bytes)).is_some()
    }

    /// Set the length of the stream; false if the decoder does not read byte ranges.
    pub fn limit(&mut self, size: u64) -> bool {
        let Some(parts) = self.way.parts() else { return false };
        let mut parts = parts.0.borrow_mut();
        (parts.size, parts.is_whole) = (size, true);
        true
    }

    /// The range of bytes that the decoder waits for.
    pub fn missing(&self) -> Option<(u64, u64)> {
        self.way.parts()?.0.borrow().missing
    }

    /// Offset of the next chunk of such a stream.
    pub fn offset(&self) -> Option<u64> {
        match &self.way {
            Way::Reading(_, _, decoder) => decoder.as_ref()?.offset(),
            _ => None,
        }
    }

    /// The contents of TAIL and INDX; an error while their bytes are missing.
    pub fn find_index(&self) -> Result<Option<(Tail, Vec<SeekPoint>)>> {
        let Some(parts) = self.way.parts() else { return Ok(None) };
        parts.0.borrow_mut().missing = None;
        find_index(parts.clone())
    }

    /// The preview of a canonical frame whose chunk is incomplete, if it shows more than at
    /// the last call: the number of decoded sections, and the state.
    pub fn preview(&mut self) -> Option<(usize, &State)> {
        let Way::Reading(parts, _, Some(decoder)) = &mut self.way else { return None };
        let missing = parts.0.borrow().missing;
        let found = decoder.preview();
        parts.0.borrow_mut().missing = missing; // `pull` is still missing the same bytes
        let (sections, state) = found?;
        Some((sections, self.preview.insert(state)))
    }

    /// Declare the end of the stream; false if the decoder reads byte ranges, for which `limit`
    /// does this.
    pub fn finish(&mut self) -> bool {
        match &mut self.way {
            Way::Reading(..) => return false,
            Way::InOrder(decoder) => decoder.finish(),
            _ => {}
        }
        self.is_finished = true;
        true
    }

    /// Decode the next frame or gap.
    pub fn pull(&mut self) -> Result<Pulled> {
        if let Some(failure) = &self.failure {
            return Err(failure.error.clone());
        }
        let pulled = self.try_pull();
        match (&self.way, &pulled) {
            (Way::Reading(parts, ..), Err(Error::Source(_))) => {
                // If the length is unknown, do not wait for bytes after TAIL.
                let is_past_tail = self.stream().map_or(false, |stream| stream.tail().is_some());
                let is_over = is_past_tail && !parts.0.borrow().is_whole;
                return Ok(if is_over { Pulled::End } else { Pulled::More });
            }
            (_, Err(error)) => self.failure = Some(Failure::new(error.clone())),
            _ => {}
        }
        pulled
    }

    fn try_pull(&mut self) -> Result<Pulled> {
        (self.gap, self.preview) = (None, None);
        if self.is_finished {
            self.begin()?;
        }
        match &mut self.way {
            Way::InOrder(decoder) => {
                let is_frame = decoder.pull()?.is_some();
                let otherwise = if decoder.is_over() { Pulled::End } else { Pulled::More };
                Ok(if is_frame { Pulled::Frame } else { otherwise })
            }
            Way::Gathering(..) => Ok(Pulled::More),
            Way::Seeking(decoder) => Ok(decoder.pull()?.map_or(Pulled::End, |_| Pulled::Frame)),
            Way::Reading(parts, start, decoder) => {
                parts.0.borrow_mut().missing = None;
                let decoder = match decoder {
                    Some(decoder) => decoder,
                    None => decoder.insert(Box::new(SeekDecoder::new(parts.clone(), *start)?)),
                };
                let pulled =
                    decoder.pull().map(|state| state.map_or(Pulled::End, |_| Pulled::Frame));
                parts.0.borrow_mut().forget_before(decoder.offset().unwrap_or_default());
                pulled
            }
            Way::Recovering(recovery) => match recovery.pull()? {
                None => Ok(Pulled::End),
                Some(Recovered::Frame(_)) => Ok(Pulled::Frame),
                Some(Recovered::Gap(gap)) => {
                    let id = text(gap.reject.id());
                    self.gap = Some((gap, id));
                    Ok(Pulled::Gap)
                }
            },
            Way::None => Ok(Pulled::End), // unreachable: `pull` has returned the error before
        }
    }

    /// Open a decoder of a complete stream.
    fn begin(&mut self) -> Result<()> {
        if !matches!(self.way, Way::Gathering(..)) {
            return Ok(());
        }
        if let Way::Gathering(bytes, whole) = std::mem::replace(&mut self.way, Way::None) {
            let source = SharedParts::whole(bytes);
            self.way = match whole {
                Whole::Seek(start) => Way::Seeking(Box::new(SeekDecoder::new(source, start)?)),
                Whole::Recover => Way::Recovering(Recovery::new(source)?),
            };
        }
        Ok(())
    }

    /// The parameters of the stream; `None` before HEAD.
    pub fn header(&self) -> Option<&Header> {
        self.way.states()?.header().map(AsRef::as_ref)
    }

    /// What is known of the stream, once a decoder is open.
    pub fn stream(&self) -> Option<&StateDecoder> {
        self.way.states()
    }

    /// The state of the last frame; `None` before the first, and after an error.
    pub fn state(&self) -> Option<&State> {
        self.way.states()?.state()
    }

    /// The state of the last frame, converted to floats now.
    pub fn dequantize(&mut self) -> Option<(&State, &Splats, Redone)> {
        let state = self.way.states()?.state()?;
        let redone = self.dequantizer.update(state);
        Some((state, self.dequantizer.splats(), redone))
    }

    /// The last gap and its reject id, if the last pull returned one.
    pub fn gap(&self) -> Option<(&Gap, &CStr)> {
        self.gap.as_ref().map(|(gap, id)| (gap, id.as_c_str()))
    }

    /// The error message.
    pub fn message(&self) -> Option<&CStr> {
        self.failure.as_ref().map(|failure| failure.message.as_c_str())
    }

    /// The reject id, if the stream was rejected.
    pub fn reject_id(&self) -> Option<&CStr> {
        self.failure.as_ref()?.id.as_deref()
    }
}

impl Way {
    fn states(&self) -> Option<&StateDecoder> {
        match self {
            Way::InOrder(decoder) => Some(decoder),
            Way::Seeking(decoder) => Some(decoder),
            Way::Reading(_, _, decoder) => decoder.as_deref().map(|decoder| &**decoder),
            Way::Recovering(recovery) => Some(recovery),
            Way::Gathering(..) | Way::None => None,
        }
    }

    fn parts(&self) -> Option<&SharedParts> {
        match self {
            Way::Reading(parts, ..) => Some(parts),
            _ => None,
        }
    }
}
