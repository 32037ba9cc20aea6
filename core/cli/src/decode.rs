//! `quarc decode`: frames as PLY files.

use crate::failure::Failure;
use crate::files;
use crate::ply::build_ply;
use quarc::error::Error;
use quarc::recover::{Recovered, Recovery};
use quarc::seek::SeekDecoder;
use quarc::source::IoSource;
use quarc::state::State;
use quarc::stream::Decoder;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

/// Which frames are wanted, and where.
pub struct Wanted {
    /// The stream.
    pub file: PathBuf,
    /// What the frames are written to.
    pub folder: PathBuf,
    /// Ordinal of the first frame.
    pub start: u32,
    /// Ordinal after the last.
    pub stop: Option<u32>,
    /// Whether to go on past damage.
    pub recover: bool,
}

/// Why no further frame is decoded.
enum End {
    /// All that are wanted have been.
    Stopped,
    Failed(Failure),
    Stream(Error),
}

impl From<Error> for End {
    fn from(error: Error) -> Self {
        End::Stream(error)
    }
}

/// Write the frames that are wanted.
pub fn decode(wanted: &Wanted) -> Result<(), Failure> {
    fs::create_dir_all(&wanted.folder).map_err(|error| Failure::file(&wanted.folder, &error))?;
    let ended = if wanted.recover {
        recover(files::open_file(&wanted.file)?, wanted)
    } else if wanted.start > 0 {
        seek(files::open_file(&wanted.file)?, wanted)
    } else {
        let show = |state: &State| write_frame(state, wanted);
        files::decode_all(&mut files::open(&wanted.file)?, &mut Decoder::new(), show)
    };
    match ended {
        Ok(()) | Err(End::Stopped) => Ok(()),
        Err(End::Failed(failure)) => Err(failure),
        Err(End::Stream(error)) => Err(Failure::Stream(name(&wanted.file), error)),
    }
}

fn seek(file: File, wanted: &Wanted) -> Result<(), End> {
    let mut decoder = SeekDecoder::new(IoSource(file), wanted.start)?;
    while let Some(state) = decoder.pull()? {
        write_frame(state, wanted)?;
    }
    Ok(())
}

fn recover(file: File, wanted: &Wanted) -> Result<(), End> {
    let mut recovery = Recovery::new(IoSource(file))?;
    while let Some(found) = recovery.pull()? {
        match found {
            Recovered::Frame(state) => write_frame(state, wanted)?,
            Recovered::Gap(gap) => {
                let lost = gap.frames_lost.map_or_else(|| "no known number".into(), count_text);
                let (file, bytes) = (name(&wanted.file), gap.bytes);
                let line = format!(
                    "quarc: {file}: {} ({bytes} bytes left out, {lost} of frames lost)\n",
                    gap.message
                );
                let _ = std::io::stderr().write_all(line.as_bytes()); // nobody need listen
            }
        }
    }
    Ok(())
}

fn count_text(count: u64) -> String {
    format!("a number of {count}")
}

fn write_frame(state: &State, wanted: &Wanted) -> Result<(), End> {
    let frame = state.frame_ordinal();
    if wanted.stop.map_or(false, |stop| frame >= stop) {
        return Err(End::Stopped);
    }
    if frame >= wanted.start {
        let path = wanted.folder.join(format!("frame-{frame:08}.ply"));
        files::write_whole(&path, &build_ply(state)).map_err(End::Failed)?;
    }
    if wanted.stop.map_or(false, |stop| frame + 1 >= stop) {
        return Err(End::Stopped);
    }
    Ok(())
}

fn name(path: &Path) -> String {
    path.display().to_string()
}
