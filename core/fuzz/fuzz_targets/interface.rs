//! The C interface, called in any order, does not crash, and its pointers are valid.

#![no_main]

use libfuzzer_sys::fuzz_target;
use quarc_capi::*;
use quarc_fuzz::mend::mend;
use std::mem::MaybeUninit;
use std::ptr;
use std::slice::from_raw_parts;
use std::str::from_utf8;

const CALLS: usize = 48;

fuzz_target!(|data: &[u8]| {
    let (calls, bytes) = data.split_at(data.len().min(CALLS));
    let stream = if calls.first().map_or(false, |call| call & 1 == 0) {
        mend(bytes)
    } else {
        bytes.to_vec()
    };
    let mut decoder = match calls.first().map_or(0, |call| call >> 1) {
        0..=31 => quarc_open(),
        start @ 32..=63 => quarc_open_parts(u32::from(start - 32)),
        start @ 64..=95 => quarc_open_seek(u32::from(start - 64)),
        _ => quarc_open_recover(),
    };
    let mut rest = &stream[..];
    for &call in calls.iter().skip(1).chain([&5; 64]) {
        // SAFETY: the decoder is open or null, and all pointers are valid.
        unsafe {
            act(call, decoder, &mut rest);
            act_on_ranges(call, decoder, &stream);
        }
    }
    unsafe {
        quarc_close(&mut decoder);
        quarc_close(&mut decoder);
        assert_eq!(quarc_pull(decoder, ptr::null_mut()), QUARC_MISUSE);
    }
});

unsafe fn act(call: u8, decoder: *mut DecoderHandle, rest: &mut &[u8]) {
    match call % 8 {
        0 => {
            let count = rest.len().min(usize::from(call) * 4);
            assert!(quarc_push(decoder, rest.as_ptr(), count) >= QUARC_MISUSE);
            *rest = &rest[count..];
        }
        1 => {
            assert!(quarc_push(decoder, rest.as_ptr(), rest.len()) >= QUARC_MISUSE);
            *rest = &[];
        }
        2 if call > 200 => {
            quarc_finish(decoder);
        }
        3 => {
            let mut head = MaybeUninit::uninit();
            if quarc_head(decoder, head.as_mut_ptr()) == QUARC_OK {
                assert!(head.assume_init().frame_ticks > 0);
            }
            let mut gap = MaybeUninit::uninit();
            if quarc_gap(decoder, gap.as_mut_ptr()) == QUARC_OK {
                assert!(!gap.assume_init().reject_id.is_null());
            }
        }
        4 => {
            let mut splats = MaybeUninit::uninit();
            if quarc_dequantize(decoder, splats.as_mut_ptr()) == QUARC_OK {
                look_at_splats(&splats.assume_init());
            }
        }
        _ => {
            let mut state = MaybeUninit::uninit();
            match quarc_pull(decoder, state.as_mut_ptr()) {
                QUARC_FRAME => look_at_state(&state.assume_init()),
                QUARC_BROKEN => panic!("the decoder is broken"),
                QUARC_REJECTED => assert!(!quarc_reject_id(decoder).is_null()),
                QUARC_LIMIT => assert!(!quarc_message(decoder).is_null()),
                QUARC_OK if rest.is_empty() && call == 5 => {
                    quarc_finish(decoder);
                }
                _ => {}
            }
        }
    }
}

/// Calls of a decoder of byte ranges; of others, they are misuse.
unsafe fn act_on_ranges(call: u8, decoder: *mut DecoderHandle, stream: &[u8]) {
    let put = |begin: u64, length: usize| {
        let rest = &stream[stream.len().min(begin as usize)..];
        quarc_put(decoder, begin, rest.as_ptr(), rest.len().min(length))
    };
    let mut range = [0; 2];
    match call {
        0..=5 if quarc_missing(decoder, range.as_mut_ptr()) == QUARC_OK => {
            assert!(range[0] < range[1]);
            if range[0] >= stream.len() as u64 {
                quarc_limit(decoder, stream.len() as u64);
            }
            put(range[0], (range[1] - range[0]) as usize);
        }
        6..=31 => {
            put(u64::from(call) * 16, usize::from(call));
        }
        32..=63 => {
            let (mut state, mut sections) = (MaybeUninit::uninit(), 0);
            if quarc_preview(decoder, state.as_mut_ptr(), &mut sections) == QUARC_FRAME {
                look_at_state(&state.assume_init());
            }
        }
        64..=95 => {
            let (mut numbers, mut frames) = ([0; 2], [0; 32]);
            let room = usize::from(call - 64);
            if quarc_index(decoder, numbers.as_mut_ptr(), frames.as_mut_ptr(), room) == QUARC_FRAME
            {
                let known = &frames[..room.min(numbers[1] as usize)];
                assert!(known.windows(2).all(|pair| pair[0] < pair[1]));
            }
        }
        96..=99 => {
            quarc_limit(decoder, stream.len() as u64 / u64::from(call - 95));
        }
        100..=127 => {
            let mut offset = 0;
            if quarc_offset(decoder, &mut offset) == QUARC_OK {
                assert!(offset <= stream.len() as u64);
            }
            look_at_texts(decoder, usize::from(call - 100));
        }
        _ => {}
    }
}

unsafe fn look_at_texts(decoder: *mut DecoderHandle, number: usize) {
    let mut camera = MaybeUninit::uninit();
    if quarc_camera(decoder, number, camera.as_mut_ptr()) == QUARC_OK {
        look_at_text(&camera.assume_init().name);
    }
    let mut entry = MaybeUninit::uninit();
    if quarc_metadata(decoder, number, entry.as_mut_ptr()) == QUARC_OK {
        let entry: EntryView = entry.assume_init();
        look_at_text(&entry.key);
        look_at_text(&entry.value);
    }
}

unsafe fn look_at_text(text: &TextView) {
    assert!(from_utf8(from_raw_parts(text.bytes, text.length)).is_ok());
}

unsafe fn look_at_state(state: &StateView) {
    let rows = [(3, state.positions, state.positions_stride)];
    for (count, place, stride) in
        rows.into_iter().chain([(4, state.rotations, state.rotations_stride)])
    {
        for row in 0..count {
            let row = from_raw_parts(place.add(row * stride), state.count);
            assert!(row.iter().all(|&number| i64::from(number).abs() <= 1 << 24));
        }
    }
    for row in 0..state.code_rows {
        let row = from_raw_parts(state.codes.add(row * state.codes_stride), state.count);
        assert!(row.iter().all(|&code| code > i16::MIN));
    }
    let ids = from_raw_parts(state.ids, state.count);
    assert!(state.count > 0 && ids.windows(2).all(|pair| pair[0] < pair[1]));
}

unsafe fn look_at_splats(splats: &SplatsView) {
    let arrays = [
        (splats.positions, 3),
        (splats.rotations, 4),
        (splats.log_scales, 3),
        (splats.opacities, 1),
        (splats.sh, 3 * splats.sh_coefficients),
    ];
    for (place, width) in arrays {
        let numbers = from_raw_parts(place, splats.count * width);
        assert!(numbers.iter().all(|number| number.is_finite()));
    }
}
