//! Streams read by byte ranges, as a player reads them from a server.

use quarc::chunks::build_chunk;
use quarc_capi::*;
use std::fs;
use std::mem::MaybeUninit;
use std::path::Path;
use std::ptr::null_mut;

type Digest = [std::ffi::c_char; QUARC_DIGEST_SIZE];

fn read(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../conformance/streams");
    fs::read(folder.join(name).with_extension("quarc")).expect("the conformance suite")
}

unsafe fn digest(decoder: *mut DecoderHandle) -> Digest {
    let mut digits = [0; QUARC_DIGEST_SIZE];
    assert_eq!(quarc_digest(decoder, digits.as_mut_ptr()), QUARC_OK);
    digits
}

/// Digests of all frames, decoded in sequence.
unsafe fn decode(stream: &[u8]) -> Vec<Digest> {
    let mut decoder = quarc_open();
    quarc_push(decoder, stream.as_ptr(), stream.len());
    quarc_finish(decoder);
    let mut digests = Vec::new();
    while quarc_pull(decoder, null_mut()) == QUARC_FRAME {
        digests.push(digest(decoder));
    }
    quarc_close(&mut decoder);
    digests
}

/// Decode from a frame on with only the requested bytes. Returns the digests, and the number of
/// bytes passed.
unsafe fn read_parts(stream: &[u8], start: u32) -> (Vec<Digest>, usize) {
    let mut decoder = quarc_open_parts(start);
    assert_eq!(quarc_limit(decoder, stream.len() as u64), QUARC_OK);
    let (mut digests, mut read) = (Vec::new(), 0);
    loop {
        match quarc_pull(decoder, null_mut()) {
            QUARC_FRAME => digests.push(digest(decoder)),
            QUARC_END => break,
            status => {
                assert_eq!(status, QUARC_OK);
                let mut range = [0; 2];
                assert_eq!(quarc_missing(decoder, range.as_mut_ptr()), QUARC_OK);
                let bytes = &stream[range[0] as usize..range[1] as usize];
                read += bytes.len();
                assert_eq!(quarc_put(decoder, range[0], bytes.as_ptr(), bytes.len()), QUARC_OK);
            }
        }
    }
    quarc_close(&mut decoder);
    (digests, read)
}

#[test]
fn seeking_reads_only_the_necessary_bytes() {
    for name in ["journey", "snapshots-journey", "journey-without-index"] {
        let stream = read(name);
        let due = unsafe { decode(&stream) };
        assert!(due.len() > 4);
        for start in 0..due.len() {
            let (digests, read) = unsafe { read_parts(&stream, start as u32) };
            assert_eq!(digests, due[start..], "{name} from {start}");
            assert!(read <= 2 * stream.len());
            if name == "journey" && start + 1 == due.len() {
                assert!(read < stream.len(), "{read} of {}", stream.len());
            }
        }
    }
}

#[test]
fn bytes_after_the_limit_do_not_move_it() {
    let stream = read("journey");
    let half = stream.len() / 2;
    let counts = [true, false].map(|limit_first| unsafe {
        let mut decoder = quarc_open_parts(0);
        let limit = || assert_eq!(quarc_limit(decoder, half as u64), QUARC_OK);
        limit_first.then(limit);
        quarc_put(decoder, 0, stream.as_ptr(), stream.len());
        (!limit_first).then(limit);
        let mut frames = 0;
        let status = loop {
            match quarc_pull(decoder, null_mut()) {
                QUARC_FRAME => frames += 1,
                status => break status,
            }
        };
        quarc_close(&mut decoder);
        (frames, status)
    });
    assert_eq!(counts[0], counts[1]);
    assert_eq!(counts[0].1, QUARC_REJECTED);
}

#[test]
fn the_end_of_byte_ranges_is_declared_by_their_limit() {
    let stream = read("journey");
    let half = stream.len() / 2;
    unsafe {
        let mut decoder = quarc_open_parts(0);
        quarc_put(decoder, 0, stream.as_ptr(), half);
        assert_eq!(quarc_finish(decoder), QUARC_MISUSE);
        assert_eq!(quarc_limit(decoder, half as u64), QUARC_OK);
        let mut status = QUARC_FRAME;
        while status == QUARC_FRAME {
            status = quarc_pull(decoder, null_mut());
        }
        assert_eq!(status, QUARC_REJECTED, "the stream is truncated");
        quarc_close(&mut decoder);
    }
}

#[test]
fn bytes_after_the_end_are_rejected_if_the_length_is_known() {
    let mut stream = read("journey");
    stream.push(0);
    for (is_known, due) in [(true, QUARC_REJECTED), (false, QUARC_END)] {
        let mut decoder = quarc_open_parts(0);
        unsafe {
            if is_known {
                quarc_limit(decoder, stream.len() as u64);
            }
            let status = loop {
                let status = quarc_pull(decoder, null_mut());
                let mut range = [0; 2];
                if status == QUARC_OK {
                    assert_eq!(quarc_missing(decoder, range.as_mut_ptr()), QUARC_OK);
                    let bytes = &stream[range[0] as usize..range[1] as usize];
                    quarc_put(decoder, range[0], bytes.as_ptr(), bytes.len());
                } else if status != QUARC_FRAME {
                    break status;
                }
            };
            assert_eq!(status, due);
            quarc_close(&mut decoder);
        }
    }
}

#[test]
fn bytes_beyond_the_last_offset_are_refused() {
    unsafe {
        let mut decoder = quarc_open_parts(0);
        assert_eq!(quarc_put(decoder, u64::MAX, [0; 2].as_ptr(), 2), QUARC_MISUSE);
        assert_eq!(quarc_put(decoder, u64::MAX - 2, [0; 2].as_ptr(), 2), QUARC_OK);
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_OK);
        quarc_close(&mut decoder);
    }
}

#[test]
fn the_end_of_a_stream_lists_its_frames() {
    let stream = read("journey");
    let mut decoder = quarc_open_parts(0);
    let (mut numbers, mut frames) = ([0; 2], [u32::MAX; 2]);
    let room = frames.len();
    unsafe {
        let mut ask = || quarc_index(decoder, numbers.as_mut_ptr(), frames.as_mut_ptr(), room);
        assert_eq!(ask(), QUARC_OK, "no bytes were put yet");
        assert_eq!(quarc_index(decoder, null_mut(), null_mut(), 0), QUARC_MISUSE);
        assert_eq!(quarc_index(decoder, [0; 2].as_mut_ptr(), null_mut(), 1), QUARC_MISUSE);
        quarc_put(decoder, 0, stream.as_ptr(), stream.len());
        quarc_limit(decoder, stream.len() as u64);
        assert_eq!(ask(), QUARC_FRAME);
        let mut count = [0; 2]; // without room, the numbers alone
        assert_eq!(quarc_index(decoder, count.as_mut_ptr(), null_mut(), 0), QUARC_FRAME);
        assert_eq!(count, numbers);
        assert_eq!(quarc_index(decoder, count.as_mut_ptr(), null_mut(), 1), QUARC_MISUSE);
        assert_eq!(quarc_index(decoder, null_mut(), null_mut(), 0), QUARC_MISUSE);
        quarc_close(&mut decoder);
    }
    assert_eq!(numbers[0], 9);
    assert!(numbers[1] >= 2);
    assert_eq!(frames[0], 0);
    assert!(frames[1] < 9);
}

#[test]
fn cameras_and_metadata_are_the_latest_ones() {
    let stream = read("cameras-and-metadata");
    let mut decoder = quarc_open();
    unsafe {
        let mut camera = MaybeUninit::<CameraView>::uninit();
        assert_eq!(quarc_camera(decoder, 0, camera.as_mut_ptr()), QUARC_MISUSE);
        quarc_push(decoder, stream.as_ptr(), stream.len());
        assert_eq!(quarc_pull(decoder, null_mut()), QUARC_FRAME);
        assert_eq!(quarc_camera(decoder, 0, camera.as_mut_ptr()), QUARC_OK);
        let camera = camera.assume_init();
        let name = std::slice::from_raw_parts(camera.name.bytes, camera.name.length);
        assert!(name == b"left" && camera.width > 0 && camera.focal[0] > 0.0);
        let mut other = MaybeUninit::<CameraView>::uninit();
        let mut entry = MaybeUninit::<EntryView>::uninit();
        assert_eq!(quarc_camera(decoder, 1, other.as_mut_ptr()), QUARC_OK);
        assert_eq!(quarc_metadata(decoder, 0, entry.as_mut_ptr()), QUARC_MISUSE);
        quarc_finish(decoder);
        while quarc_pull(decoder, null_mut()) == QUARC_FRAME {} // other cameras and metadata follow
        assert_eq!(quarc_camera(decoder, 0, other.as_mut_ptr()), QUARC_OK);
        assert_eq!(quarc_camera(decoder, 1, other.as_mut_ptr()), QUARC_MISUSE);
        assert_eq!(quarc_metadata(decoder, 0, entry.as_mut_ptr()), QUARC_OK);
        let entry = entry.assume_init();
        let key = std::slice::from_raw_parts(entry.key.bytes, entry.key.length);
        assert_eq!(key, b"title");
        assert_eq!(quarc_camera(decoder, 1 << 16, null_mut()), QUARC_MISUSE);
        quarc_close(&mut decoder);
    }
}

#[test]
fn a_canonical_frame_can_be_previewed_while_it_arrives() {
    let stream = read("journey");
    let mut sections_seen = Vec::new();
    unsafe {
        let mut decoder = quarc_open_parts(0);
        let mut previews = Vec::new();
        let mut state = MaybeUninit::<StateView>::uninit();
        for (place, byte) in stream.iter().enumerate() {
            quarc_put(decoder, place as u64, byte, 1);
            if quarc_pull(decoder, state.as_mut_ptr()) == QUARC_FRAME {
                break;
            }
            let mut missing = [0; 2];
            assert_eq!(quarc_missing(decoder, missing.as_mut_ptr()), QUARC_OK);
            let mut sections = 0;
            assert_eq!(quarc_preview(decoder, null_mut(), &mut sections), QUARC_MISUSE);
            assert_eq!(quarc_preview(decoder, state.as_mut_ptr(), null_mut()), QUARC_MISUSE);
            if quarc_preview(decoder, state.as_mut_ptr(), &mut sections) == QUARC_FRAME {
                let preview = state.assume_init_ref();
                assert_eq!((preview.frame, preview.phase, preview.count), (0, 0, 12));
                sections_seen.push(sections);
                previews.push((*preview.positions, *preview.rotations, *preview.codes.add(4)));
            }
            let mut still_missing = [0; 2];
            assert_eq!(quarc_missing(decoder, still_missing.as_mut_ptr()), QUARC_OK);
            assert_eq!(missing, still_missing);
        }
        let frame = state.assume_init_ref();
        let last = (*frame.positions, *frame.rotations, *frame.codes.add(4));
        assert_eq!(previews[0], (last.0, 1 << 22, 0));
        assert_eq!(previews.last(), Some(&last));
        let mut sections = 0;
        assert_eq!(quarc_preview(decoder, state.as_mut_ptr(), &mut sections), QUARC_OK);
        quarc_close(&mut decoder);
    }
    assert_eq!(sections_seen, [1, 2, 3, 4, 5, 6]);
}

#[test]
fn a_preview_does_not_report_damage() {
    let mut stream = read("journey");
    let canonical = stream.windows(4).position(|bytes| bytes == b"CANO").expect("a frame");
    stream[canonical + 4 + 12 + 21] ^= 0x40; // the number of words of the first section
    unsafe {
        let mut decoder = quarc_open_parts(0);
        let mut sections = 0;
        let mut state = MaybeUninit::<StateView>::uninit();
        let mut status = QUARC_OK;
        for (place, byte) in stream.iter().enumerate() {
            quarc_put(decoder, place as u64, byte, 1);
            status = quarc_pull(decoder, null_mut());
            if status != QUARC_OK {
                break;
            }
            assert_eq!(quarc_preview(decoder, state.as_mut_ptr(), &mut sections), QUARC_OK);
        }
        assert_eq!(status, QUARC_REJECTED);
        quarc_close(&mut decoder);
    }
}

#[test]
fn reading_a_missing_index_requests_no_bytes() {
    let stream = read("journey-without-index");
    let (mut numbers, mut range) = ([0; 2], [0; 2]);
    unsafe {
        let mut decoder = quarc_open_parts(0);
        quarc_limit(decoder, stream.len() as u64);
        let mut ask = || quarc_index(decoder, numbers.as_mut_ptr(), numbers.as_mut_ptr(), 0);
        assert_eq!(ask(), QUARC_OK);
        assert_eq!(quarc_missing(decoder, range.as_mut_ptr()), QUARC_OK);
        quarc_put(decoder, 0, stream.as_ptr(), stream.len());
        assert_eq!(ask(), QUARC_OK);
        assert_eq!(quarc_missing(decoder, range.as_mut_ptr()), QUARC_MISUSE);
        quarc_close(&mut decoder);
    }
}

/// The search has one part of 20 bytes for each chunk, far too many to look at all for each read.
#[test]
fn a_search_passes_a_great_many_chunks() {
    let mut stream = read("journey-without-index")[..8 + 24 + 69].to_vec();
    for number in 1..=200_000 {
        stream.extend(build_chunk(*b"note", number, &[]).expect("it fits"));
    }
    let mut decoder = quarc_open_parts(1);
    let mut range = [0; 2];
    unsafe {
        quarc_limit(decoder, stream.len() as u64);
        while quarc_pull(decoder, null_mut()) == QUARC_OK {
            assert_eq!(quarc_missing(decoder, range.as_mut_ptr()), QUARC_OK);
            let bytes = &stream[range[0] as usize..range[1] as usize];
            quarc_put(decoder, range[0], bytes.as_ptr(), bytes.len());
        }
        let id = std::ffi::CStr::from_ptr(quarc_reject_id(decoder));
        assert_eq!(id.to_bytes(), b"truncated");
        quarc_close(&mut decoder);
    }
    assert!(range[1] > stream.len() as u64 - 100); // TAIL was looked for at the end
}

#[test]
fn byte_ranges_may_overlap_and_come_in_any_order() {
    let stream = read("journey");
    let due = unsafe { decode(&stream) };
    for step in [1, 7, 100, 1000] {
        let mut decoder = quarc_open_parts(0);
        let mut digests = Vec::new();
        let starts: Vec<_> = (0..stream.len()).step_by(step).collect();
        let twice = starts.iter().rev().chain(&starts);
        unsafe {
            for (number, &start) in twice.enumerate() {
                let length = (step * (1 + number % 3)).min(stream.len() - start);
                let bytes = &stream[start..start + length];
                quarc_put(decoder, start as u64, bytes.as_ptr(), bytes.len());
            }
            while quarc_pull(decoder, null_mut()) == QUARC_FRAME {
                digests.push(digest(decoder));
            }
            quarc_close(&mut decoder);
        }
        assert_eq!(digests, due, "pieces of {step} bytes");
    }
}
