"""The errors of this package, and the reject ids of invalid streams: SPEC 3.3.

    QuarcError
    ├── BitstreamError            the bytes are not a valid stream
    │   ├── ContainerError        the framing, chunk order, version or a field is invalid
    │   ├── EntropyError          coded planes are malformed
    │   └── StateError            a frame would make the scene invalid
    ├── LimitError                the stream exceeds the limits of this decoder
    ├── SourceError               the file, pipe or server cannot be read
    ├── EnvironmentVariableError  an environment variable has an invalid value
    ├── EncodeError               a scene or setting cannot be represented in a stream
    │   ├── UnusableCaptureError  the cameras of a capture see too little of the scene
    │   └── BoundError            a decoded frame exceeds its error bounds (a bug)
    ├── ResumeError               the stream cannot be resumed with these inputs
    ├── EditError                 streams cannot be cut or joined as requested
    ├── ClosedLoopError           the states of encoder and decoder differ (a bug)
    └── VerificationError         two methods for the same result disagree (a bug)

Malformed bytes raise only leaf classes of `BitstreamError`. Each leaf class has the stable
`reject_id` of its row in SPEC 3.3.
"""

from typing import ClassVar


class QuarcError(Exception):
    """Base class of all errors of this package."""


class BitstreamError(QuarcError):
    """The bytes are not a valid stream.

    Attributes:
        reject_id: Stable reject id (SPEC 3.3).
        offset: Offset of the invalid chunk in the stream in bytes; None if unknown.
    """

    reject_id: ClassVar[str] = ""

    def __init__(self, message: str, offset: int | None = None) -> None:
        super().__init__(message)
        self.offset = offset

    def __str__(self) -> str:
        location = "" if self.offset is None else f" at byte {self.offset}"
        return f"{self.reject_id}{location}: {super().__str__()}"


class ContainerError(BitstreamError):
    """The framing, the chunk order, the version or a field is invalid."""


class BadMagicError(ContainerError):
    """The file does not begin with the magic bytes."""

    reject_id = "bad-magic"


class TruncatedError(ContainerError):
    """The stream ends inside a chunk, or before its TAIL chunk."""

    reject_id = "truncated"


class BadSyncError(ContainerError):
    """A chunk does not begin with the sync word."""

    reject_id = "bad-sync"


class HeaderCrcError(ContainerError):
    """A chunk's header does not match its CRC."""

    reject_id = "header-crc"


class PayloadCrcError(ContainerError):
    """A chunk's payload does not match its CRC."""

    reject_id = "payload-crc"


class SequenceError(ContainerError):
    """A chunk is missing, repeated or out of order."""

    reject_id = "sequence"


class ChunkOrderError(ContainerError):
    """A chunk of this type is not allowed at its position."""

    reject_id = "chunk-order"


class BadChunkTypeError(ContainerError):
    """A chunk's type does not match the patterns of the format."""

    reject_id = "bad-chunk-type"


class UnknownCriticalError(ContainerError):
    """The type of a critical chunk is unknown to this version."""

    reject_id = "unknown-critical"


class TrailingDataError(ContainerError):
    """Bytes follow the TAIL chunk, or the last field of a payload."""

    reject_id = "trailing-data"


class TailMismatchError(ContainerError):
    """A field of TAIL does not match the stream."""

    reject_id = "tail-mismatch"


class IndexMismatchError(ContainerError):
    """INDX does not match the stream, or an entry does not lead to the expected chunk."""

    reject_id = "index-mismatch"


class UnsupportedVersionError(ContainerError):
    """The stream has a version that this decoder does not support."""

    reject_id = "unsupported-version"


class UnsupportedFeatureError(ContainerError):
    """The stream uses an incompatible feature that this decoder does not support."""

    reject_id = "unsupported-feature"


class FieldError(ContainerError):
    """A field of a payload is out of range, or the payload is too short."""

    reject_id = "field"


class ChunkSizeError(ContainerError):
    """A payload is longer than the stream's level allows."""

    reject_id = "chunk-exceeds-level"


class EntropyError(BitstreamError):
    """Coded planes are malformed."""


class BadProbabilityError(EntropyError):
    """A probability code is not defined by the format."""

    reject_id = "bad-probability"


class InvalidWordsError(EntropyError):
    """A section contains words that no encoder can produce."""

    reject_id = "invalid-words"


class UnconsumedWordsError(EntropyError):
    """The entropy decoder is not empty after the last plane of a section."""

    reject_id = "unconsumed-words"


class SymbolRangeError(EntropyError):
    """A coded value is larger than the format allows."""

    reject_id = "symbol-range"


class StateError(BitstreamError):
    """A frame would make the scene invalid."""


class CountLevelError(StateError):
    """There are more Gaussians or births than the stream's level allows."""

    reject_id = "count-exceeds-level"


class CountError(StateError):
    """A frame has no Gaussians, or would delete all Gaussians of the scene."""

    reject_id = "count"


class FrameOrderError(StateError):
    """An ordinal or phase is not one more than the last, or a snapshot refers to another CANO."""

    reject_id = "frame-order"


class PositionRangeError(StateError):
    """A Gaussian is off the lattice."""

    reject_id = "position-range"


class CodeRangeError(StateError):
    """An attribute code is out of range."""

    reject_id = "code-range"


class RotationRangeError(StateError):
    """The norm of three coded components of a rotation exceeds 1."""

    reject_id = "rotation-range"


class DegenerateRotationError(StateError):
    """A rotation has norm zero."""

    reject_id = "degenerate-rotation"


class ParentRangeError(StateError):
    """A new Gaussian refers to a parent that is not in the scene."""

    reject_id = "parent-range"


class StateCrcError(StateError):
    """The decoded state differs from the encoder's state."""

    reject_id = "state-crc"


class LimitError(QuarcError):
    """A stream at the unlimited level exceeds the limits of this decoder (SPEC 3.2)."""


class SourceError(QuarcError):
    """The file, pipe or server cannot be read; the stream itself may be valid."""


class EnvironmentVariableError(QuarcError):
    """An environment variable has an invalid value."""


class EncodeError(QuarcError):
    """A scene or a setting cannot be represented in a stream."""


class UnusableCaptureError(EncodeError):
    """The cameras of a capture see too little of the scene for useful quality."""


class BoundError(EncodeError):
    """A decoded frame exceeds its error bounds, which is a bug in this package."""


class ResumeError(QuarcError):
    """The partial stream was encoded with different inputs."""


class EditError(QuarcError):
    """Streams cannot be cut or joined as requested."""


class ClosedLoopError(QuarcError):
    """The states of encoder and decoder differ, which is a bug in this package."""


class VerificationError(QuarcError):
    """Two methods that must agree give different results, which is a bug in this package."""
