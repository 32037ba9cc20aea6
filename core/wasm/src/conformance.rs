//! What the conformance suite asks of the building blocks, in a module of its own for it.

use crate::quarc_allocate;
use std::ptr;

/// Do a job of the conformance suite (conformance/RUNNER.md): `request` is a line of JSON of
/// `size` bytes, or nothing to be told what can be asked. The answer's lines are `answer[0]`
/// bytes at `answer[1]`, which `quarc_free` takes back. Returns 0, or -1 where this is no job.
///
/// # Safety
/// `request` points to `size` bytes, `answer` to two numbers.
#[no_mangle]
pub unsafe extern "C" fn quarc_conformance_job(
    request: *const u8,
    size: usize,
    answer: *mut [usize; 2],
) -> i32 {
    // SAFETY: as the caller says.
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
    // SAFETY: there is room for as many bytes; `answer` is as the caller says.
    unsafe {
        ptr::copy_nonoverlapping(lines.as_ptr(), place, lines.len());
        answer.write([lines.len(), place as usize]);
    }
    0
}
