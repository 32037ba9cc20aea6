//! C interface of the decoder: include/quarc.h is generated from this crate.
//!
//! `unsafe` code trusts only what the C caller passes: pointers that meet the conditions in the
//! comments, which are those of the header. A panic does not reach C: it breaks the decoder.

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]
// The conditions for the caller are worded for the header, which has no headings.
#![allow(clippy::missing_safety_doc)]

mod decoder;
mod parts;
mod reading;
mod views;

use decoder::{AnyDecoder, Pulled};
use quarc::error::Error;
pub use reading::*;
use std::ffi::{c_char, CStr};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::ptr;
pub use views::{
    CameraView, EntryView, GapView, HeadView, SplatsView, StateView, TextView, QUARC_CODES,
    QUARC_POSITIONS, QUARC_ROTATIONS,
};

/// Success. From `quarc_pull`: more bytes are needed before the next result.
pub const QUARC_OK: i32 = 0;
/// From `quarc_pull`: the state of the next frame is available.
pub const QUARC_FRAME: i32 = 1;
/// From `quarc_pull`, in recovery: a part of the stream is missing here.
pub const QUARC_GAP: i32 = 2;
/// From `quarc_pull`: the stream has ended. Except in recovery, all frames that it returned, and all
/// chunks after them, passed their checks.
pub const QUARC_END: i32 = 3;
/// The bytes are not a valid stream: `quarc_reject_id` says which rule they break.
pub const QUARC_REJECTED: i32 = -1;
/// A stream of the unlimited level needs more than this decoder supports (SPEC 3.2).
pub const QUARC_LIMIT: i32 = -2;
/// A pointer is NULL, or the call is invalid now, as for a state before the first frame.
pub const QUARC_MISUSE: i32 = -3;
/// An internal error of the decoder. After it, only `quarc_message` and `quarc_close` may be called.
pub const QUARC_BROKEN: i32 = -4;

/// Size of a digest in characters, including the terminating zero.
pub const QUARC_DIGEST_SIZE: usize = 65;

/// A decoder of one stream (opaque).
pub struct DecoderHandle {
    decoder: AnyDecoder,
    is_broken: bool,
}

/// The version of this library, such as "1.1.0". The string is static.
#[no_mangle]
pub extern "C" fn quarc_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// Open a decoder that returns the frames of a stream as its bytes arrive. The caller owns it and
/// frees it with `quarc_close`. Never NULL.
#[no_mangle]
pub extern "C" fn quarc_open() -> *mut DecoderHandle {
    hand_out(AnyDecoder::in_order())
}

/// Open a decoder of the frames from ordinal `start` on; it skips what it need not decode (SPEC 11.2).
/// It buffers the whole stream and returns no frame before `quarc_finish`.
#[no_mangle]
pub extern "C" fn quarc_open_seek(start: u32) -> *mut DecoderHandle {
    hand_out(AnyDecoder::seek(start))
}

/// Open a decoder of the intact frames of a damaged stream, and of its gaps (SPEC 11.4). It buffers
/// the whole stream and returns no frame before `quarc_finish`.
#[no_mangle]
pub extern "C" fn quarc_open_recover() -> *mut DecoderHandle {
    hand_out(AnyDecoder::recover())
}

pub(crate) fn hand_out(decoder: AnyDecoder) -> *mut DecoderHandle {
    Box::into_raw(Box::new(DecoderHandle { decoder, is_broken: false }))
}

/// Free a decoder and all memory that it returned, and set the caller's pointer to NULL: a second
/// call does nothing, and so does one with NULL.
///
/// `decoder` is NULL, or points to NULL or to a decoder that was opened and not closed.
#[no_mangle]
pub unsafe extern "C" fn quarc_close(decoder: *mut *mut DecoderHandle) {
    // SAFETY: guaranteed by the caller.
    let Some(place) = (unsafe { decoder.as_mut() }) else { return };
    let handle = std::mem::replace(place, ptr::null_mut());
    if !handle.is_null() {
        // SAFETY: made by `hand_out`, and no longer known to the caller.
        let handle = unsafe { Box::from_raw(handle) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(handle)));
    }
}

/// Pass the next `length` bytes of the stream, in pieces of any size; they are copied.
/// Decoding happens in `quarc_pull`. Returns QUARC_OK, or QUARC_MISUSE after `quarc_finish`, or if
/// the decoder was opened for byte ranges: `quarc_put` passes them.
///
/// `decoder` is NULL or open; `bytes` points to `length` bytes, or `length` is 0.
#[no_mangle]
pub unsafe extern "C" fn quarc_push(
    decoder: *mut DecoderHandle,
    bytes: *const u8,
    length: usize,
) -> i32 {
    let bytes = match length {
        0 => &[][..],
        _ if bytes.is_null() || length > isize::MAX as usize => return QUARC_MISUSE,
        // SAFETY: guaranteed by the caller.
        _ => unsafe { std::slice::from_raw_parts(bytes, length) },
    };
    let push = |decoder: &mut AnyDecoder| decoder.push(bytes).then_some(QUARC_OK);
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, push) }
}

/// Declare the end of the stream; then call `quarc_pull` until it ends. Returns QUARC_OK, or
/// QUARC_MISUSE if the decoder was opened for byte ranges: `quarc_limit` declares their end.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_finish(decoder: *mut DecoderHandle) -> i32 {
    let finish = |decoder: &mut AnyDecoder| decoder.finish().then_some(QUARC_OK);
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, finish) }
}

/// Decode the next frame. QUARC_FRAME: `state` has been filled, unless it is NULL; its pointers
/// are valid until the next `quarc_pull` or `quarc_close`, and their memory is read-only.
/// QUARC_GAP: `quarc_gap` describes what is missing. QUARC_OK: push more bytes. QUARC_END: the stream
/// has ended; until `quarc_finish`, bytes that are pushed after its end are still rejected.
/// A negative status is an error, which every later call repeats; all frames before it were returned,
/// and there is no state any more.
///
/// `decoder` is NULL or open; `state` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_pull(decoder: *mut DecoderHandle, state: *mut StateView) -> i32 {
    let pull = |decoder: &mut AnyDecoder| match decoder.pull() {
        Ok(Pulled::More) => Some(QUARC_OK),
        Ok(Pulled::Frame) => {
            if !state.is_null() {
                // SAFETY: guaranteed by the caller.
                unsafe { state.write(StateView::of(decoder.state()?)) };
            }
            Some(QUARC_FRAME)
        }
        Ok(Pulled::Gap) => Some(QUARC_GAP),
        Ok(Pulled::End) => Some(QUARC_END),
        Err(Error::Limit(_)) => Some(QUARC_LIMIT),
        Err(Error::Rejected { .. }) => Some(QUARC_REJECTED),
        Err(_) => Some(QUARC_BROKEN),
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, pull) }
}

/// Get the parameters of the stream, available once `quarc_pull` has read HEAD: at the latest
/// before the first frame. Returns QUARC_OK, or QUARC_MISUSE before that. `head` has no pointers.
///
/// `decoder` is NULL or open; `head` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_head(decoder: *mut DecoderHandle, head: *mut HeadView) -> i32 {
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, |decoder| write(head, HeadView::of(decoder.header()?))) }
}

/// Get the SHA-256 of the last state (SPEC 9.1), as 64 hexadecimal digits and a zero in
/// `digits`, which has room for QUARC_DIGEST_SIZE characters. Returns QUARC_OK, or QUARC_MISUSE if
/// there is no state.
///
/// `decoder` is NULL or open; `digits` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_digest(decoder: *mut DecoderHandle, digits: *mut c_char) -> i32 {
    let digest = |decoder: &mut AnyDecoder| {
        let mut text = [0; QUARC_DIGEST_SIZE];
        let digest = decoder.state()?.digest();
        text[..QUARC_DIGEST_SIZE - 1].copy_from_slice(digest.as_bytes());
        // SAFETY: guaranteed by the caller.
        unsafe { write(digits.cast(), text) }
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, digest) }
}

/// Convert the last state to floats. The pointers are valid until the next `quarc_dequantize`
/// or `quarc_close`, even while the next frame is decoded. Returns QUARC_OK, or QUARC_MISUSE if there
/// is no state.
///
/// `decoder` is NULL or open; `splats` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_dequantize(
    decoder: *mut DecoderHandle,
    splats: *mut SplatsView,
) -> i32 {
    let dequantize = |decoder: &mut AnyDecoder| {
        if splats.is_null() {
            return None;
        }
        let (state, numbers, redone) = decoder.dequantize()?;
        // SAFETY: guaranteed by the caller.
        unsafe { write(splats, SplatsView::of(state, numbers, redone)) }
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, dequantize) }
}

/// Describe what is missing, after QUARC_GAP. `reject_id` is valid until the next `quarc_pull` or
/// `quarc_close`. Returns QUARC_OK, or QUARC_MISUSE if the last `quarc_pull` did not return QUARC_GAP.
///
/// `decoder` is NULL or open; `gap` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_gap(decoder: *mut DecoderHandle, gap: *mut GapView) -> i32 {
    let show = |decoder: &mut AnyDecoder| {
        let (found, id) = decoder.gap()?;
        // SAFETY: guaranteed by the caller.
        unsafe { write(gap, GapView::of(found, id)) }
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, show) }
}

/// The reject id of SPEC 3.3 after QUARC_REJECTED, else NULL. It is valid until `quarc_close`.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_reject_id(decoder: *const DecoderHandle) -> *const c_char {
    // SAFETY: guaranteed by the caller.
    let handle = unsafe { decoder.as_ref() };
    handle.and_then(|handle| handle.decoder.reject_id()).map_or(ptr::null(), CStr::as_ptr)
}

/// The error message, or NULL if there is no error. It is valid until `quarc_close`.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_message(decoder: *const DecoderHandle) -> *const c_char {
    // SAFETY: guaranteed by the caller.
    let Some(handle) = (unsafe { decoder.as_ref() }) else { return ptr::null() };
    if handle.is_broken {
        return "internal error of the decoder\0".as_ptr().cast();
    }
    handle.decoder.message().map_or(ptr::null(), CStr::as_ptr)
}

/// Run a function on a decoder and catch panics; `None` from it means misuse.
///
/// # Safety
/// `handle` is null, or an open decoder that is not used elsewhere meanwhile.
pub(crate) unsafe fn call(
    handle: *mut DecoderHandle,
    act: impl FnOnce(&mut AnyDecoder) -> Option<i32>,
) -> i32 {
    // SAFETY: guaranteed by the caller.
    let Some(handle) = (unsafe { handle.as_mut() }) else { return QUARC_MISUSE };
    if handle.is_broken {
        return QUARC_BROKEN;
    }
    let decoder = &mut handle.decoder;
    match catch_unwind(AssertUnwindSafe(|| act(decoder))) {
        Ok(status) => status.unwrap_or(QUARC_MISUSE),
        Err(_) => {
            handle.is_broken = true;
            QUARC_BROKEN
        }
    }
}

/// Store a value for the caller unless the pointer is NULL.
///
/// # Safety
/// `place` is null or has room.
pub(crate) unsafe fn write<T>(place: *mut T, value: T) -> Option<i32> {
    if place.is_null() {
        return None;
    }
    // SAFETY: guaranteed by the caller.
    unsafe { place.write(value) };
    Some(QUARC_OK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_does_not_cross_and_breaks_the_decoder() {
        let mut decoder = quarc_open();
        unsafe {
            assert_eq!(call(decoder, |_| panic!("a fault, for the test")), QUARC_BROKEN);
            assert_eq!(quarc_pull(decoder, ptr::null_mut()), QUARC_BROKEN);
            assert_eq!(quarc_finish(decoder), QUARC_BROKEN);
            let message = CStr::from_ptr(quarc_message(decoder)).to_str();
            assert_eq!(message, Ok("internal error of the decoder"));
            assert!(quarc_reject_id(decoder).is_null());
            quarc_close(&mut decoder);
        }
        assert!(decoder.is_null());
    }
}
