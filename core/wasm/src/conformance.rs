//! Answers to the conformance suite, in a separate module with the building blocks.

use crate::quarc_allocate;
use std::ptr;

/// Do a job of the conformance suite (conformance/RUNNER.md): `request` is a line of JSON of `size`
/// bytes, or empty to ask for the capabilities. The answer is `answer[0]` bytes at `answer[1]`, to
/// be freed with `quarc_free`. Returns 0, or -1 if the job is malformed.
///
/// # Safety
/// `request` points to `size` bytes, `answer` to two numbers.
#[no_mangle]
pub unsafe extern "C" fn quarc_conformance_job(
    request: *const u8,
    size: usize,
    answer: *mut [usize; 2],
) -> i32 {
    // SAFETY: guaranteed by the caller.
    let line = unsafe { std::slice::from_raw_parts(request, size) };
    let mut lines = Vec::new();
    let answered = match line {
        [] => quarc_conformance::answer_capabilities(&mut lines),
        line => quarc_conformance::answer_job(line, &[], &mut lines),
    };
    let place = if answered.is_ok() { quarc_allocate(lines.len()) } else { ptr::null_mut() };
    if place.is_null() {
        return -1;
    }
    // SAFETY: the allocation has the length of the bytes; `answer` is guaranteed by the caller.
    unsafe {
        ptr::copy_nonoverlapping(lines.as_ptr(), place, lines.len());
        answer.write([lines.len(), place as usize]);
    }
    0
}
