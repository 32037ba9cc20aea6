//! Every field of the structs, and calls that do not suit the kind of decoder.
//!
//! The calls are unsafe, as they are from C. Their pointers are NULL where the interface allows it,
//! decoders that are still open, or room for a value of the right type.

use quarc::stream::Decoder;
use quarc::wire::Camera;
use quarc_capi::*;
use std::fs;
use std::mem::MaybeUninit;
use std::path::Path;
use std::ptr::{null, null_mut};
use std::slice::from_raw_parts;

fn read(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../conformance/streams");
    fs::read(folder.join(name).with_extension("quarc")).expect("the conformance suite")
}

/// The value that a function fills.
fn fill<T>(function: impl FnOnce(*mut T) -> i32) -> T {
    let mut room = MaybeUninit::uninit();
    assert_eq!(function(room.as_mut_ptr()), QUARC_OK);
    // SAFETY: the function has filled it.
    unsafe { room.assume_init() }
}

unsafe fn text(view: &TextView) -> &str {
    std::str::from_utf8(from_raw_parts(view.bytes, view.length)).expect("UTF-8")
}

/// Two decoders of a stream, at its first frame.
fn decode(stream: &[u8]) -> (*mut DecoderHandle, Decoder) {
    let (decoder, mut library) = (quarc_open(), Decoder::new());
    library.push(stream);
    library.pull().expect("a stream");
    unsafe {
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_OK, "no bytes were pushed yet");
        quarc_push(decoder, stream.as_ptr(), stream.len());
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_FRAME);
    }
    (decoder, library)
}

#[test]
fn a_head_has_the_fields_of_the_header() {
    for name in ["journey", "updates-journey", "cameras-and-metadata"] {
        let (mut decoder, library) = decode(&read(name));
        let due = library.header().expect("HEAD");
        let head: HeadView = fill(|room| unsafe { quarc_head(decoder, room) });
        assert_eq!([head.timescale, head.frame_ticks], [due.timescale, due.frame_ticks]);
        assert_eq!(
            [head.level, head.lattice_exponent, head.sh_degree, head.up_axis],
            [due.level, due.lattice_exponent, due.sh_degree, due.up_axis].map(u32::from)
        );
        assert_eq!(
            [head.log_scale_step, head.opacity_step, head.sh_dc_step, head.sh_rest_step],
            [due.log_scale_step, due.opacity_step, due.sh_dc_step, due.sh_rest_step]
        );
        assert_eq!(
            [head.right_handed, head.updates],
            [due.right_handed, due.updates].map(u32::from)
        );
        assert_eq!(head.meters_per_unit, due.meters_per_unit);
        unsafe { quarc_close(&mut decoder) };
    }
}

#[test]
fn cameras_and_metadata_have_the_fields_of_their_records() {
    let (mut decoder, mut library) = decode(&read("cameras-and-metadata"));
    let compare = |library: &Decoder| unsafe {
        for (number, due) in library.cameras().iter().enumerate() {
            let view: CameraView = fill(|room| quarc_camera(decoder, number, room));
            let found = Camera {
                name: text(&view.name).to_owned(),
                held_out: view.held_out == 1,
                width: view.width,
                height: view.height,
                focal: view.focal,
                center: view.center,
                rotation: view.rotation,
                translation: view.translation,
                near: view.near_plane,
            };
            assert_eq!(&found, due);
        }
        for (number, (key, value)) in library.metadata().iter().enumerate() {
            let view: EntryView = fill(|room| quarc_metadata(decoder, number, room));
            assert_eq!((text(&view.key), text(&view.value)), (&key[..], &value[..]));
        }
        library.cameras().len() + library.metadata().len()
    };
    let mut compared = compare(&library);
    while library.pull().expect("a stream").is_some() {
        assert_eq!(unsafe { quarc_pull(decoder, null_mut()) }, QUARC_FRAME);
    }
    unsafe { quarc_pull(decoder, null_mut()) };
    compared += compare(&library);
    assert!(compared > 3, "{compared}");
    unsafe { quarc_close(&mut decoder) };
}

#[test]
fn functions_for_byte_ranges_accept_null_and_refuse_other_decoders() {
    let mut others = [null_mut(), quarc_open(), quarc_open_seek(1), quarc_open_recover()];
    let mut parts = quarc_open_parts(0);
    for &decoder in &others {
        unsafe {
            assert_eq!(quarc_put(decoder, 0, null(), 0), QUARC_MISUSE);
            assert_eq!(quarc_limit(decoder, 1), QUARC_MISUSE);
            assert_eq!(quarc_missing(decoder, [0; 2].as_mut_ptr()), QUARC_MISUSE);
            assert_eq!(quarc_offset(decoder, &mut 0), QUARC_MISUSE);
            assert_eq!(quarc_camera(decoder, 0, null_mut()), QUARC_MISUSE);
            assert_eq!(quarc_metadata(decoder, 0, null_mut()), QUARC_MISUSE);
            let due = if decoder.is_null() { QUARC_MISUSE } else { QUARC_OK };
            assert_eq!(quarc_index(decoder, [7; 2].as_mut_ptr(), null_mut(), 0), due);
            let mut state = MaybeUninit::uninit();
            assert_eq!(quarc_preview(decoder, state.as_mut_ptr(), &mut 0), due);
        }
    }
    unsafe {
        assert_eq!(quarc_push(parts, [0].as_ptr(), 1), QUARC_MISUSE);
        assert_eq!(quarc_put(parts, 0, null(), 0), QUARC_OK);
        assert_eq!(quarc_put(parts, 0, null(), 1), QUARC_MISUSE);
        assert_eq!(quarc_put(parts, 0, [0].as_ptr(), usize::MAX), QUARC_MISUSE);
        assert_eq!(quarc_pull(parts, null_mut()), QUARC_OK);
        assert_eq!(quarc_missing(parts, null_mut()), QUARC_MISUSE);
        quarc_close(&mut parts);
        others.iter_mut().for_each(|decoder| quarc_close(decoder));
    }
}

/// The index needs the beginning of the stream again, which shows whether it is still known.
#[test]
fn bytes_before_the_next_chunk_are_discarded() {
    let stream = read("journey");
    let (mut next, mut range) = (0, [0; 2]);
    unsafe {
        let mut decoder = quarc_open_parts(0);
        quarc_limit(decoder, stream.len() as u64);
        quarc_put(decoder, 0, stream.as_ptr(), stream.len());
        assert_eq!(quarc_offset(decoder, &mut next), QUARC_MISUSE, "HEAD is not read yet");
        while quarc_pull(decoder, null_mut()) == QUARC_FRAME {
            assert_eq!(quarc_offset(decoder, null_mut()), QUARC_MISUSE);
            assert_eq!(quarc_offset(decoder, &mut next), QUARC_OK);
            assert_eq!(stream[next as usize..][..4], [0x9E, 0x51, 0x43, 0xF3]);
        }
        assert_eq!(quarc_index(decoder, [0; 2].as_mut_ptr(), null_mut(), 0), QUARC_OK);
        assert_eq!(quarc_missing(decoder, range.as_mut_ptr()), QUARC_OK);
        quarc_close(&mut decoder);
    }
    assert_eq!(range, [0, 8]);
}
