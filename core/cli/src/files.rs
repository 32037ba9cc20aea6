//! Reading of streams and writing of files.

use crate::failure::Failure;
use quarc::source::IoSource;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Cursor, Read, Seek, Write};
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

/// A stream with random access.
pub type Seekable = IoSource<Box<dyn ReadSeek>>;

/// What can be read at any offset.
pub trait ReadSeek: Read + Seek {}

impl<T: Read + Seek> ReadSeek for T {}

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

/// Open a stream with random access; standard input and pipes are read into memory.
pub fn open_seekable(path: &Path) -> Result<Seekable, Failure> {
    if is_file(path) {
        return Ok(IoSource(Box::new(open_file(path)?)));
    }
    let mut stream = Vec::new();
    let read = open(path)?.read_to_end(&mut stream);
    read.map_err(|error| Failure::file(path, &error))?;
    Ok(IoSource(Box::new(Cursor::new(stream))))
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
