//! The anchors (SPEC 6) against known answers and against the plain words of the text.

#[path = "../known/mod.rs"]
mod known;
mod known_answers;
mod lifetimes;
mod oracle;
mod scenes;
mod search;
#[cfg(feature = "threads")]
mod threads;
