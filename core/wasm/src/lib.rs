//! The C interface as a module for the web: functions on linear memory, without glue of their
//! own. What C does by itself, the page does by `quarc_allocate` and `quarc_free`.

#![deny(unsafe_op_in_unsafe_fn)]
#![warn(missing_docs)]

#[cfg(feature = "conformance")]
mod conformance;

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
