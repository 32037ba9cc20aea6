//! C interface of the decoder: include/quarc.h is made of this crate.
//!
//! Nothing but what C hands over is trusted in `unsafe`: pointers to be what the comments ask
//! for, which are those of the header. A panic does not cross: the decoder is broken after it.

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]
// What is asked of the caller is said in the words of the header, which has no headings.
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

/// It is done. Of `quarc_pull`: nothing comes before more bytes are pushed.
pub const QUARC_OK: i32 = 0;
/// Of `quarc_pull`: the state of the next frame is there.
pub const QUARC_FRAME: i32 = 1;
/// Of `quarc_pull`, in recovery: a part of the stream is missing here.
pub const QUARC_GAP: i32 = 2;
/// Of `quarc_pull`: the stream is over, and all that it says is true.
pub const QUARC_END: i32 = 3;
/// The bytes are no valid stream: `quarc_reject_id` says which rule is broken.
pub const QUARC_REJECTED: i32 = -1;
/// A stream of the unlimited level asks for more than this decoder gives (SPEC 3.2).
pub const QUARC_LIMIT: i32 = -2;
/// A pointer is NULL, or the call has no meaning here, as that of a state before the first.
pub const QUARC_MISUSE: i32 = -3;
/// A fault of the decoder itself; nothing but `quarc_close` makes sense after it.
pub const QUARC_BROKEN: i32 = -4;

/// Characters of a digest, and the zero behind them.
pub const QUARC_DIGEST_SIZE: usize = 65;

/// A decoder of one stream. Nobody looks into it.
pub struct DecoderHandle {
    decoder: AnyDecoder,
    is_broken: bool,
}

/// The version of this library, as "1.1.0". The text lasts for ever.
#[no_mangle]
pub extern "C" fn quarc_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// A decoder that gives the frames of a stream as its bytes come. The caller owns it, and hands
/// it to `quarc_close` when done. Never NULL.
#[no_mangle]
pub extern "C" fn quarc_open() -> *mut DecoderHandle {
    hand_out(AnyDecoder::in_order())
}

/// The same, of the frames from ordinal `start` on, without decoding what need not be (SPEC 11.2).
/// It keeps the whole stream, and gives nothing before `quarc_finish`.
#[no_mangle]
pub extern "C" fn quarc_open_seek(start: u32) -> *mut DecoderHandle {
    hand_out(AnyDecoder::seek(start))
}

/// The same, of what is left of a damaged stream, and of the gaps in it (SPEC 11.4). It keeps the
/// whole stream, and gives nothing before `quarc_finish`.
#[no_mangle]
pub extern "C" fn quarc_open_recover() -> *mut DecoderHandle {
    hand_out(AnyDecoder::recover())
}

pub(crate) fn hand_out(decoder: AnyDecoder) -> *mut DecoderHandle {
    Box::into_raw(Box::new(DecoderHandle { decoder, is_broken: false }))
}

/// Free a decoder and all that it has given out, and set the caller's pointer to NULL: a second
/// call does nothing, and so does one with NULL.
///
/// `decoder` is NULL, or points to NULL or to a decoder that was opened and not closed.
#[no_mangle]
pub unsafe extern "C" fn quarc_close(decoder: *mut *mut DecoderHandle) {
    // SAFETY: as the caller says.
    let Some(place) = (unsafe { decoder.as_mut() }) else { return };
    let handle = std::mem::replace(place, ptr::null_mut());
    if !handle.is_null() {
        // SAFETY: made by `hand_out`, and no longer known to the caller.
        let handle = unsafe { Box::from_raw(handle) };
        let _ = catch_unwind(AssertUnwindSafe(|| drop(handle)));
    }
}

/// Hand over the next `length` bytes of the stream, in pieces of any size; they are copied.
/// Nothing is decoded before `quarc_pull`. QUARC_OK, or QUARC_MISUSE after `quarc_finish`.
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
        // SAFETY: as the caller says.
        _ => unsafe { std::slice::from_raw_parts(bytes, length) },
    };
    let push = |decoder: &mut AnyDecoder| decoder.push(bytes).then_some(QUARC_OK);
    // SAFETY: as the caller says.
    unsafe { call(decoder, push) }
}

/// Say that no more bytes will come; then pull to the end. QUARC_OK.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_finish(decoder: *mut DecoderHandle) -> i32 {
    let finish = |decoder: &mut AnyDecoder| {
        decoder.finish();
        Some(QUARC_OK)
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, finish) }
}

/// Go on to the next frame. QUARC_FRAME: `state` has been filled, unless it is NULL; its pointers
/// last until the next `quarc_pull` or `quarc_close`, and what they point to must not be written
/// to. QUARC_GAP: `quarc_gap` says what is missing. QUARC_OK: push more bytes. QUARC_END. Or what
/// is wrong with the stream, again and again; all frames before the fault have been given out.
///
/// `decoder` is NULL or open; `state` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_pull(decoder: *mut DecoderHandle, state: *mut StateView) -> i32 {
    let pull = |decoder: &mut AnyDecoder| match decoder.pull() {
        Ok(Pulled::More) => Some(QUARC_OK),
        Ok(Pulled::Frame) => {
            if !state.is_null() {
                // SAFETY: as the caller says.
                unsafe { state.write(StateView::of(decoder.state()?)) };
            }
            Some(QUARC_FRAME)
        }
        Ok(Pulled::Gap) => Some(QUARC_GAP),
        Ok(Pulled::End) => Some(QUARC_END),
        Err(Error::Limit(_)) => Some(QUARC_LIMIT),
        Err(Error::Rejected { .. }) => Some(QUARC_REJECTED),
        Err(Error::Encode(_) | Error::Source(_)) => Some(QUARC_BROKEN),
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, pull) }
}

/// What the stream chose for itself, once HEAD has been pulled over: before the first frame at the
/// latest. QUARC_OK, or QUARC_MISUSE before that. Nothing in `head` points anywhere.
///
/// `decoder` is NULL or open; `head` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_head(decoder: *mut DecoderHandle, head: *mut HeadView) -> i32 {
    // SAFETY: as the caller says.
    unsafe { call(decoder, |decoder| write(head, HeadView::of(decoder.header()?))) }
}

/// The SHA-256 of the state that was pulled last (SPEC 9.1), as 64 hexadecimal digits and a zero in
/// `digits`, which has room for QUARC_DIGEST_SIZE characters. QUARC_OK, or QUARC_MISUSE where
/// there is no state.
///
/// `decoder` is NULL or open; `digits` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_digest(decoder: *mut DecoderHandle, digits: *mut c_char) -> i32 {
    let digest = |decoder: &mut AnyDecoder| {
        let mut text = [0; QUARC_DIGEST_SIZE];
        let digest = decoder.state()?.digest();
        text[..QUARC_DIGEST_SIZE - 1].copy_from_slice(digest.as_bytes());
        // SAFETY: as the caller says.
        unsafe { write(digits.cast(), text) }
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, digest) }
}

/// The state that was pulled last, in floats. The pointers last until the next `quarc_dequantize`
/// or `quarc_close`, also while the next frame is pulled. QUARC_OK, or QUARC_MISUSE where there
/// is no state.
///
/// `decoder` is NULL or open; `splats` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_dequantize(
    decoder: *mut DecoderHandle,
    splats: *mut SplatsView,
) -> i32 {
    let dequantize = |decoder: &mut AnyDecoder| {
        let (state, numbers, redone) = decoder.dequantize()?;
        // SAFETY: as the caller says.
        unsafe { write(splats, SplatsView::of(state, numbers, redone)) }
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, dequantize) }
}

/// What is missing, after QUARC_GAP. `reject_id` lasts until the next `quarc_pull` or
/// `quarc_close`. QUARC_OK, or QUARC_MISUSE where the last pull came to no gap.
///
/// `decoder` is NULL or open; `gap` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_gap(decoder: *mut DecoderHandle, gap: *mut GapView) -> i32 {
    let show = |decoder: &mut AnyDecoder| {
        let (found, id) = decoder.gap()?;
        // SAFETY: as the caller says.
        unsafe { write(gap, GapView::of(found, id)) }
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, show) }
}

/// The reject id of SPEC 3.3 after QUARC_REJECTED, else NULL. It lasts until `quarc_close`.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_reject_id(decoder: *const DecoderHandle) -> *const c_char {
    // SAFETY: as the caller says.
    let handle = unsafe { decoder.as_ref() };
    handle.and_then(|handle| handle.decoder.reject_id()).map_or(ptr::null(), CStr::as_ptr)
}

/// What is wrong with the stream, for people; NULL where nothing is. It lasts until `quarc_close`.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_message(decoder: *const DecoderHandle) -> *const c_char {
    // SAFETY: as the caller says.
    let handle = unsafe { decoder.as_ref() };
    handle.and_then(|handle| handle.decoder.message()).map_or(ptr::null(), CStr::as_ptr)
}

/// Do something with a decoder, to whose end no panic comes; `None` is what has no meaning.
///
/// # Safety
/// `handle` is null, or a decoder that is open and that nobody else uses meanwhile.
pub(crate) unsafe fn call(
    handle: *mut DecoderHandle,
    act: impl FnOnce(&mut AnyDecoder) -> Option<i32>,
) -> i32 {
    // SAFETY: as the caller says.
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

/// Give a value to the caller, who may not want it.
///
/// # Safety
/// `place` is null or has room.
pub(crate) unsafe fn write<T>(place: *mut T, value: T) -> Option<i32> {
    if place.is_null() {
        return None;
    }
    // SAFETY: as the caller says.
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
            quarc_close(&mut decoder);
        }
        assert!(decoder.is_null());
    }
}
