//! `quarc conformance`: what conformance/RUNNER.md asks of a decoder.

use crate::failure::Failure;
use quarc_conformance::{answer_capabilities, answer_jobs, answer_stream};
use std::io;
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
    let (mut input, output) = (io::stdin().lock(), io::stdout().lock());
    let answered = match ask {
        Ask::Stream => answer_stream(&mut input, output),
        Ask::Jobs => answer_jobs(&mut input, output).map(|()| 0),
        Ask::Capabilities => answer_capabilities(output).map(|()| 0),
    };
    answered.map(ExitCode::from).map_err(|error| Failure::File(error.to_string()))
}
