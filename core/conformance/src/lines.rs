//! The output lines about a stream.

use crate::Said;
use quarc::error::Error;
use quarc::floats::Dequantizer;
use quarc::recover::{Gap, Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::state::State;
use quarc::stream::{decode_all, Decoder};
use serde_json::{json, Value};
use sha2::{Digest, Sha256};
use std::io::{self, ErrorKind, Read, Write};

/// How to report the floats of a frame.
#[derive(Clone, Copy)]
pub enum Numbers {
    /// Omit them.
    None,
    /// Their SHA-256.
    Digest,
    /// All of them.
    Values,
}

/// Why decoding stopped: an error of the stream, or of the output.
enum Fault {
    Stream(Error),
    Output(io::Error),
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Fault::Stream(error)
    }
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Fault::Output(error)
    }
}

/// Writes lines.
pub struct Lines<W> {
    output: W,
}

impl<W: Write> Lines<W> {
    pub fn new(output: W) -> Self {
        Lines { output }
    }

    /// Write a line and flush it, because the sender of the stream may wait for it.
    pub fn say(&mut self, line: &Value) -> Said<()> {
        let mut text = line.to_string();
        text.push('\n');
        self.output.write_all(text.as_bytes())?;
        self.output.flush()
    }

    /// The frames of a stream that arrives in order. Returns the exit status.
    pub fn stream(&mut self, input: &mut dyn Read, numbers: Numbers) -> Said<u8> {
        let told = decode_all(input, &mut Decoder::new(), |state| self.frame(state, numbers));
        self.end(told)
    }

    /// The frames from `start` on.
    pub fn seek(&mut self, stream: &[u8], start: u32, numbers: Numbers) -> Said<u8> {
        let told = self.try_seek(stream, start, numbers);
        self.end(told)
    }

    /// The frames and gaps of a damaged stream.
    pub fn recovery(&mut self, stream: &[u8]) -> Said<u8> {
        let told = self.try_recovery(stream);
        self.end(told)
    }

    /// The result of a function, or its rejection.
    pub fn unit(&mut self, answer: Result<Value, Error>) -> Said<u8> {
        let told = match answer {
            Ok(output) => self.say(&json!({ "output": output })).map_err(Fault::from),
            Err(error) => Err(error.into()),
        };
        self.end(told)
    }

    fn try_seek(&mut self, stream: &[u8], start: u32, numbers: Numbers) -> Result<(), Fault> {
        let mut decoder = SeekDecoder::new(stream, start)?;
        while let Some(state) = decoder.pull()? {
            self.frame(state, numbers)?;
        }
        Ok(())
    }

    fn try_recovery(&mut self, stream: &[u8]) -> Result<(), Fault> {
        let mut recovery = Recovery::new(stream)?;
        while let Some(found) = recovery.pull()? {
            match found {
                Recovered::Frame(state) => self.frame(state, Numbers::None)?,
                Recovered::Gap(gap) => self.say(&describe_gap(&gap))?,
            }
        }
        Ok(())
    }

    fn frame(&mut self, state: &State, numbers: Numbers) -> Result<(), Fault> {
        let mut line = json!({
            "frame": state.frame_ordinal(), "gaussians": state.count(), "sha256": state.digest()
        });
        match numbers {
            Numbers::None => {}
            Numbers::Digest => line["numbers_sha256"] = hex(&Sha256::digest(serialize(state))),
            Numbers::Values => line["values"] = hex(&serialize(state)),
        }
        self.say(&line)?;
        Ok(())
    }

    /// Write the last line, if decoding failed, and return the exit status. An unreadable input and a
    /// malformed job are errors: they say nothing about a stream.
    fn end(&mut self, told: Result<(), Fault>) -> Said<u8> {
        let error = match told {
            Ok(()) => return Ok(0),
            Err(Fault::Output(error)) => return Err(error),
            Err(Fault::Stream(error)) => error,
        };
        if let Some(reject) = error.reject() {
            self.say(&json!({ "refused": reject.id(), "message": error.to_string() }))?;
            return Ok(1);
        }
        let Error::Limit(reason) = error else {
            return Err(io::Error::new(ErrorKind::Other, error.to_string()));
        };
        self.say(&json!({ "declined": reason }))?;
        Ok(3)
    }
}

fn describe_gap(gap: &Gap) -> Value {
    json!({ "gap": {
        "offset": gap.offset,
        "bytes": gap.bytes,
        "refused": gap.reject.id(),
        "frames_lost": gap.frames_lost,
    } })
}

/// The floats of a state, row by row in the order of the serialization.
fn serialize(state: &State) -> Vec<u8> {
    let mut dequantizer = Dequantizer::default();
    let splats = dequantizer.dequantize(state);
    let arrays = [
        (3, &splats.positions),
        (4, &splats.rotations),
        (3, &splats.log_scales),
        (1, &splats.opacities),
        (state.header().code_planes() - 4, &splats.sh),
    ];
    let rows = arrays.iter().flat_map(|(width, array)| {
        (0..*width).map(move |row| array.iter().skip(row).step_by(*width))
    });
    rows.flatten().flat_map(|number| number.to_le_bytes()).collect()
}

fn hex(bytes: &[u8]) -> Value {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<String>().into()
}
