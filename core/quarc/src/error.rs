//! Errors, with a stable id for each reason to reject a stream: SPEC 3.3.

use std::fmt;

/// Why a stream is rejected: a row of the table in SPEC 3.3. Later versions may add reasons.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
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
    /// A sequence number is not the next one (SPEC 5.2).
    Sequence,
    /// A type does not match one of the patterns of four letters (SPEC 5.2).
    BadChunkType,
    /// A chunk of this type is not allowed at this place (SPEC 5.1).
    ChunkOrder,
    /// A critical chunk of an unknown type (SPEC 5.2).
    UnknownCritical,
    /// A payload is longer than the level, or HEAD_BYTES_LIMIT, allows (SPEC 3.2, 5.2).
    ChunkExceedsLevel,
    /// Bytes follow TAIL, or the last field of a payload (SPEC 5.1, 5).
    TrailingData,
    /// A field of TAIL, such as `index_offset`, does not match the stream (SPEC 5.8).
    TailMismatch,
    /// INDX does not match the stream or, when seeking, the chunk that TAIL or INDX points at is
    /// not the expected one (SPEC 5.9, 11.2).
    IndexMismatch,
    /// The stream has another major version (SPEC 12).
    UnsupportedVersion,
    /// An incompatible feature is unknown (SPEC 12).
    UnsupportedFeature,
    /// A field is missing or outside its range (SPEC 5).
    Field,
    /// A probability code of 240 or more (SPEC 8.2).
    BadProbability,
    /// The last word of a section is 0 (SPEC 8.3).
    InvalidWords,
    /// The coder is not empty after the last plane (SPEC 8.3).
    UnconsumedWords,
    /// An ascending number grows by too much, a key is outside its box, an update rotates by too
    /// much, or a snapshot is too wide (SPEC 7.8, 7.9, 8.4, 8.5).
    SymbolRange,
    /// The level does not allow so many Gaussians or births, or the ids run out (SPEC 3.2, 7.6).
    CountExceedsLevel,
    /// A canonical frame has no Gaussians, or deaths or updates leave none (SPEC 7.2, 7.4, 7.8,
    /// 7.9).
    Count,
    /// A frame's ordinal or phase is not the next one, or a snapshot refers to another CANO than
    /// the last one (SPEC 7.2, 7.4, 7.9).
    FrameOrder,
    /// A position is beyond POSITION_LIMIT (SPEC 7.2, 7.5, 7.6, 7.8, 7.9).
    PositionRange,
    /// An attribute code is beyond CODE_LIMIT (SPEC 7.2, 7.6, 7.8, 7.9).
    CodeRange,
    /// Three components are longer than a unit quaternion (SPEC 7.2, 7.6, 7.9).
    RotationRange,
    /// A rotation has norm zero (SPEC 7.3).
    DegenerateRotation,
    /// The parent of a new Gaussian is not in the scene (SPEC 7.6).
    ParentRange,
    /// The state does not match the CRC of its frame (SPEC 9.2).
    StateCrc,
}

impl Reject {
    /// The stable id of SPEC 3.3, which `Display` writes, too.
    ///
    /// ```
    /// use quarc::error::Reject;
    ///
    /// assert_eq!(Reject::BadMagic.id(), "bad-magic");
    /// assert_eq!(format!("{:>10}", Reject::BadMagic), " bad-magic");
    /// ```
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

impl fmt::Display for Reject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.id())
    }
}

/// An error of reading or writing a stream.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The stream is malformed.
    Rejected {
        /// The reason.
        reject: Reject,
        /// What was found, for people.
        message: String,
        /// The byte offset in the stream at which it was found, if known.
        offset: Option<u64>,
    },
    /// A stream of the unlimited level exceeds the limits of this decoder (SPEC 3.2).
    Limit(String),
    /// A scene cannot be encoded.
    Encode(String),
    /// The source of the stream failed to read.
    Source(String),
}

/// The result type of most functions of this crate.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// A rejection without a byte offset.
    #[must_use]
    #[cold]
    pub fn new(reject: Reject, message: impl Into<String>) -> Self {
        Error::Rejected { reject, message: message.into(), offset: None }
    }

    /// Set the byte offset, unless it is set already.
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

    /// The reason in SPEC 3.3, if the stream was rejected.
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
                write!(f, "{reject} at byte {place}: {message}")
            }
            Error::Rejected { reject, message, offset: None } => {
                write!(f, "{reject}: {message}")
            }
            Error::Limit(message) | Error::Encode(message) | Error::Source(message) => {
                f.write_str(message)
            }
        }
    }
}

impl std::error::Error for Error {}
