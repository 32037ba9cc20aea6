//! The interface as C calls it: pointers, statuses and invalid calls.

mod numbers;

use numbers::Numbers;
use quarc::floats::Dequantizer;
use quarc::state::State;
use quarc::stream::Decoder;
use quarc_capi::*;
use std::ffi::{c_char, CStr};
use std::fs;
use std::mem::MaybeUninit;
use std::path::Path;
use std::ptr::{null, null_mut};
use std::slice::from_raw_parts;

fn read(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../conformance/streams");
    fs::read(folder.join(name).with_extension("quarc")).expect("the conformance suite")
}

/// The value that a function writes if its status is QUARC_OK, otherwise the status.
fn fill<T>(function: impl FnOnce(*mut T) -> i32) -> Result<T, i32> {
    let mut room = MaybeUninit::uninit();
    match function(room.as_mut_ptr()) {
        // SAFETY: the function has filled it.
        QUARC_OK | QUARC_FRAME => Ok(unsafe { room.assume_init() }),
        status => Err(status),
    }
}

unsafe fn text(place: *const c_char) -> Option<String> {
    (!place.is_null()).then(|| CStr::from_ptr(place).to_str().expect("UTF-8").to_owned())
}

/// Compare all memory behind the pointers with the state of the library.
unsafe fn compare(decoder: *mut DecoderHandle, view: &StateView, state: &State) {
    assert_eq!(view.frame, state.frame_ordinal());
    assert_eq!(view.phase, state.phase());
    assert_eq!(from_raw_parts(view.ids, view.count), state.ids());
    for row in 0..3 {
        let place = view.positions.add(row * view.positions_stride);
        assert_eq!(from_raw_parts(place, view.count), state.positions().row(row));
    }
    for row in 0..4 {
        let place = view.rotations.add(row * view.rotations_stride);
        assert_eq!(from_raw_parts(place, view.count), state.rotations().row(row));
    }
    assert_eq!(view.code_rows, state.codes().rows());
    for row in 0..view.code_rows {
        let place = view.codes.add(row * view.codes_stride);
        assert_eq!(from_raw_parts(place, view.count), state.codes().row(row));
    }
    let digits = fill(|room: *mut [c_char; QUARC_DIGEST_SIZE]| quarc_digest(decoder, room.cast()));
    assert_eq!(text(digits.expect("a digest").as_ptr()), Some(state.digest()));
}

unsafe fn compare_floats(splats: &SplatsView, state: &State) {
    let mut dequantizer = Dequantizer::default();
    let due = dequantizer.dequantize(state);
    let count = splats.count;
    assert_eq!(from_raw_parts(splats.positions, 3 * count), due.positions);
    assert_eq!(from_raw_parts(splats.rotations, 4 * count), due.rotations);
    assert_eq!(from_raw_parts(splats.log_scales, 3 * count), due.log_scales);
    assert_eq!(from_raw_parts(splats.opacities, count), due.opacities);
    assert_eq!(from_raw_parts(splats.sh, 3 * splats.sh_coefficients * count), due.sh);
}

#[test]
fn states_match_those_of_the_library() {
    for name in ["journey", "births-and-deaths", "snapshots-journey", "updates-journey"] {
        let (stream, mut library) = (read(name), Decoder::new());
        library.push(&stream);
        library.finish();
        let (mut decoder, mut frames) = (quarc_open(), 0);
        for piece in stream.chunks(100) {
            unsafe {
                assert_eq!(quarc_push(decoder, piece.as_ptr(), piece.len()), QUARC_OK);
                let mut view = MaybeUninit::uninit();
                while quarc_pull(decoder, view.as_mut_ptr()) == QUARC_FRAME {
                    let state = library.pull().expect("a stream").expect("a frame");
                    compare(decoder, view.assume_init_ref(), state);
                    let splats = fill(|room| quarc_dequantize(decoder, room)).expect("floats");
                    compare_floats(&splats, state);
                    let head = fill(|room| quarc_head(decoder, room)).expect("a head");
                    assert_eq!(head.timescale, state.header().timescale);
                    assert_eq!(head.sh_degree, u32::from(state.header().sh_degree));
                    frames += 1;
                }
            }
        }
        assert!(frames > 2, "{name}");
        unsafe {
            assert_eq!(quarc_finish(decoder), QUARC_OK);
            assert_eq!(quarc_pull(decoder, null_mut()), QUARC_END);
            assert_eq!(quarc_push(decoder, stream.as_ptr(), 1), QUARC_MISUSE);
            quarc_close(&mut decoder);
        }
    }
}

#[test]
fn unchanged_arrays_are_reported() {
    let stream = read("journey");
    let mut decoder = quarc_open();
    unsafe {
        quarc_push(decoder, stream.as_ptr(), stream.len());
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_FRAME);
        let all = QUARC_POSITIONS | QUARC_ROTATIONS | QUARC_CODES;
        let changed = || fill(|room| quarc_dequantize(decoder, room)).map(|splats| splats.changed);
        assert_eq!(quarc_dequantize(decoder, null_mut()), QUARC_MISUSE); // converts nothing
        assert_eq!(changed(), Ok(all));
        assert_eq!(changed(), Ok(0));
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_FRAME);
        assert_eq!(changed(), Ok(QUARC_POSITIONS | QUARC_ROTATIONS)); // no deaths or births
        quarc_close(&mut decoder);
    }
}

#[test]
fn seeking_returns_frames_and_recovery_reports_gaps() {
    let mut stream = read("journey");
    unsafe {
        let mut decoder = quarc_open_seek(4);
        quarc_push(decoder, stream.as_ptr(), stream.len());
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_OK);
        assert_eq!(quarc_digest(decoder, [0; QUARC_DIGEST_SIZE].as_mut_ptr()), QUARC_MISUSE);
        quarc_finish(decoder);
        let state: Result<StateView, _> = fill(|room| quarc_pull(decoder, room));
        assert_eq!(state.map(|state| state.frame), Ok(4));
        quarc_close(&mut decoder);

        let middle = stream.len() / 2;
        stream[middle] ^= 1;
        let mut decoder = quarc_open_recover();
        quarc_push(decoder, stream.as_ptr(), stream.len());
        quarc_finish(decoder);
        let (mut frames, mut gaps) = (0, Vec::new());
        loop {
            let pulled = quarc_pull(decoder, null_mut());
            let gap: Result<GapView, _> = fill(|room| quarc_gap(decoder, room));
            assert_eq!(gap.is_ok(), pulled == QUARC_GAP);
            match pulled {
                QUARC_FRAME => frames += 1,
                QUARC_GAP => gaps.extend(gap.map(|gap| (gap.frames_lost, text(gap.reject_id)))),
                status => break assert_eq!(status, QUARC_END),
            }
        }
        assert_eq!(gaps, [(9 - frames, Some("payload-crc".to_owned()))]);
        quarc_close(&mut decoder);
    }
}

#[test]
fn an_error_is_repeated_by_every_later_call() {
    let mut stream = read("journey");
    let last = stream.len() - 1;
    stream[last] ^= 1;
    unsafe {
        let mut decoder = quarc_open();
        assert_eq!(text(quarc_reject_id(decoder)), None);
        assert_eq!(text(quarc_message(decoder)), None);
        quarc_push(decoder, stream.as_ptr(), stream.len());
        let mut frames = 0;
        while quarc_pull(decoder, null_mut()) == QUARC_FRAME {
            frames += 1;
        }
        assert_eq!(frames, 9);
        for _ in 0..2 {
            assert_eq!(quarc_pull(decoder, null_mut()), QUARC_REJECTED);
            assert_eq!(text(quarc_reject_id(decoder)).as_deref(), Some("payload-crc"));
            assert!(text(quarc_message(decoder)).expect("a message").contains("payload"));
        }
        let mut digits = [0; QUARC_DIGEST_SIZE];
        assert_eq!(quarc_digest(decoder, digits.as_mut_ptr()), QUARC_MISUSE, "no state is left");
        quarc_close(&mut decoder);
    }
}

#[test]
fn every_function_accepts_null() {
    unsafe {
        assert_eq!(quarc_push(null_mut(), null(), 0), QUARC_MISUSE);
        assert_eq!(quarc_finish(null_mut()), QUARC_MISUSE);
        assert_eq!(quarc_pull(null_mut(), null_mut()), QUARC_MISUSE);
        assert_eq!(quarc_head(null_mut(), null_mut()), QUARC_MISUSE);
        assert_eq!(quarc_digest(null_mut(), null_mut()), QUARC_MISUSE);
        assert_eq!(quarc_dequantize(null_mut(), null_mut()), QUARC_MISUSE);
        assert_eq!(quarc_gap(null_mut(), null_mut()), QUARC_MISUSE);
        assert_eq!(text(quarc_reject_id(null())), None);
        assert_eq!(text(quarc_message(null())), None);
        quarc_close(null_mut());

        let mut decoder = quarc_open();
        assert_eq!(quarc_push(decoder, null(), 0), QUARC_OK);
        assert_eq!(quarc_push(decoder, null(), 1), QUARC_MISUSE);
        assert_eq!(quarc_push(decoder, [0].as_ptr(), usize::MAX), QUARC_MISUSE);
        let stream = read("journey");
        quarc_push(decoder, stream.as_ptr(), stream.len());
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_FRAME);
        assert_eq!(quarc_head(decoder, null_mut()), QUARC_MISUSE);
        assert_eq!(quarc_digest(decoder, null_mut()), QUARC_MISUSE);
        assert_eq!(quarc_dequantize(decoder, null_mut()), QUARC_MISUSE);
        quarc_close(&mut decoder);
        assert!(decoder.is_null());
        quarc_close(&mut decoder);
        assert_eq!(text(quarc_version()).as_deref(), Some(env!("CARGO_PKG_VERSION")));
    }
}

/// Truncated and modified streams, through calls in any order, cause no crash.
#[test]
fn arbitrary_calls_cause_no_crash() {
    let mut numbers = Numbers::new();
    let mut below = |bound| numbers.below(bound);
    let mut seen = [0; 8];
    for name in ["journey", "snapshots-journey", "updates-journey"] {
        let whole = read(name);
        for _ in 0..200 {
            let mut stream = whole.clone();
            for _ in 0..below(3) {
                let place = below(stream.len());
                stream[place] ^= 1 << below(8);
            }
            stream.truncate(stream.len() - below(2) * below(stream.len()));
            let mut decoder = match below(3) {
                0 => quarc_open(),
                1 => quarc_open_seek(below(10) as u32),
                _ => quarc_open_recover(),
            };
            let mut rest = &stream[..];
            for _ in 0..60 {
                let status = unsafe { call(decoder, below(8), below(stream.len()), &mut rest) };
                seen[(status - QUARC_BROKEN) as usize] += 1;
            }
            unsafe { quarc_close(&mut decoder) };
        }
    }
    let [broken, _, limit, others @ ..] = seen;
    assert_eq!([broken, limit], [0, 0]);
    assert!(others.iter().all(|&count| count > 50), "{seen:?}");
}

unsafe fn call(decoder: *mut DecoderHandle, which: usize, count: usize, rest: &mut &[u8]) -> i32 {
    match which {
        0 => {
            let (piece, behind) = rest.split_at(count.min(rest.len()));
            *rest = behind;
            quarc_push(decoder, piece.as_ptr(), piece.len())
        }
        1 if rest.is_empty() => quarc_finish(decoder),
        2 => fill(|room| quarc_dequantize(decoder, room)).map_or_else(|status| status, |_| 0),
        3 => fill(|room| quarc_gap(decoder, room)).map_or_else(|status| status, |_| 0),
        4 => fill(|room| quarc_head(decoder, room)).map_or_else(|status| status, |_| 0),
        _ => quarc_pull(decoder, null_mut()),
    }
}
