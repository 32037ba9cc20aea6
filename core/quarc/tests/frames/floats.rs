//! Dequantized floats, against the digests of the suite.

use crate::known::{read_json, Json};
use crate::streams::{chunks, vectors, Frames};
use quarc::coding::canonical::blank;
use quarc::floats::{Dequantizer, Redone, Splats};
use quarc::records::Header;
use quarc::state::State;
use sha2::{Digest, Sha256};
use std::sync::Arc;

/// The SHA-256 of the floats in the order of the serialization: plane after plane.
fn digest_of(splats: &Splats) -> String {
    let count = splats.opacities.len();
    let mut digest = Sha256::new();
    let arrays =
        [&splats.positions, &splats.rotations, &splats.log_scales, &splats.opacities, &splats.sh];
    for array in arrays {
        let width = array.len() / count;
        for row in 0..width {
            for number in array.iter().skip(row).step_by(width) {
                digest.update(number.to_le_bytes());
            }
        }
    }
    digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
fn floats_match_the_suite() {
    let mut checked = 0;
    for (name, stream, vector) in vectors("streams/").into_iter().chain(vectors("traps/")) {
        let due = match vector.find("numbers") {
            Some(due) => due.list(),
            None => continue,
        };
        let (mut frames, mut dequantizer) = (Frames::default(), Dequantizer::default());
        let mut found = Vec::new();
        for (kind, payload) in chunks(&stream) {
            if let Some(state) = frames.push(kind, payload).expect("a valid stream") {
                found.push((state.frame_ordinal(), digest_of(dequantizer.dequantize(state))));
            }
        }
        for pair in due.iter().map(Json::list) {
            let (frame, digest) = (pair[0].number() as u32, pair[1].text().to_string());
            assert!(found.contains(&(frame, digest)), "{name}, frame {frame}");
            checked += 1;
        }
    }
    assert!(checked > 300, "{checked} frames");
}

/// A state of one canonical frame of the suite.
fn some_state() -> State {
    let (_, stream, _) = vectors("streams/still").remove(0);
    let mut frames = Frames::default();
    let states = chunks(&stream)
        .into_iter()
        .filter_map(|(kind, payload)| frames.push(kind, payload).expect("a valid stream").cloned());
    states.last().expect("a frame")
}

#[test]
fn unchanged_arrays_are_not_computed_again() {
    let mut state = some_state();
    let mut dequantizer = Dequantizer::default();
    let redone = |all| Redone { positions: all, rotations: all, codes: all };
    assert_eq!(dequantizer.update(&state), redone(true));
    assert_eq!(dequantizer.update(&state.clone()), redone(false));
    state.begin_frame(1).expect("one of several dies");
    assert_eq!(dequantizer.update(&state), redone(true));
    assert_eq!(dequantizer.splats().opacities.len(), state.count());
}

#[test]
fn a_code_times_a_step_is_rounded_once() {
    let file = read_json("unit/dequantize.json");
    let (header, gaussian) = (some_state().header().clone(), blank(16, 1));
    for case in file.get("cases").list() {
        let bits = |json: &Json| u32::from_str_radix(json.text(), 16).expect("hexadecimal");
        let opacity_step = f32::from_bits(bits(case.get("input").get("step")));
        let header = Arc::new(Header { opacity_step, ..(*header).clone() });
        let mut gaussian = gaussian.clone();
        gaussian.codes[3] = vec![case.get("input").get("code").number() as i32];
        let state = State::begin(&header, 0, &gaussian).expect("a state");
        let mut dequantizer = Dequantizer::default();
        let opacity = dequantizer.dequantize(&state).opacities[0];
        assert_eq!(opacity.to_bits(), bits(case.get("output")), "{case:?}");
    }
}
