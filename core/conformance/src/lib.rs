//! The decoder side of conformance/RUNNER.md for the core.
//!
//! The command and the WebAssembly module both use this crate, so that one suite tests both.

#![forbid(unsafe_code)]

mod given;
mod jobs;
mod lines;
mod units;

use lines::{Lines, Numbers};
use serde_json::json;
use std::io::{self, BufRead, Read, Write};

/// The result of answering; errors of input or output end the session.
type Said<T> = io::Result<T>;

/// Answer with the frames of a stream, as its bytes arrive. Returns the exit status.
///
/// # Errors
/// Errors of `output`.
pub fn answer_stream(input: &mut dyn Read, output: impl Write) -> io::Result<u8> {
    Lines::new(output).stream(input, Numbers::None)
}

/// Do jobs until the requests end.
///
/// # Errors
/// Errors of `requests` and `output`, and malformed jobs.
pub fn answer_jobs(requests: &mut impl BufRead, output: impl Write) -> io::Result<()> {
    jobs::answer(requests, &mut Lines::new(output))
}

/// Do one job: its request, and its stream, if any.
///
/// # Errors
/// Errors of `output`, and a malformed job.
pub fn answer_job(request: &[u8], stream: &[u8], output: impl Write) -> io::Result<()> {
    let job = serde_json::from_slice(request)?;
    jobs::answer_job(&job, stream, &mut Lines::new(output))
}

/// List what the decoder supports.
///
/// # Errors
/// Errors of `output`.
pub fn answer_capabilities(output: impl Write) -> io::Result<()> {
    Lines::new(output).say(&json!({
        "capabilities": [
            "jobs", "seek", "recover", "grow", "numbers", "metadata", "updates", "snapshots"
        ],
        "levels": [10, 20, 30, 31],
        "units": units::names(),
    }))
}
