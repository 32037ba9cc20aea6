//! The command `quarc`: verifies, describes and decodes `.quarc` streams.

#![forbid(unsafe_code)]

mod arguments;
mod conformance;
mod decode;
mod failure;
mod files;
mod info;
mod pipe;
mod ply;
mod verify;

use arguments::Task;
use failure::Failure;
use std::io::Write;
use std::process::ExitCode;

fn main() -> ExitCode {
    match arguments::parse(std::env::args_os()).and_then(run) {
        Ok(code) => code,
        Err(failure) => {
            // If standard error is closed, the message is lost.
            let _ = writeln!(std::io::stderr(), "quarc: {failure}");
            failure.code()
        }
    }
}

fn run(task: Task) -> Result<ExitCode, Failure> {
    match task {
        Task::Help => files::print(arguments::USAGE)?,
        Task::Version => files::print(concat!("quarc ", env!("CARGO_PKG_VERSION"), "\n"))?,
        Task::Verify { file } => verify::verify(&file)?,
        Task::Info { file, json } => info::info(&file, json)?,
        Task::Decode(wanted) => return decode::decode(&wanted),
        Task::Conformance(ask) => return conformance::answer(ask),
    }
    Ok(ExitCode::SUCCESS)
}
