//! What the fuzz targets share: streams that are put right again, and what came of them.

pub mod mend;

use quarc::error::{Error, Reject};
use quarc::recover::{Gap, Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::state::State;
use quarc::stream::Decoder;

/// Frames that are looked at, at most: the time of one input is bounded.
const FRAMES: usize = 64;

/// A frame that came out: its ordinal, and its digest.
pub type Frame = (u32, String);

/// What came of a stream.
#[derive(Debug, PartialEq, Eq)]
pub struct Outcome {
    /// All frames, but for those beyond a bound.
    pub frames: Vec<Frame>,
    /// What it was rejected for; `Ok` is the end, or the bound.
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
            other => panic!("of bytes in memory nothing else can be said: {other}"),
        }
    }
}

fn name(state: &State) -> Frame {
    (state.frame_ordinal(), state.digest())
}

/// Decode in order, from pieces of so many bytes.
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

/// Decode from a frame on.
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

/// Decode past damage.
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
