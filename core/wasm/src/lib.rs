//! The C interface as a module for the web: functions on linear memory, without glue of their
//! own. What C does by itself, the page does by `quarc_allocate` and `quarc_free`.

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]

pub use quarc_capi::*;

use std::alloc::{alloc_zeroed, dealloc, Layout};
use std::ptr;

/// What all that the page writes to is aligned to.
const ALIGNMENT: usize = 8;

/// Room for `size` bytes, zeroed; null where there is none. `quarc_free` takes it back.
#[no_mangle]
pub extern "C" fn quarc_allocate(size: usize) -> *mut u8 {
    match Layout::from_size_align(size.max(1), ALIGNMENT) {
        // SAFETY: the size is not zero.
        Ok(layout) => unsafe { alloc_zeroed(layout) },
        Err(_) => ptr::null_mut(),
    }
}

/// Take back room.
///
/// # Safety
/// `place` is null, or room for `size` bytes that `quarc_allocate` gave and that is not yet back.
#[no_mangle]
pub unsafe extern "C" fn quarc_free(place: *mut u8, size: usize) {
    if let (false, Ok(layout)) = (place.is_null(), Layout::from_size_align(size.max(1), ALIGNMENT))
    {
        // SAFETY: as the caller says.
        unsafe { dealloc(place, layout) };
    }
}

/// Do a job of the conformance suite (conformance/RUNNER.md): `request` is a line of JSON, and
/// behind it stand the bytes of the stream. The answer's lines are `answer[0]` bytes at
/// `answer[1]`, both for `quarc_free`. Returns 0, or -1 where this is no job.
///
/// # Safety
/// `request` points to `request_size + stream_size` bytes, `answer` to two numbers.
#[no_mangle]
pub unsafe extern "C" fn quarc_conformance_job(
    request: *const u8,
    request_size: usize,
    stream_size: usize,
    answer: *mut [usize; 2],
) -> i32 {
    // SAFETY: as the caller says.
    let bytes = unsafe { std::slice::from_raw_parts(request, request_size + stream_size) };
    let (line, stream) = bytes.split_at(request_size);
    let mut lines = Vec::new();
    let answered = match request_size {
        0 => quarc_conformance::answer_capabilities(&mut lines),
        _ => quarc_conformance::answer_job(line, stream, &mut lines),
    };
    let place = if answered.is_ok() { quarc_allocate(lines.len()) } else { ptr::null_mut() };
    if place.is_null() {
        return -1;
    }
    // SAFETY: there is room for as many bytes; `answer` is as the caller says.
    unsafe {
        ptr::copy_nonoverlapping(lines.as_ptr(), place, lines.len());
        answer.write([lines.len(), place as usize]);
    }
    0
}
