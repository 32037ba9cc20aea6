//! What conformance/RUNNER.md asks of a decoder, answered by the core.
//!
//! The command and the module for the web both answer by this crate, so that one suite tests
//! both.

#![forbid(unsafe_code)]

mod given;
mod jobs;
mod lines;
mod units;

use lines::{Lines, Numbers};
use serde_json::json;
use std::io::{self, BufRead, Read, Write};

/// What cannot be written or read ends the conversation.
type Said<T> = io::Result<T>;

/// Answer with the frames of a stream, as its bytes come. Returns the exit status.
///
/// # Errors
/// What cannot be written.
pub fn answer_stream(input: &mut dyn Read, output: impl Write) -> io::Result<u8> {
    Lines::new(output).stream(input, Numbers::None)
}

/// Do jobs until there are no more.
///
/// # Errors
/// What cannot be read or written, and what is no job.
pub fn answer_jobs(requests: &mut impl BufRead, output: impl Write) -> io::Result<()> {
    jobs::answer(requests, &mut Lines::new(output))
}

/// Do one job: its line, and the stream that it is about, if any.
///
/// # Errors
/// What cannot be written, and what is no job.
pub fn answer_job(request: &[u8], stream: &[u8], output: impl Write) -> io::Result<()> {
    let job = serde_json::from_slice(request)?;
    jobs::answer_job(&job, stream, &mut Lines::new(output))
}

/// Say what can be asked.
///
/// # Errors
/// What cannot be written.
pub fn answer_capabilities(output: impl Write) -> io::Result<()> {
    Lines::new(output).say(&json!({
        "capabilities": [
            "jobs", "seek", "recover", "grow", "numbers", "metadata", "updates", "snapshots"
        ],
        "levels": [10, 20, 30, 31],
        "units": units::names(),
    }))
}
