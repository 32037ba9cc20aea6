//! The anchors (SPEC 6) against unit vectors and a direct implementation of the text.

#[path = "../known/mod.rs"]
mod known;
mod known_answers;
mod lifetimes;
mod oracle;
mod scenes;
mod search;
#[cfg(feature = "threads")]
mod threads;
