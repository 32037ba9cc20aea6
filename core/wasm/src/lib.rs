//! The C interface as a WebAssembly module: functions on linear memory, without generated glue
//! code. The page manages memory with `quarc_allocate` and `quarc_free`.

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]

#[cfg(feature = "conformance")]
mod conformance;

pub use quarc_capi::*;

use std::alloc::{alloc_zeroed, dealloc, Layout};
use std::ptr;

/// Alignment of all memory that the page writes to.
const ALIGNMENT: usize = 8;

/// Allocate `size` zeroed bytes; null if this fails. Free them with `quarc_free`.
#[no_mangle]
pub extern "C" fn quarc_allocate(size: usize) -> *mut u8 {
    match Layout::from_size_align(size.max(1), ALIGNMENT) {
        // SAFETY: the size is not zero.
        Ok(layout) => unsafe { alloc_zeroed(layout) },
        Err(_) => ptr::null_mut(),
    }
}

/// Free memory.
///
/// # Safety
/// `place` is null, or `size` bytes that `quarc_allocate` returned and that have not been freed.
#[no_mangle]
pub unsafe extern "C" fn quarc_free(place: *mut u8, size: usize) {
    if let (false, Ok(layout)) = (place.is_null(), Layout::from_size_align(size.max(1), ALIGNMENT))
    {
        // SAFETY: guaranteed by the caller.
        unsafe { dealloc(place, layout) };
    }
}
