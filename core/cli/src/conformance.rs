//! `quarc conformance`: the decoder side of conformance/RUNNER.md.

use crate::failure::Failure;
use quarc_conformance::{answer_capabilities, answer_jobs, answer_stream};
use std::io;
use std::process::ExitCode;

/// A request of the runner.
#[derive(Clone, Copy, Default)]
pub enum Ask {
    /// Decode the stream on standard input.
    #[default]
    Stream,
    /// Do the jobs on standard input.
    Jobs,
    /// List what the decoder supports.
    Capabilities,
}

/// Answer on standard output and return the exit status.
pub fn answer(ask: Ask) -> Result<ExitCode, Failure> {
    let (mut input, output) = (io::stdin().lock(), io::stdout().lock());
    let answered = match ask {
        Ask::Stream => answer_stream(&mut input, output),
        Ask::Jobs => answer_jobs(&mut input, output).map(|()| 0),
        Ask::Capabilities => answer_capabilities(output).map(|()| 0),
    };
    answered.map(ExitCode::from).map_err(|error| Failure::File(error.to_string()))
}
