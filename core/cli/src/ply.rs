//! A frame as the PLY file of 3DGS, which every splat viewer opens: SPEC Annex C.1.

use crate::numbers;
use quarc::state::State;

/// Rows of a frame's numbers, in the order of their serialization (SPEC 9.1): where each begins.
const POSITION: usize = 0;
const ROTATION: usize = 3;
const LOG_SCALES: usize = 7;
const OPACITY: usize = 10;
const SH_DC: usize = 11;
const SH_REST: usize = 14;

/// The bytes of a binary little-endian PLY. Coordinates stay those of the stream.
pub fn build_ply(state: &State) -> Vec<u8> {
    let numbers = numbers::rows(state);
    let columns = columns(numbers.len() > SH_REST);
    let mut file =
        format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", state.count());
    for (name, _) in &columns {
        file.push_str(&format!("property float {name}\n"));
    }
    file.push_str("end_header\n");
    let mut file = file.into_bytes();
    file.reserve(4 * columns.len() * state.count());
    let zeros = vec![0.0; state.count()];
    let rows: Vec<&[f32]> =
        columns.iter().map(|(_, row)| row.map_or(&zeros[..], |row| &numbers[row])).collect();
    for gaussian in 0..state.count() {
        for row in &rows {
            file.extend_from_slice(&row[gaussian].to_le_bytes());
        }
    }
    file
}

/// The properties in their order, and the row of each; normals have none, and are 0.
fn columns(has_rest: bool) -> Vec<(String, Option<usize>)> {
    let mut columns = Vec::new();
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        columns.push((name.to_owned(), Some(POSITION + axis)));
    }
    columns.extend(["nx", "ny", "nz"].map(|name| (name.to_owned(), None)));
    columns.extend((0..3).map(|color| (format!("f_dc_{color}"), Some(SH_DC + color))));
    if has_rest {
        // All of red first, where a state has the colors of a coefficient together.
        columns
            .extend((0..9).map(|i| (format!("f_rest_{i}"), Some(SH_REST + 3 * (i % 3) + i / 3))));
    }
    columns.push(("opacity".to_owned(), Some(OPACITY)));
    columns.extend((0..3).map(|axis| (format!("scale_{axis}"), Some(LOG_SCALES + axis))));
    columns.extend((0..4).map(|part| (format!("rot_{part}"), Some(ROTATION + part))));
    columns
}
