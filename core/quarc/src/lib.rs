//! Bit-exact decoder and encoder of `.quarc` streams (SPEC.md 1.1).
//!
//! To decode a stream, start with one of these types; each returns the [`State`](state::State) of
//! every frame, which a [`Dequantizer`](floats::Dequantizer) converts to floats:
//!
//! - [`Decoder`](stream::Decoder): all frames, as the bytes of the stream arrive
//! - [`SeekDecoder`](seek::SeekDecoder): the frames from a given one on, from a
//!   [`Source`](source::Source) with random access, such as a file
//! - [`Recovery`](recover::Recovery): the intact frames of a damaged stream, and its gaps
//!
//! To write a stream, see [`writer`]: encoders take the same [`State`](state::State) from frame to
//! frame as decoders.
//!
//! Decoders, parsers, [`writer`] and the methods of [`State`](state::State) return errors, whatever
//! their arguments are. The functions of [`anchors`], [`coding`], [`rotation`] and [`rows`], which
//! they consist of, expect arguments as described there, and may panic with others.
//!
//! With the feature `threads`, a call within a rayon pool uses the threads of the pool.
//!
//! The modules follow the order of SPEC. Comments name the clause that a line implements, such as
//! `[7.4-3]`.

#![forbid(unsafe_code)]
#![warn(missing_docs)]

pub mod constants; // SPEC 3
pub mod error; // SPEC 3.3
pub mod records; // SPEC 5
pub mod rows; // the memory layout of a state's planes

mod parallel; // work shared among threads
mod shared; // arrays shared among states

pub mod arithmetic; // SPEC 4
pub mod chunks; // SPEC 5.1, 5.2
pub mod reader; // chunks of a stream with random access
pub mod source; // where the bytes of a stream come from
pub mod wire; // SPEC 5
pub mod writer; // writing a stream chunk by chunk

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
