//! Reading of streams and writing of files.

use crate::failure::Failure;
use crate::pipe::Pipe;
use quarc::source::{IoSource, Source};
use std::fs::{self, File, OpenOptions};
use std::io::{self, Read, Write};
use std::path::Path;

/// Print text on standard output; a reader may close it early.
pub fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().write_all(text.as_bytes()).and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::File(format!("standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Whether a path means a file, which has random access, and not standard input or a pipe.
pub fn is_file(path: &Path) -> bool {
    !is_standard_input(path) && path.is_file()
}

fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Open a stream; `-` is standard input.
pub fn open(path: &Path) -> Result<Box<dyn Read>, Failure> {
    if is_standard_input(path) {
        return Ok(Box::new(io::stdin().lock()));
    }
    Ok(Box::new(open_file(path)?))
}

/// Open a stream to be read at offsets; in standard input and pipes, they must ascend.
pub fn open_source(path: &Path) -> Result<Box<dyn Source>, Failure> {
    if is_file(path) {
        return Ok(Box::new(IoSource(open_file(path)?)));
    }
    Ok(Box::new(Pipe::new(open(path)?)))
}

fn open_file(path: &Path) -> Result<File, Failure> {
    File::open(path).map_err(|error| Failure::file(path, &error))
}

/// Write a file under a temporary name beside its target, and rename it when complete.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".part-{}", std::process::id()));
    let beside = path.with_file_name(name);
    let _ = fs::remove_file(&beside); // left by a process that was killed
    let written = OpenOptions::new()
        .write(true)
        .create_new(true) // a symbolic link is not followed
        .open(&beside)
        .and_then(|mut file| file.write_all(bytes))
        .and_then(|()| fs::rename(&beside, path));
    written.map_err(|error| {
        let _ = fs::remove_file(&beside); // report the first error
        Failure::file(path, &error)
    })
}
