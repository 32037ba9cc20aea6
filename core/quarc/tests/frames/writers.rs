//! Decoded frames are encoded again: to the same sections if the same encoder wrote them.

use crate::known::{read_json, suite_file, Json};
use crate::streams::{chunks, vectors};
use quarc::chunks::{CANO, FRAM, HEAD, SNAP};
use quarc::coding::canonical::{blank, sort, write_canonical};
use quarc::coding::grid::Grid;
use quarc::coding::snapshot::{read_snapshot, write_snapshot, CodedSnapshot};
use quarc::error::{Error, Result};
use quarc::records::{CanonicalChunk, FrameChunk, Gaussians, SnapshotChunk};
use quarc::state::State;
use quarc::wire::{parse_canonical, parse_frame, parse_header, parse_snapshot};
use std::sync::Arc;

/// Encode the content of a CANO chunk again.
fn rewrite_canonical(chunk: &CanonicalChunk, gaussians: &Gaussians) -> Result<CanonicalChunk> {
    let grid = Grid { origin: chunk.origin, axis_bits: chunk.axis_bits };
    let (least, sorted) = sort(gaussians)?;
    if grid == least {
        assert_eq!(&sorted, gaussians, "Gaussians are sorted");
    }
    Ok(CanonicalChunk { sections: write_canonical(gaussians, grid)?, ..chunk.clone() })
}

/// Encode the content of a SNAP chunk again.
fn rewrite_snapshot(chunk: &SnapshotChunk, canonical: &Gaussians) -> Result<SnapshotChunk> {
    let (gaussians, canonical_indices) = read_snapshot(chunk, canonical, |_| Ok(()))?;
    let written = write_snapshot(canonical, &gaussians, &canonical_indices)?;
    assert_eq!(written.gaussians, gaussians, "Gaussians are sorted");
    let CodedSnapshot { newborn_count, grid, survivors, sections, .. } = written;
    let Grid { origin, axis_bits } = grid;
    Ok(SnapshotChunk { newborn_count, origin, axis_bits, survivors, sections, ..chunk.clone() })
}

/// Encode the content of a FRAM chunk again, step by step; the state becomes that of the frame.
fn rewrite_frame(state: &mut State, chunk: &FrameChunk) -> Result<FrameChunk> {
    let previous = chunk.previous_contexts;
    state.begin_frame(chunk.death_count)?;
    let mut twin = state.clone();
    let symbols = state.read_motion(&chunk.motion, previous)?;
    let motion = twin.write_motion(&symbols, previous)?;
    assert_eq!(twin.read_motion(&motion, previous)?, symbols);
    state.move_by(&symbols)?;
    let mut updates = None;
    if let Some(section) = &chunk.updates {
        let mut twin = state.clone();
        let known = state.read_updates(section)?;
        let written = twin.write_updates(&known)?;
        assert_eq!(twin.read_updates(&written)?, known);
        state.update(&known)?;
        updates = Some(written);
    }
    let mut twin = state.clone();
    let known = state.read_births(&chunk.births, chunk.birth_count)?;
    let births = twin.write_births(&known)?;
    assert_eq!(twin.read_births(&births, chunk.birth_count)?, known);
    state.bear(&known)?;
    state.prove(chunk.state_crc)?;
    Ok(FrameChunk { motion, updates, births, ..chunk.clone() })
}

/// Encode all frames of a stream again; returns how many are identical, and how many there are.
fn rewrite(stream: &[u8]) -> Result<(usize, usize)> {
    let (mut header, mut state) = (None, None);
    let mut canonical = Gaussians::default();
    let (mut same, mut all) = (0, 0);
    for (kind, payload) in chunks(stream) {
        let header = header.get_or_insert_with(|| Arc::new(parse_header(payload).expect("HEAD")));
        let is_same = match kind {
            CANO => {
                let chunk = parse_canonical(payload)?;
                let (begun, gaussians) = State::canonical(header, &chunk)?;
                let written = rewrite_canonical(&chunk, &gaussians)?;
                assert_eq!(State::canonical(header, &written)?.1, gaussians);
                (state, canonical) = (Some(begun), gaussians);
                written == chunk
            }
            SNAP => {
                let chunk = parse_snapshot(payload)?;
                let written = rewrite_snapshot(&chunk, &canonical)?;
                state = Some(State::snapshot(header, &written, &canonical)?.0);
                written == chunk
            }
            FRAM => {
                let chunk = parse_frame(payload, header.updates)?;
                rewrite_frame(state.as_mut().expect("a canonical frame"), &chunk)? == chunk
            }
            _ => continue,
        };
        same += usize::from(is_same);
        all += 1;
    }
    Ok((same, all))
}

#[test]
fn streams_of_the_reference_encoder_are_reproduced_exactly() {
    for name in ["full", "updated_full", "snapshot_full", "cut_in_two", "births", "deaths"] {
        let path = suite_file(&format!("../tests/hostile/seeds/streams/{name}.quarc"));
        let stream = std::fs::read(path).expect("a stream of the package's tests");
        let (same, all) = rewrite(&stream).expect("a valid stream");
        assert!(same == all && all > 0, "{name}: {same} of {all} frames");
    }
}

#[test]
fn streams_of_other_encoders_decode_the_same_after_rewriting() {
    let manifest = read_json("manifest.json");
    let is_valid = |vector: &&Json| {
        let name = vector.get("name").text();
        name.starts_with("streams/") || name.starts_with("traps/")
    };
    let mut rewritten = 0;
    for vector in manifest.get("vectors").list().iter().filter(is_valid) {
        let stream = std::fs::read(suite_file(vector.get("file").text())).expect("a stream");
        match rewrite(&stream) {
            // This encoder does not support rotations and differences as large as streams may have.
            Err(Error::Encode(_)) => {}
            Ok((_, all)) => rewritten += all,
            Err(error) => panic!("{}: {error}", vector.get("name").text()),
        }
    }
    assert!(rewritten > 300, "{rewritten} frames");
}

#[test]
fn planes_of_different_lengths_and_wide_boxes_are_refused() {
    let (_, stream, _) = vectors("streams/snapshots-journey").remove(0);
    let (mut snapshot, mut head) = (None, None);
    for (kind, payload) in chunks(&stream) {
        match kind {
            HEAD => head = Some(Arc::new(parse_header(payload).expect("HEAD"))),
            SNAP => snapshot = Some(parse_snapshot(payload).expect("a snapshot")),
            _ => {}
        }
    }
    let (head, snapshot) = (head.expect("HEAD"), snapshot.expect("a snapshot"));
    let even = blank(head.code_planes(), 12);
    let mut short = even.clone();
    short.codes[5].pop();
    let is_refused = |error: Option<Error>| matches!(error, Some(Error::Encode(_)));
    assert!(is_refused(sort(&short).err()));
    assert!(is_refused(write_snapshot(&short, &even, &[0; 12]).err()));
    assert!(is_refused(State::snapshot(&head, &snapshot, &short).err()));
    let wide = Grid { origin: [0; 3], axis_bits: 64 };
    assert!(is_refused(write_canonical(&even, wide).err()));
}
