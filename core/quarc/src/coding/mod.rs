//! Entropy coding: SPEC 8. Numbers are split into planes of bits, and planes are coded as the words
//! of a section.
//!
//! Every walk over planes is written once for both directions: see [`planes::Planes`].

pub mod births; // SPEC 8.6
pub mod canonical; // SPEC 8.5
pub mod channels; // SPEC 8.7
pub mod counts; // SPEC 8.2
pub mod grid; // SPEC 5.4
pub mod motion; // SPEC 8.7
pub mod numbers; // SPEC 8.4
mod parts; // SPEC 8.4
pub mod planes; // SPEC 8.1
pub mod probability; // SPEC 8.2
mod rows; // rows of numbers, as in 8.5, 8.6 and 8.9
pub mod sequence; // SPEC 8.4
pub mod snapshot; // SPEC 7.9
pub mod sorting; // SPEC 8.1
pub mod survivors; // SPEC 8.9
pub mod updates; // SPEC 8.8
pub mod words; // SPEC 8.3
