//! `quarc decode`: write frames as PLY files.

use crate::failure::Failure;
use crate::files;
use crate::ply::build_ply;
use quarc::error::Error;
use quarc::floats::Dequantizer;
use quarc::recover::{Gap, Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::source::Source;
use quarc::state::State;
use quarc::stream::{decode_all, Decoder};
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The frames to decode, and the folder to write them to.
pub struct Wanted {
    /// The stream.
    pub file: PathBuf,
    /// The output folder.
    pub folder: PathBuf,
    /// Ordinal of the first frame.
    pub start: u32,
    /// Ordinal after the last frame.
    pub stop: Option<u32>,
    /// Whether to continue after damage.
    pub recover: bool,
}

/// Why decoding ends.
enum End {
    /// All requested frames are decoded.
    Stopped,
    Failed(Failure),
    Stream(Error),
}

impl From<Error> for End {
    fn from(error: Error) -> Self {
        End::Stream(error)
    }
}

/// Totals of what has been written.
#[derive(Default)]
struct Written {
    frames: u64,
    gaps: u64,
    numbers: Dequantizer,
}

/// Write the requested frames; the exit status is 1 if some are missing. The folder is made when
/// the first frame is written, so that a stream without frames leaves none behind.
pub fn decode(wanted: &Wanted) -> Result<ExitCode, Failure> {
    if wanted.folder.exists() && !wanted.folder.is_dir() {
        return Err(Failure::File(format!("{}: this is not a folder", name(&wanted.folder))));
    }
    let mut written = Written::default();
    let ended = if wanted.recover {
        recover(files::open_source(&wanted.file)?, wanted, &mut written)
    } else if wanted.start > 0 && files::is_file(&wanted.file) {
        seek(files::open_source(&wanted.file)?, wanted, &mut written)
    } else {
        let show = |state: &State| write_frame(state, wanted, &mut written);
        decode_all(&mut files::open(&wanted.file)?, &mut Decoder::new(), show)
    };
    match ended {
        Ok(()) | Err(End::Stopped) => {}
        Err(End::Failed(failure)) => return Err(failure),
        Err(End::Stream(error)) => return Err(Failure::Stream(name(&wanted.file), error)),
    }
    if written.gaps > 0 {
        return Ok(ExitCode::FAILURE);
    }
    if written.frames == 0 {
        let message =
            format!("{}: the stream has none of the requested frames", name(&wanted.file));
        return Err(Failure::File(message));
    }
    Ok(ExitCode::SUCCESS)
}

fn seek(stream: Box<dyn Source>, wanted: &Wanted, written: &mut Written) -> Result<(), End> {
    let mut decoder = SeekDecoder::new(stream, wanted.start)?;
    while let Some(state) = decoder.pull()? {
        write_frame(state, wanted, written)?;
    }
    Ok(())
}

fn recover(stream: Box<dyn Source>, wanted: &Wanted, written: &mut Written) -> Result<(), End> {
    let mut recovery = Recovery::new(stream)?;
    while let Some(found) = recovery.pull()? {
        match found {
            Recovered::Frame(state) => write_frame(state, wanted, written)?,
            Recovered::Gap(gap) => {
                written.gaps += 1;
                tell(&gap);
            }
        }
    }
    Ok(())
}

/// Report a gap on standard error; a closed standard error is ignored.
fn tell(gap: &Gap) {
    let Gap { offset, bytes, message, .. } = gap;
    let lost = gap.frames_lost.map_or_else(|| "unknown".to_owned(), |lost| lost.to_string());
    let line = format!("gap at byte {offset}, {bytes} bytes, frames lost: {lost}; {message}");
    let _ = writeln!(io::stderr(), "quarc: {line}");
}

fn write_frame(state: &State, wanted: &Wanted, written: &mut Written) -> Result<(), End> {
    let frame = state.frame_ordinal();
    let is_before_stop = |frame: u32| wanted.stop.map_or(true, |stop| frame < stop);
    if frame >= wanted.start && is_before_stop(frame) {
        if written.frames == 0 {
            let made = fs::create_dir_all(&wanted.folder);
            made.map_err(|error| End::Failed(Failure::file(&wanted.folder, &error)))?;
        }
        let path = wanted.folder.join(format!("frame-{frame:08}.ply"));
        let splats = written.numbers.dequantize(state);
        files::write_whole(&path, &build_ply(splats)).map_err(End::Failed)?;
        written.frames += 1;
    }
    if is_before_stop(frame.saturating_add(1)) {
        return Ok(());
    }
    Err(End::Stopped)
}

fn name(path: &Path) -> String {
    path.display().to_string()
}
