//! Everything that can be rejected, by its stable name: SPEC 3.3.

use std::fmt;

/// Why a stream is rejected: a row of the table of SPEC 3.3.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reject {
    /// The stream does not begin with the magic (SPEC 5.1).
    BadMagic,
    /// The bytes end inside a chunk, or before TAIL (SPEC 5.1).
    Truncated,
    /// A chunk does not begin with the sync word (SPEC 5.2).
    BadSync,
    /// A chunk header does not match its CRC (SPEC 5.2).
    HeaderCrc,
    /// A payload does not match its CRC (SPEC 5.2).
    PayloadCrc,
    /// A chunk's sequence number is not the next (SPEC 5.2).
    Sequence,
    /// A type is not four letters in one of the patterns (SPEC 5.2).
    BadChunkType,
    /// A chunk stands where its type may not (SPEC 5.1).
    ChunkOrder,
    /// A critical chunk of an unknown type (SPEC 5.2).
    UnknownCritical,
    /// A payload is longer than the level, or HEAD_BYTES_LIMIT, allows (SPEC 3.2, 5.2).
    ChunkExceedsLevel,
    /// Bytes follow TAIL, or the last field of a payload (SPEC 5.1, 5).
    TrailingData,
    /// A field of TAIL, `index_offset` among them, is not that of the stream (SPEC 5.8).
    TailMismatch,
    /// INDX is not that of the stream or, when seeking, TAIL or INDX points at nothing that fits (SPEC 5.9, 11.2).
    IndexMismatch,
    /// The stream is of another version (SPEC 12).
    UnsupportedVersion,
    /// An incompatible feature is not known (SPEC 12).
    UnsupportedFeature,
    /// A field is missing or outside its range (SPEC 5).
    Field,
    /// A probability code of 240 or more (SPEC 8.2).
    BadProbability,
    /// The last word of a section is 0 (SPEC 8.3).
    InvalidWords,
    /// The coder is not empty after the last plane (SPEC 8.3).
    UnconsumedWords,
    /// An ascending number grows too fast, a key is outside its box, an update turns too far, or a snapshot is too wide (SPEC 7.8, 7.9, 8.4, 8.5).
    SymbolRange,
    /// More Gaussians or births than the level allows, or ids than there are (SPEC 3.2, 7.6).
    CountExceedsLevel,
    /// No Gaussian in a canonical frame, or none left by deaths or updates (SPEC 7.2, 7.4, 7.8, 7.9).
    Count,
    /// A frame's ordinal or phase is not the next, or a snapshot names another CANO than the last (SPEC 7.2, 7.4, 7.9).
    FrameOrder,
    /// A position is beyond POSITION_LIMIT (SPEC 7.2, 7.5, 7.6, 7.8, 7.9).
    PositionRange,
    /// An attribute code is beyond CODE_LIMIT (SPEC 7.2, 7.6, 7.8, 7.9).
    CodeRange,
    /// Three components are longer than a unit quaternion (SPEC 7.2, 7.6, 7.9).
    RotationRange,
    /// A rotation has norm zero (SPEC 7.3).
    DegenerateRotation,
    /// A newborn's parent is not in the scene (SPEC 7.6).
    ParentRange,
    /// The state does not match the CRC of its frame (SPEC 9.2).
    StateCrc,
}

impl Reject {
    /// The stable name of SPEC 3.3.
    #[must_use]
    pub const fn id(self) -> &'static str {
        match self {
            Reject::BadMagic => "bad-magic",
            Reject::Truncated => "truncated",
            Reject::BadSync => "bad-sync",
            Reject::HeaderCrc => "header-crc",
            Reject::PayloadCrc => "payload-crc",
            Reject::Sequence => "sequence",
            Reject::BadChunkType => "bad-chunk-type",
            Reject::ChunkOrder => "chunk-order",
            Reject::UnknownCritical => "unknown-critical",
            Reject::ChunkExceedsLevel => "chunk-exceeds-level",
            Reject::TrailingData => "trailing-data",
            Reject::TailMismatch => "tail-mismatch",
            Reject::IndexMismatch => "index-mismatch",
            Reject::UnsupportedVersion => "unsupported-version",
            Reject::UnsupportedFeature => "unsupported-feature",
            Reject::Field => "field",
            Reject::BadProbability => "bad-probability",
            Reject::InvalidWords => "invalid-words",
            Reject::UnconsumedWords => "unconsumed-words",
            Reject::SymbolRange => "symbol-range",
            Reject::CountExceedsLevel => "count-exceeds-level",
            Reject::Count => "count",
            Reject::FrameOrder => "frame-order",
            Reject::PositionRange => "position-range",
            Reject::CodeRange => "code-range",
            Reject::RotationRange => "rotation-range",
            Reject::DegenerateRotation => "degenerate-rotation",
            Reject::ParentRange => "parent-range",
            Reject::StateCrc => "state-crc",
        }
    }
}

/// What goes wrong while a stream is read or written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Error {
    /// The bytes are no valid stream.
    Rejected {
        /// Why.
        reject: Reject,
        /// What was found, for people.
        message: String,
        /// Where in the stream it was found, in bytes, if known.
        offset: Option<u64>,
    },
    /// A stream of the unlimited level asks for more than this decoder gives (SPEC 3.2).
    Limit(String),
    /// A scene cannot be written into a stream.
    Encode(String),
    /// What holds the bytes of a stream does not give them.
    Source(String),
}

/// What most functions of this crate return.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A rejection at a place that is not known yet.
    #[must_use]
    #[cold]
    pub fn new(reject: Reject, message: impl Into<String>) -> Self {
        Error::Rejected { reject, message: message.into(), offset: None }
    }

    /// The same, found at a byte of the stream, unless a place is known already.
    #[must_use]
    #[cold]
    pub fn at(self, place: u64) -> Self {
        match self {
            Error::Rejected { reject, message, offset } => {
                Error::Rejected { reject, message, offset: offset.or(Some(place)) }
            }
            other => other,
        }
    }

    /// The row of SPEC 3.3, if the bytes are at fault.
    #[must_use]
    pub const fn reject(&self) -> Option<Reject> {
        match self {
            Error::Rejected { reject, .. } => Some(*reject),
            _ => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Rejected { reject, message, offset: Some(place) } => {
                write!(f, "{} at byte {place}: {message}", reject.id())
            }
            Error::Rejected { reject, message, offset: None } => {
                write!(f, "{}: {message}", reject.id())
            }
            Error::Limit(message) | Error::Encode(message) | Error::Source(message) => {
                f.write_str(message)
            }
        }
    }
}

impl std::error::Error for Error {}
