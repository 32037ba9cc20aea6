//! Streams that are read in parts, as by range requests; and what a stream says beside its frames.

use crate::decoder::AnyDecoder;
use crate::views::{CameraView, EntryView, StateView};
use crate::{call, hand_out, write, DecoderHandle, QUARC_MISUSE, QUARC_OK};

/// A decoder of the frames from ordinal `start` on that reads a stream in parts, where it needs
/// them. While `quarc_pull` says QUARC_OK, `quarc_missing` says which bytes it waits for;
/// `quarc_put` hands them over. It keeps no more of them than it still needs.
#[no_mangle]
pub extern "C" fn quarc_open_parts(start: u32) -> *mut DecoderHandle {
    hand_out(AnyDecoder::in_parts(start))
}

/// Hand over `length` bytes that stand at `offset` of the stream; they are copied. QUARC_OK, or
/// QUARC_MISUSE of a decoder that is not one of parts.
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
        // SAFETY: as the caller says.
        _ => unsafe { std::slice::from_raw_parts(bytes, length) },
    };
    let put = |decoder: &mut AnyDecoder| decoder.put(offset, bytes).then_some(QUARC_OK);
    // SAFETY: as the caller says.
    unsafe { call(decoder, put) }
}

/// Say how many bytes the whole stream has, as soon as that is known; of one that is still being
/// written it is not, and then TAIL ends it, whatever follows. QUARC_OK, or QUARC_MISUSE of a decoder that is not one of parts.
///
/// `decoder` is NULL or open.
#[no_mangle]
pub unsafe extern "C" fn quarc_limit(decoder: *mut DecoderHandle, size: u64) -> i32 {
    // SAFETY: as the caller says.
    unsafe { call(decoder, |decoder| decoder.limit(size).then_some(QUARC_OK)) }
}

/// Which bytes the last `quarc_pull` or `quarc_index` lacked: from `range[0]` up to `range[1]`.
/// QUARC_OK, or QUARC_MISUSE where none are missing.
///
/// `decoder` is NULL or open; `range` is NULL or has room for two numbers.
#[no_mangle]
pub unsafe extern "C" fn quarc_missing(decoder: *mut DecoderHandle, range: *mut u64) -> i32 {
    let tell = |decoder: &mut AnyDecoder| {
        let (place, end) = decoder.missing()?;
        // SAFETY: as the caller says.
        unsafe { write(range.cast(), [place, end]) }
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, tell) }
}

/// Where the chunk after the last frame begins, in bytes. QUARC_OK, or QUARC_MISUSE before that is
/// known, and of a decoder that is not one of parts.
///
/// `decoder` is NULL or open; `offset` is NULL or has room.
#[no_mangle]
pub unsafe extern "C" fn quarc_offset(decoder: *mut DecoderHandle, offset: *mut u64) -> i32 {
    // SAFETY: as the caller says.
    unsafe { call(decoder, |decoder| write(offset, decoder.offset()?)) }
}

/// What a canonical frame shows while the rest of its chunk is still missing: a picture while
/// loading. After `quarc_pull` has said QUARC_OK. QUARC_FRAME: more of it has become known since the
/// last call. `state` is filled; the sections of SPEC 8.5 that are known, from positions on, are
/// `sections`, rotations are the identity before theirs, and other numbers 0. QUARC_OK: there is
/// nothing new. No CRC proves it yet, and what is wrong with it is told by `quarc_pull`. Its
/// pointers last until the next `quarc_preview`, `quarc_pull` or `quarc_close`.
///
/// `decoder` is NULL or open; `state` and `sections` are NULL or have room.
#[no_mangle]
pub unsafe extern "C" fn quarc_preview(
    decoder: *mut DecoderHandle,
    state: *mut StateView,
    sections: *mut u32,
) -> i32 {
    let show = |decoder: &mut AnyDecoder| {
        let Some((known, preview)) = decoder.preview() else { return Some(QUARC_OK) };
        // SAFETY: as the caller says.
        unsafe { write(state, StateView::of(preview))? };
        // SAFETY: as the caller says.
        unsafe { write(sections, known as u32)? };
        Some(crate::QUARC_FRAME)
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, show) }
}

/// What the end of a whole stream says of it: `numbers[0]` frames, `numbers[1]` of which are
/// canonical. The ordinals of the first `room` of these go to `frames`. QUARC_OK: bytes are
/// missing for that, or the stream has no INDX. QUARC_FRAME: it is done. Nothing is compared with
/// the frames yet, and what is wrong there is told when a frame is sought.
///
/// `decoder` is NULL or open; `numbers` has room for two, `frames` for `room` numbers.
#[no_mangle]
pub unsafe extern "C" fn quarc_index(
    decoder: *mut DecoderHandle,
    numbers: *mut u32,
    frames: *mut u32,
    room: usize,
) -> i32 {
    let tell = |decoder: &mut AnyDecoder| {
        let Ok(Some((tail, points))) = decoder.find_index() else { return Some(QUARC_OK) };
        if numbers.is_null() || frames.is_null() {
            return None;
        }
        // SAFETY: as the caller says.
        unsafe { numbers.cast::<[u32; 2]>().write([tail.frame_count, points.len() as u32]) };
        for (place, point) in points.iter().take(room).enumerate() {
            // SAFETY: as the caller says.
            unsafe { frames.add(place).write(point.frame) };
        }
        Some(crate::QUARC_FRAME)
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, tell) }
}

/// A camera of the stream, by its number from 0 on, once `came` has been pulled over: before the
/// first frame, where the stream has it there. Its name lasts until the next `quarc_pull`.
/// QUARC_OK, or QUARC_MISUSE where there is no such camera.
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
        // SAFETY: as the caller says.
        unsafe { write(camera, CameraView::of(found)) }
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, show) }
}

/// An entry of the stream's metadata, in the same way. Its texts last until the next `quarc_pull`.
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
        // SAFETY: as the caller says.
        unsafe { write(entry, EntryView::of(found)) }
    };
    // SAFETY: as the caller says.
    unsafe { call(decoder, show) }
}
