//! The C interface, called in any order, does not crash, and its pointers are valid.

#![no_main]

use libfuzzer_sys::fuzz_target;
use quarc_capi::*;
use quarc_fuzz::mend::mend;
use std::mem::MaybeUninit;
use std::ptr;
use std::slice::from_raw_parts;

const CALLS: usize = 48;

fuzz_target!(|data: &[u8]| {
    let (calls, bytes) = data.split_at(data.len().min(CALLS));
    let stream = if calls.first().map_or(false, |call| call & 1 == 0) {
        mend(bytes)
    } else {
        bytes.to_vec()
    };
    let mut decoder = match calls.first().map_or(0, |call| call >> 1) {
        0..=63 => quarc_open(),
        start @ 64..=95 => quarc_open_seek(u32::from(start - 64)),
        _ => quarc_open_recover(),
    };
    let mut rest = &stream[..];
    for &call in calls.iter().skip(1).chain([&5; 64]) {
        // SAFETY: the decoder is open or null, and all pointers are valid.
        unsafe { act(call, &mut decoder, &mut rest) };
    }
    unsafe {
        quarc_close(&mut decoder);
        quarc_close(&mut decoder);
        assert_eq!(quarc_pull(decoder, ptr::null_mut()), QUARC_MISUSE);
    }
});

unsafe fn act(call: u8, decoder: &mut *mut DecoderHandle, rest: &mut &[u8]) {
    let decoder = *decoder;
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

unsafe fn look_at_state(state: &StateView) {
    let rows = [(3, state.positions, state.positions_stride)];
    for (count, place, stride) in rows.into_iter().chain([(4, state.rotations, state.rotations_stride)]) {
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
