//! The command line.

use crate::conformance::Ask;
use crate::decode::Wanted;
use crate::failure::Failure;
use lexopt::prelude::{Long, Short, Value, ValueExt};
use std::ffi::OsString;
use std::path::PathBuf;

/// The text of `quarc --help`.
pub const USAGE: &str = "\
quarc: moving Gaussian splats in .quarc streams

  quarc verify FILE            decode the whole stream and check its CRCs and totals
  quarc info FILE [--json]     describe the stream without decoding frames
  quarc decode FILE -o DIR     write every frame as a 3DGS PLY file, frame-00000000.ply, ...;
                               DIR is made if missing; its files of these names are replaced
      --start F, --stop F      only frames from F on, and only frames before F
      --recover                continue after damage and report what is missing
  quarc conformance            answer the runner of conformance/: a stream on standard input
      --jobs, --capabilities   many streams in one process; list what is supported

FILE may be `-` for standard input, or a pipe.
Exit status: 0 success; 1 the stream is rejected or has gaps; 2 any other error; 3 the stream
exceeds the limits of this decoder.
";

/// A parsed command line.
pub enum Task {
    /// Print the usage.
    Help,
    /// Print the version.
    Version,
    /// Check a stream.
    Verify {
        /// Its file.
        file: PathBuf,
    },
    /// Describe a stream.
    Info {
        /// Its file.
        file: PathBuf,
        /// Whether to print JSON.
        json: bool,
    },
    /// Write frames as PLY files.
    Decode(Wanted),
    /// Answer the runner of the conformance suite.
    Conformance(Ask),
}

/// Parse the command line.
pub fn parse(arguments: impl IntoIterator<Item = OsString>) -> Result<Task, Failure> {
    let mut parser = lexopt::Parser::from_iter(arguments);
    read_verb(&mut parser).map_err(|error| Failure::Usage(error.to_string()))
}

fn read_verb(parser: &mut lexopt::Parser) -> Result<Task, lexopt::Error> {
    let Some(first) = parser.next()? else { return Ok(Task::Help) };
    let verb = match first {
        Short('h') | Long("help") => return Ok(Task::Help),
        Short('V') | Long("version") => return Ok(Task::Version),
        Value(verb) => verb.string()?,
        other => return Err(other.unexpected()),
    };
    let mut found = Found::default();
    while let Some(argument) = parser.next()? {
        match argument {
            Short('h') | Long("help") => return Ok(Task::Help),
            Long("json") if verb == "info" => found.json = true,
            Short('o') | Long("output") if verb == "decode" => {
                found.folder = Some(parser.value()?.into());
            }
            Long("start") if verb == "decode" => found.start = read_frame(parser, "--start")?,
            Long("stop") if verb == "decode" => found.stop = Some(read_frame(parser, "--stop")?),
            Long("recover") if verb == "decode" => found.recover = true,
            Long("jobs") if verb == "conformance" => found.ask = Ask::Jobs,
            Long("capabilities") if verb == "conformance" => found.ask = Ask::Capabilities,
            Value(file) if found.file.is_none() && verb != "conformance" => {
                found.file = Some(file.into());
            }
            other => return Err(other.unexpected()),
        }
    }
    found.into_task(&verb)
}

/// The frame that an option names.
fn read_frame(parser: &mut lexopt::Parser, option: &str) -> Result<u32, lexopt::Error> {
    parser.value()?.parse().map_err(|error| format!("{option}: {error}").into())
}

#[derive(Default)]
struct Found {
    file: Option<PathBuf>,
    folder: Option<PathBuf>,
    json: bool,
    start: u32,
    stop: Option<u32>,
    recover: bool,
    ask: Ask,
}

impl Found {
    fn into_task(self, verb: &str) -> Result<Task, lexopt::Error> {
        if verb == "conformance" {
            return Ok(Task::Conformance(self.ask));
        }
        if !["verify", "info", "decode"].contains(&verb) {
            return Err(format!("unknown command {verb:?}").into());
        }
        let file = self.file.ok_or_else(|| format!("{verb} needs the name of a stream"))?;
        match verb {
            "verify" => Ok(Task::Verify { file }),
            "info" => Ok(Task::Info { file, json: self.json }),
            _ => {
                let folder = self.folder.filter(|folder| !folder.as_os_str().is_empty());
                let folder = folder.ok_or("decode needs -o and the name of a folder")?;
                let Found { start, stop, recover, .. } = self;
                Ok(Task::Decode(Wanted { file, folder, start, stop, recover }))
            }
        }
    }
}
