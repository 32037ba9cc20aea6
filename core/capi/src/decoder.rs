//! A decoder of any of the three kinds, behind one face.

use quarc::error::{Error, Result};
use quarc::floats::{Dequantizer, Redone, Splats};
use quarc::records::Header;
use quarc::recover::{Gap, Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::source::IoSource;
use quarc::state::State;
use quarc::stream::{Decoder, StateDecoder};
use std::ffi::{CStr, CString};
use std::io::Cursor;

type Bytes = IoSource<Cursor<Vec<u8>>>;

/// How a stream is gone through.
enum Way {
    InOrder(Decoder),
    /// The bytes so far, and what is to be made of them once they are all there.
    Gathering(Vec<u8>, Whole),
    Seeking(SeekDecoder<Bytes>),
    Recovering(Recovery<Bytes>),
    /// No decoder could be made of the bytes.
    None,
}

/// What needs all bytes of a stream.
#[derive(Clone, Copy)]
enum Whole {
    Seek(u32),
    Recover,
}

/// What a pull came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pulled {
    /// Nothing before more bytes come.
    More,
    /// A frame.
    Frame,
    /// A part of the stream that is missing.
    Gap,
    /// The end of the stream.
    End,
}

/// Decodes a stream, in its order, from a frame on, or past damage; keeps what was said last.
pub struct AnyDecoder {
    way: Way,
    is_finished: bool,
    dequantizer: Dequantizer,
    gap: Option<(Gap, CString)>, // and its reject id
    failure: Option<Failure>,
}

/// What went wrong, and texts of it that end with a zero.
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

/// Nothing that is said has a zero in it; one that had would be said without.
fn text(said: &str) -> CString {
    CString::new(said.replace('\0', " ")).unwrap_or_default()
}

impl AnyDecoder {
    /// Of frames in their order, as their bytes come.
    pub fn in_order() -> Self {
        Self::of(Way::InOrder(Decoder::new()))
    }

    /// Of frames from one on.
    pub fn seek(start: u32) -> Self {
        Self::of(Way::Gathering(Vec::new(), Whole::Seek(start)))
    }

    /// Of what is left of a damaged stream.
    pub fn recover() -> Self {
        Self::of(Way::Gathering(Vec::new(), Whole::Recover))
    }

    fn of(way: Way) -> Self {
        let dequantizer = Dequantizer::default();
        AnyDecoder { way, is_finished: false, dequantizer, gap: None, failure: None }
    }

    /// Take the next bytes; false if it has been said that there are no more.
    pub fn push(&mut self, bytes: &[u8]) -> bool {
        match &mut self.way {
            _ if self.is_finished => return false,
            Way::InOrder(decoder) => decoder.push(bytes),
            Way::Gathering(known, _) => known.extend_from_slice(bytes),
            Way::Seeking(_) | Way::Recovering(_) | Way::None => {}
        }
        true
    }

    /// Take it that no more bytes will come.
    pub fn finish(&mut self) {
        self.is_finished = true;
        if let Way::InOrder(decoder) = &mut self.way {
            decoder.finish();
        }
    }

    /// Go on to the next frame or gap.
    pub fn pull(&mut self) -> Result<Pulled> {
        if let Some(failure) = &self.failure {
            return Err(failure.error.clone());
        }
        let pulled = self.try_pull();
        if let Err(error) = &pulled {
            self.failure = Some(Failure::new(error.clone()));
        }
        pulled
    }

    fn try_pull(&mut self) -> Result<Pulled> {
        self.gap = None;
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
            Way::Recovering(recovery) => match recovery.pull()? {
                None => Ok(Pulled::End),
                Some(Recovered::Frame(_)) => Ok(Pulled::Frame),
                Some(Recovered::Gap(gap)) => {
                    let id = text(gap.reject.id());
                    self.gap = Some((gap, id));
                    Ok(Pulled::Gap)
                }
            },
            Way::None => Ok(Pulled::End), // not come to: the failure is told again
        }
    }

    /// Make a decoder of bytes that are all there.
    fn begin(&mut self) -> Result<()> {
        if !matches!(self.way, Way::Gathering(..)) {
            return Ok(());
        }
        if let Way::Gathering(bytes, whole) = std::mem::replace(&mut self.way, Way::None) {
            let source = IoSource(Cursor::new(bytes));
            self.way = match whole {
                Whole::Seek(start) => Way::Seeking(SeekDecoder::new(source, start)?),
                Whole::Recover => Way::Recovering(Recovery::new(source)?),
            };
        }
        Ok(())
    }

    /// What the stream chose for itself; `None` before HEAD.
    pub fn header(&self) -> Option<&Header> {
        self.way.states()?.header().map(AsRef::as_ref)
    }

    /// The state of the last frame; `None` before the first, and after a fault.
    pub fn state(&self) -> Option<&State> {
        self.way.states()?.state()
    }

    /// The state of the last frame in floats, which are made of it now.
    pub fn dequantize(&mut self) -> Option<(&State, &Splats, Redone)> {
        let state = self.way.states()?.state()?;
        let redone = self.dequantizer.update(state);
        Some((state, self.dequantizer.splats(), redone))
    }

    /// What was pulled last, if that was a gap, and its reject id.
    pub fn gap(&self) -> Option<(&Gap, &CStr)> {
        self.gap.as_ref().map(|(gap, id)| (gap, id.as_c_str()))
    }

    /// What went wrong, for people.
    pub fn message(&self) -> Option<&CStr> {
        self.failure.as_ref().map(|failure| failure.message.as_c_str())
    }

    /// The reject id of what went wrong, if the bytes are at fault.
    pub fn reject_id(&self) -> Option<&CStr> {
        self.failure.as_ref()?.id.as_deref()
    }
}

impl Way {
    fn states(&self) -> Option<&StateDecoder> {
        match self {
            Way::InOrder(decoder) => Some(decoder),
            Way::Seeking(decoder) => Some(decoder),
            Way::Recovering(recovery) => Some(recovery),
            Way::Gathering(..) | Way::None => None,
        }
    }
}
