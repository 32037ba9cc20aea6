//! The parts of frames, against the conformance suite.

#[path = "../known/mod.rs"]
mod known;

mod floats;
mod searches;
mod steps;
mod streams;
mod units;
mod writers;
