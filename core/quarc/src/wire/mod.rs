//! Payloads to records and back: SPEC 5.
//!
//! Each `parse` function takes a payload with a correct CRC. It returns `field` if a field is
//! missing or out of range, and `trailing-data` if bytes follow the last field.

mod fields;
mod frames;
mod head;
mod side;

pub use frames::{
    build_canonical, build_frame, build_snapshot, parse_canonical, parse_canonical_start,
    parse_frame, parse_section, parse_snapshot, CANONICAL_START_BYTES,
};
pub use head::{build_header, parse_header};
pub use side::{
    build_cameras, build_index, build_metadata, build_tail, parse_cameras, parse_index,
    parse_metadata, parse_tail, Camera, Metadata,
};
