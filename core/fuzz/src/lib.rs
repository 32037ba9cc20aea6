//! Shared by the fuzz targets: corrected streams, and the results of decoding.

pub mod mend;

use quarc::error::{Error, Reject};
use quarc::recover::{Gap, Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::state::State;
use quarc::stream::Decoder;

/// Maximum frames to decode, to bound the time per input.
const FRAMES: usize = 64;

/// A decoded frame: its ordinal and its digest.
pub type Frame = (u32, String);

/// The result of decoding a stream.
#[derive(Debug, PartialEq, Eq)]
pub struct Outcome {
    /// All frames, up to the bound.
    pub frames: Vec<Frame>,
    /// Why it was rejected; `Ok` at the end or at the bound.
    pub ended: Result<(), Fault>,
}

/// A reject id, or that the decoder declined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    Rejected(Reject),
    Declined,
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        match error {
            Error::Rejected { reject, .. } => Fault::Rejected(reject),
            Error::Limit(_) => Fault::Declined,
            other => panic!("unexpected error for bytes in memory: {other}"),
        }
    }
}

fn name(state: &State) -> Frame {
    (state.frame_ordinal(), state.digest())
}

/// Decode in order, from pieces of `piece` bytes.
pub fn decode(stream: &[u8], piece: usize) -> Outcome {
    let (mut decoder, mut frames) = (Decoder::new(), Vec::new());
    let mut pieces = stream.chunks(piece.max(1));
    loop {
        match decoder.pull() {
            Ok(Some(state)) => frames.push(name(state)),
            Ok(None) => match pieces.next() {
                Some(bytes) => decoder.push(bytes),
                None if decoder.is_over() => return Outcome { frames, ended: Ok(()) },
                None => decoder.finish(),
            },
            Err(error) => return Outcome { frames, ended: Err(error.into()) },
        }
        if frames.len() == FRAMES {
            return Outcome { frames, ended: Ok(()) };
        }
    }
}

/// Decode from frame `start` on.
pub fn seek(stream: &[u8], start: u32) -> Outcome {
    let mut frames = Vec::new();
    let mut run = || -> Result<(), Error> {
        let mut decoder = SeekDecoder::new(stream, start)?;
        while let Some(state) = decoder.pull()? {
            frames.push(name(state));
            if frames.len() == FRAMES {
                break;
            }
        }
        Ok(())
    };
    let ended = run().map_err(Fault::from);
    Outcome { frames, ended }
}

/// Decode a stream that may be damaged.
pub fn recover(stream: &[u8]) -> (Outcome, Vec<Gap>) {
    let (mut frames, mut gaps) = (Vec::new(), Vec::new());
    let mut run = || -> Result<(), Error> {
        let mut recovery = Recovery::new(stream)?;
        while let Some(found) = recovery.pull()? {
            match found {
                Recovered::Frame(state) => frames.push(name(state)),
                Recovered::Gap(gap) => gaps.push(gap),
            }
            if frames.len() == FRAMES {
                break;
            }
        }
        Ok(())
    };
    let ended = run().map_err(Fault::from);
    (Outcome { frames, ended }, gaps)
}
