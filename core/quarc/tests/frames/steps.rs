//! Steps of a frame in the wrong order, and cloned states.

use crate::streams::{chunks, vectors, Frames};
use quarc::coding::canonical::{blank, write_canonical};
use quarc::coding::grid::Grid;
use quarc::coding::snapshot::write_snapshot;
use quarc::error::{Error, Reject};
use quarc::records::{Births, CanonicalChunk, Gaussians, Header, SnapshotChunk, Updates};
use quarc::rows::Rows;
use quarc::state::{choose_deaths, State};
use std::sync::Arc;

/// The states of all frames of a stream of the suite.
fn states(name: &str) -> Vec<State> {
    let (_, stream, _) = vectors(name).remove(0);
    let mut frames = Frames::default();
    let mut states = Vec::new();
    for (kind, payload) in chunks(&stream) {
        states.extend(frames.push(kind, payload).expect("a valid stream").cloned());
    }
    states
}

#[test]
fn a_cloned_state_does_not_change() {
    for name in ["streams/births-and-deaths", "streams/updates-leaving", "streams/journey"] {
        let (_, _, vector) = vectors(name).remove(0);
        let due = vector.get("decode").get("frames").list();
        let states = states(name);
        assert_eq!(states.len(), due.len());
        for (state, due) in states.iter().zip(due) {
            assert_eq!(state.digest(), due.list()[2].text(), "{name}");
        }
    }
}

#[test]
fn steps_in_the_wrong_order_are_rejected() {
    let refused = |result: Result<(), Error>| matches!(result, Err(Error::Encode(_)));
    let begun = states("streams/still").remove(0);
    let mut state = begun.clone();
    assert!(refused(state.move_by(&[])), "there are no anchors");
    assert!(refused(state.write_motion(&[], true).map(|_| ())));
    assert!(refused(state.update(&Updates::default())), "the stream has no updates");
    state.begin_frame(0).expect("a frame may follow");
    assert!(refused(state.move_by(&[])), "there are more levels");
    assert!(refused(state.write_motion(&[], true).map(|_| ())));
    let newborn = blank(state.header().code_planes(), 1);
    let births = Births { parents: vec![0], newborn };
    assert!(refused(state.bear(&Births { parents: vec![0, 0], ..births.clone() })));
    let short = Gaussians { codes: Vec::new(), ..births.newborn.clone() };
    assert!(refused(state.bear(&Births { newborn: short, ..births.clone() })));
    assert!(refused(state.bear(&births)), "the Gaussians have not been moved");
    assert!(refused(state.begin_frame(0)), "the frame has only begun");
    let levels = state.anchors().expect("begun").levels();
    let still: Vec<_> = levels.iter().map(|level| vec![[0; 8]; level.ids.len()]).collect();
    let mut wild = still.clone();
    wild[0][0][0] = i16::MAX;
    assert!(refused(state.move_by(&wild)), "a sum of such symbols could overflow");
    state.move_by(&still).expect("no anchor moves");
    state.bear(&births).expect("a newborn");
    assert_eq!((state.count(), state.next_id()), (begun.count() + 1, begun.count() as u64 + 1));
    assert!(refused(state.move_by(&[])), "a newborn is not bound");
    assert_eq!(begun.digest(), states("streams/still")[0].digest(), "a clone is independent");
}

#[test]
fn gaussians_with_the_wrong_number_of_codes_are_not_written() {
    let grid = Grid { origin: [0; 3], axis_bits: 0 };
    let header = Arc::new(Header::default()); // SH degree 1
    let state = State::begin(&header, 0, &blank(16, 2)).expect("a state");
    for planes in [0, 6, 7, 8, 15, 16, 17] {
        let written = write_canonical(&blank(planes, 2), grid);
        assert_eq!(written.is_ok(), planes == 7 || planes == 16, "{planes} planes");
        let births = Births { parents: vec![0], newborn: blank(planes, 1) };
        assert_eq!(state.write_births(&births).is_ok(), planes == 16, "{planes} planes");
    }
}

#[test]
fn chunks_that_no_parser_returns_are_rejected() {
    let header = Arc::new(Header { snapshots: true, ..Header::default() });
    let mut canonical = blank(header.code_planes(), 1);
    let chunk = CanonicalChunk {
        frame: 0,
        gaussian_count: 1,
        origin: [0; 3],
        axis_bits: u8::MAX,
        sections: Default::default(),
        state_crc: 0,
    };
    let found = State::canonical(&header, &chunk).err().and_then(|error| error.reject());
    assert_eq!(found, Some(Reject::Field));

    let mut later = canonical.clone();
    later.codes[3][0] = 1;
    let coded = write_snapshot(&canonical, &later, &[0]).expect("a snapshot");
    let snapshot = SnapshotChunk {
        frame: 1,
        canonical: 0,
        newborn_count: 0,
        origin: [0; 3],
        axis_bits: 0,
        survivors: coded.survivors,
        sections: coded.sections,
        state_crc: 0,
    };
    canonical.codes[3][0] = i32::MAX; // a sum would overflow
    let decoded = State::snapshot(&header, &snapshot, &canonical);
    assert!(matches!(decoded, Err(Error::Encode(_))));
}

#[test]
fn no_more_gaussians_die_than_there_are() {
    assert_eq!(choose_deaths(&[], 1), []);
    assert_eq!(choose_deaths(&[3, 2], u32::MAX), [0, 1]);
}

#[test]
fn a_header_out_of_range_begins_no_state() {
    let whole = Header::default();
    let gaussians = blank(whole.code_planes(), 2);
    assert!(State::begin(&Arc::new(whole.clone()), 0, &gaussians).is_ok());
    for header in [
        Header { level: 5, ..whole.clone() },
        Header { resample_interval: 0, ..whole.clone() },
        Header { anchor_ratio: 0, ..whole.clone() },
        Header { sh_dc_step: f32::NAN, ..whole },
    ] {
        let begun = State::begin(&Arc::new(header), 0, &gaussians);
        assert!(matches!(begun, Err(Error::Encode(_))));
    }
}

#[test]
fn columns_are_removed_in_place_or_in_a_copy() {
    let mut rows = Rows::zeros(2, 7, 3);
    for row in 0..2 {
        for column in 0..7 {
            rows.row_mut(row)[column] = (10 * row + column) as i32;
        }
    }
    for gone in [vec![], vec![0], vec![6], vec![0, 1, 4, 6], (0..7).collect()] {
        let left: Vec<i32> = (0..7).filter(|column| !gone.contains(&(*column as u32))).collect();
        let mut others = Rows::zeros(1, 9, 0);
        rows.copy_without(&gone, &mut others);
        let mut same = rows.clone();
        same.remove(&gone);
        assert_eq!((others.columns(), others.stride()), (left.len(), rows.stride()));
        for row in 0..2 {
            let due: Vec<i32> = left.iter().map(|column| 10 * row as i32 + column).collect();
            assert_eq!((others.row(row), same.row(row)), (&due[..], &due[..]));
        }
    }
}
