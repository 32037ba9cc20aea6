//! Steps of a frame in the wrong order, and cloned states.

use crate::streams::{chunks, vectors, Frames};
use quarc::coding::canonical::blank;
use quarc::error::Error;
use quarc::records::{Births, Gaussians, Header, Updates};
use quarc::rows::Rows;
use quarc::state::State;
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
