//! Failures of the command: a message and an exit status.

use std::fmt;
use std::io;
use std::path::Path;
use std::process::ExitCode;

/// Why the command fails.
#[derive(Debug)]
pub enum Failure {
    /// The arguments are invalid.
    Usage(String),
    /// A file cannot be read or written.
    File(String),
    /// A stream is rejected or declined; the first field is the name of its file.
    Stream(String, quarc::error::Error),
}

impl Failure {
    /// An I/O error of a file.
    pub fn file(path: &Path, error: &io::Error) -> Self {
        Failure::File(format!("{}: {error}", path.display()))
    }

    /// 1 if a stream is rejected, 3 if it is declined, otherwise 2.
    pub fn code(&self) -> ExitCode {
        use quarc::error::Error;
        ExitCode::from(match self {
            Failure::Stream(_, Error::Rejected { .. }) => 1,
            Failure::Stream(_, Error::Limit(_)) => 3,
            _ => 2,
        })
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Failure::Usage(message) => write!(f, "{message}; see `quarc --help`"),
            Failure::File(message) => f.write_str(message),
            Failure::Stream(name, error) => write!(f, "{name}: {error}"),
        }
    }
}
