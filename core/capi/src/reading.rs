//! Streams read by byte ranges, as by range requests; cameras, metadata and the index.

use crate::decoder::AnyDecoder;
use crate::views::{CameraView, EntryView, StateView};
use crate::{call, hand_out, write, DecoderHandle, QUARC_MISUSE, QUARC_OK};

/// Open a decoder of the frames from ordinal `start` on that reads only the byte ranges it needs.
/// After `quarc_pull` returned QUARC_OK, `quarc_missing` tells which bytes it waits for;
/// `quarc_put` passes them. The decoder discards bytes that it no longer needs.
#[no_mangle]
pub extern "C" fn quarc_open_parts(start: u32) -> *mut DecoderHandle {
    hand_out(AnyDecoder::in_parts(start))
}

/// Pass `length` bytes from `offset` of the stream; they are copied. Returns QUARC_OK, or
/// QUARC_MISUSE if the decoder was not opened for byte ranges, or if the bytes end above 2^64 - 1.
///
/// `decoder` is NULL or open; `bytes` points to `length` bytes, or `length` is 0.
#[no_mangle]
pub unsafe extern "C" fn quarc_put(
    decoder: *mut DecoderHandle,
    offset: u64,
    bytes: *const u8,
    length: usize,
) -> i32 {
    let bytes = match length {
        0 => &[][..],
        _ if bytes.is_null() || length > isize::MAX as usize => return QUARC_MISUSE,
        // SAFETY: guaranteed by the caller.
        _ => unsafe { std::slice::from_raw_parts(bytes, length) },
    };
    if offset.checked_add(length as u64).is_none() {
        return QUARC_MISUSE;
    }
    let put = |decoder: &mut AnyDecoder| decoder.put(offset, bytes).then_some(QUARC_OK);
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, put) }
}

/// Set the length of the whole stream in bytes, as soon as it is known. Do not call this for a stream
/// that is still being written: TAIL then ends it, whatever follows. Returns QUARC_OK, or
/// QUARC_MISUSE if the decoder was not opened for byte ranges.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_limit(decoder: *mut DecoderHandle, size: u64) -> i32 {
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, |decoder| decoder.limit(size).then_some(QUARC_OK)) }
}

/// Get the bytes that the last `quarc_pull` or `quarc_index` lacked: `range[0]` to `range[1]` - 1.
/// Returns QUARC_OK, or QUARC_MISUSE if none are missing.
///
/// `decoder` is NULL or open; `range` is NULL or has room for two numbers.
#[no_mangle]
pub unsafe extern "C" fn quarc_missing(decoder: *mut DecoderHandle, range: *mut u64) -> i32 {
    let tell = |decoder: &mut AnyDecoder| {
        let (place, end) = decoder.missing()?;
        // SAFETY: guaranteed by the caller.
        unsafe { write(range.cast(), [place, end]) }
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, tell) }
}

/// Get the byte offset of the chunk after the last frame. Returns QUARC_OK, or QUARC_MISUSE if it is
/// not yet known or the decoder was not opened for byte ranges.
///
/// `decoder` is NULL or open; `offset` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_offset(decoder: *mut DecoderHandle, offset: *mut u64) -> i32 {
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, |decoder| write(offset, decoder.offset()?)) }
}

/// Preview a canonical frame while the rest of its chunk is still missing: a picture to show while
/// loading. Call it after `quarc_pull` returned QUARC_OK. QUARC_FRAME: more has arrived since the
/// last call. `state` is filled; `sections` is the number of sections of SPEC 8.5 that have been
/// decoded, positions first; until theirs, rotations are the identity and other numbers 0. QUARC_OK:
/// there is nothing new. A preview is not CRC-checked; `quarc_pull` reports its errors. The
/// pointers are valid until the next `quarc_preview`, `quarc_pull` or `quarc_close`.
///
/// `decoder` is NULL or open; `state` and `sections` are NULL or have room.
#[no_mangle]
pub unsafe extern "C" fn quarc_preview(
    decoder: *mut DecoderHandle,
    state: *mut StateView,
    sections: *mut u32,
) -> i32 {
    let show = |decoder: &mut AnyDecoder| {
        if state.is_null() || sections.is_null() {
            return None;
        }
        let Some((known, preview)) = decoder.preview() else { return Some(QUARC_OK) };
        // SAFETY: guaranteed by the caller.
        unsafe { write(state, StateView::of(preview))? };
        // SAFETY: guaranteed by the caller.
        unsafe { write(sections, known as u32)? };
        Some(crate::QUARC_FRAME)
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, show) }
}

/// Read the index at the end of a complete stream: it has `numbers[0]` frames, of which `numbers[1]`
/// are canonical. The ordinals of the first `room` of these are written to `frames`. QUARC_FRAME:
/// success. QUARC_OK: bytes are missing, which `quarc_missing` returns; if it returns none, the stream
/// has no intact INDX, or the decoder was not opened for byte ranges. The index is not yet compared
/// with the frames; seeking to a frame reports its errors.
///
/// `decoder` is NULL or open; `numbers` is NULL or has room for two numbers; `frames` has room for
/// `room` numbers, or `room` is 0.
#[no_mangle]
pub unsafe extern "C" fn quarc_index(
    decoder: *mut DecoderHandle,
    numbers: *mut u32,
    frames: *mut u32,
    room: usize,
) -> i32 {
    let tell = |decoder: &mut AnyDecoder| {
        if numbers.is_null() || (frames.is_null() && room > 0) {
            return None;
        }
        let Ok(Some((tail, points))) = decoder.find_index() else { return Some(QUARC_OK) };
        // SAFETY: guaranteed by the caller.
        unsafe { write(numbers.cast(), [tail.frame_count, points.len() as u32])? };
        for (place, point) in points.iter().take(room).enumerate() {
            // SAFETY: guaranteed by the caller.
            unsafe { frames.add(place).write(point.frame) };
        }
        Some(crate::QUARC_FRAME)
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, tell) }
}

/// Get a camera of the stream by its number, from 0, once `quarc_pull` has read `came`: before the
/// first frame, if the stream has it there. Its name is valid until the next `quarc_pull` or
/// `quarc_close`. Returns QUARC_OK, or QUARC_MISUSE if there is no such camera.
///
/// `decoder` is NULL or open; `camera` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_camera(
    decoder: *mut DecoderHandle,
    number: usize,
    camera: *mut CameraView,
) -> i32 {
    let show = |decoder: &mut AnyDecoder| {
        let found = decoder.stream()?.cameras().get(number)?;
        // SAFETY: guaranteed by the caller.
        unsafe { write(camera, CameraView::of(found)) }
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, show) }
}

/// Get a metadata entry of the stream, likewise. Its texts are valid until the next `quarc_pull` or
/// `quarc_close`.
///
/// `decoder` is NULL or open; `entry` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_metadata(
    decoder: *mut DecoderHandle,
    number: usize,
    entry: *mut EntryView,
) -> i32 {
    let show = |decoder: &mut AnyDecoder| {
        let found = decoder.stream()?.metadata().get(number)?;
        // SAFETY: guaranteed by the caller.
        unsafe { write(entry, EntryView::of(found)) }
    };
    // SAFETY: guaranteed by the caller.
    unsafe { call(decoder, show) }
}
