//! Decoder and coder of `.quarc` streams (SPEC.md 1.1), exact to the bit.
//!
//! The modules stand in the order of the text. Comments name the clause that a line carries
//! out, as `[7.4-3]`.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod constants; // SPEC 3
pub mod error; // SPEC 3.3
pub mod records; // SPEC 5
pub mod rows; // how the planes of a state stand

mod parallel; // work that threads share

pub mod arithmetic; // SPEC 4
pub mod chunks; // SPEC 5.1, 5.2
pub mod reader; // the chunks of a stream that can be read anywhere
pub mod source; // what a stream is read from
pub mod wire; // SPEC 5
pub mod writer; // a stream chunk by chunk

pub mod anchors; // SPEC 6
pub mod morton; // SPEC 6.3, 8.5
pub mod philox; // SPEC 6.2

pub mod coding; // SPEC 8
pub mod digest; // SPEC 9
pub mod floats; // SPEC 10
pub mod rotation; // SPEC 7.2, 7.3, 7.5
pub mod state; // SPEC 7

pub mod preview; // SPEC 8.5
pub mod recover; // SPEC 11.4
pub mod seek; // SPEC 11.2
pub mod stream; // push bytes, pull states: SPEC 5.8, 5.9, 7.2, 7.9
