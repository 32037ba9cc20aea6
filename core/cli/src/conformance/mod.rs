//! `quarc conformance`: what conformance/RUNNER.md asks of a decoder.

mod given;
mod jobs;
mod lines;
mod units;

use crate::failure::Failure;
use lines::{Lines, Numbers};
use serde_json::json;
use std::io::{self, Write};
use std::process::ExitCode;

/// What is asked.
#[derive(Clone, Copy, Default)]
pub enum Ask {
    /// To decode the stream on standard input.
    #[default]
    Stream,
    /// To do jobs.
    Jobs,
    /// To say what can be asked.
    Capabilities,
}

/// Answer on standard output; returns the exit status.
pub fn answer(ask: Ask) -> Result<ExitCode, Failure> {
    let mut lines = Lines::new(io::stdout().lock());
    let answered = match ask {
        Ask::Stream => lines.stream(&mut io::stdin().lock(), Numbers::None),
        Ask::Jobs => jobs::answer(&mut io::stdin().lock(), &mut lines).map(|()| 0),
        Ask::Capabilities => lines.say(&capabilities()).map(|()| 0),
    };
    answered.map(ExitCode::from).map_err(|error| Failure::File(error.to_string()))
}

fn capabilities() -> serde_json::Value {
    json!({
        "capabilities": [
            "jobs", "seek", "recover", "grow", "numbers", "metadata", "updates", "snapshots"
        ],
        "levels": [10, 20, 30, 31],
        "units": units::names(),
    })
}

/// What cannot be written or read ends the conversation.
type Said<T> = io::Result<T>;

/// Write a line at once: who feeds the stream may wait for it.
fn write_line(output: &mut impl Write, line: &serde_json::Value) -> Said<()> {
    let mut text = line.to_string();
    text.push('\n');
    output.write_all(text.as_bytes())?;
    output.flush()
}
