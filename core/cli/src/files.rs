//! Streams that are read and files that are written.

use crate::failure::Failure;
use quarc::error::Error;
use quarc::state::State;
use quarc::stream::Decoder;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::path::Path;

const PIECE_BYTES: usize = 1 << 16;

/// Print a text on standard output; nobody need read it to its end.
pub fn print(text: &str) -> Result<(), Failure> {
    match io::stdout().write_all(text.as_bytes()).and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::File(format!("standard output: {error}")))
        }
        _ => Ok(()),
    }
}

/// Whether a name is that of standard input.
pub fn is_standard_input(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Open a stream; `-` is standard input.
pub fn open(path: &Path) -> Result<Box<dyn Read>, Failure> {
    if is_standard_input(path) {
        return Ok(Box::new(io::stdin().lock()));
    }
    Ok(Box::new(open_file(path)?))
}

/// Open a stream that is read anywhere.
pub fn open_file(path: &Path) -> Result<File, Failure> {
    File::open(path).map_err(|error| Failure::file(path, &error))
}

/// Decode a stream from end to end as its bytes come, and show every state.
///
/// # Errors
/// What is wrong with the bytes or with what holds them, and whatever `show` says.
pub fn decode_all<E: From<Error>>(
    input: &mut dyn Read,
    decoder: &mut Decoder,
    mut show: impl FnMut(&State) -> Result<(), E>,
) -> Result<(), E> {
    let mut piece = vec![0; PIECE_BYTES];
    loop {
        let count = match input.read(&mut piece) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            read => read.map_err(|error| Error::Source(error.to_string()))?,
        };
        decoder.push(&piece[..count]);
        if count == 0 {
            decoder.finish();
        }
        while let Some(state) = decoder.pull()? {
            show(state)?;
        }
        if count == 0 {
            return Ok(());
        }
    }
}

/// Write a file beside its target, and give it its name once it is whole.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".part-{}", std::process::id()));
    let beside = path.with_file_name(name);
    let written = File::create(&beside)
        .and_then(|mut file| file.write_all(bytes))
        .and_then(|()| fs::rename(&beside, path));
    written.map_err(|error| {
        let _ = fs::remove_file(&beside); // the fault that is told came first
        Failure::file(path, &error)
    })
}
