//! `quarc verify`: decode a whole stream.

use crate::failure::Failure;
use crate::files;
use quarc::stream::{decode_all, Decoder};
use std::path::Path;

/// Decode a stream, check all its CRCs and totals, and print a summary.
pub fn verify(path: &Path) -> Result<(), Failure> {
    let mut input = files::open(path)?;
    let name = path.display().to_string();
    let mut decoder = Decoder::new();
    let mut frames = 0_u64;
    decode_all(&mut input, &mut decoder, |_| {
        frames += 1;
        Ok(())
    })
    .map_err(|error| Failure::Stream(name.clone(), error))?;
    let digest = decoder.state().map_or_else(|| "none".to_owned(), quarc::state::State::digest);
    let frames_word = if frames == 1 { "frame" } else { "frames" };
    files::print(&format!("{name}: {frames} {frames_word}, last state {digest}\n"))
}
