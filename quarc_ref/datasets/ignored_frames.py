"""Frames of single cameras that are not used, as listed in `quarc-capture.json`.

A camera can fail while the others go on recording: it is pushed or covered, or it loses frames.

    {"ignored_frames": {"cam03": [17, [300, 420], [900, null]]}}

A number is a single frame. A pair is a span, given by its first and last frame; null stands for the
end of the recording.
Frames are counted like those of `--start`, from the first frame that all cameras recorded.
"""

import json
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from quarc_ref.datasets.errors import MissingCameraError

FrameSpan = tuple[int, int | None]  # first and last frame; None for the end of the recording

_MAX_FRAME = 10**9
_WHERE = "ignored_frames in quarc-capture.json"


@dataclass(frozen=True, slots=True)
class IgnoredFrames:
    """The frames of each camera that are not used.

    Attributes:
        spans: Spans of frames by camera name.
    """

    spans: Mapping[str, tuple[FrameSpan, ...]] = field(default_factory=dict)

    def contains(self, camera: str, frame: int) -> bool:
        """Return whether a frame of a camera is not used.

        Args:
            camera: Name of the camera.
            frame: Frame of the synchronized recording.
        """
        return any(
            first <= frame and (last is None or frame <= last)
            for first, last in self.spans.get(camera, ())
        )

    def contains_rest(self, camera: str, frame: int) -> bool:
        """Return whether a frame of a camera and all later ones are not used."""
        return any(first <= frame and last is None for first, last in self.spans.get(camera, ()))

    def require_cameras(
        self, names: Collection[str], training: Sequence[str], start: int, count: int
    ) -> None:
        """Check that all cameras exist, and that every frame has a training camera.

        Args:
            names: Names of all cameras.
            training: Names of the training cameras.
            start: First frame that is used.
            count: Number of frames that are used.

        Raises:
            MissingCameraError: A camera does not exist, or no training camera is left in a frame.
        """
        unknown_names = sorted(set(self.spans) - set(names))
        if unknown_names:
            message = (
                f"{_WHERE} names cameras that are not in the capture: "
                f"{', '.join(unknown_names)}; the cameras are {', '.join(names)}"
            )
            raise MissingCameraError(message)
        # The first frame without cameras is the first frame of a span, or of the capture.
        span_starts = (first for spans in self.spans.values() for first, _ in spans)
        for frame in sorted({start, *span_starts}):
            is_encoded = start <= frame < start + count
            if is_encoded and all(self.contains(name, frame) for name in training):
                message = f"{_WHERE} leaves no training camera in frame {frame}"
                raise MissingCameraError(message)

    def to_json(self) -> dict[str, list[int | list[int | None]]]:
        """Return the value of `ignored_frames` in `quarc-capture.json`."""
        return {
            name: [first if first == last else [first, last] for first, last in spans]
            for name, spans in self.spans.items()
        }


def join_frames(frames: Iterable[int]) -> list[FrameSpan]:
    """Return the spans of consecutive frames; `frames` are in ascending order."""
    spans: list[FrameSpan] = []
    for frame in frames:
        first = spans.pop()[0] if spans and spans[-1][1] == frame - 1 else frame
        spans.append((first, frame))
    return spans


def suggest_ignoring(camera: str, spans: Sequence[FrameSpan]) -> str:
    """Return advice to ignore frames of a camera, as part of a sentence.

    Args:
        camera: Name of the camera.
        spans: Spans of frames of the synchronized recording.
    """
    return f"{_suggest_adding({camera: tuple(spans)})}, so that only the other cameras are used"


def suggest_ignoring_ends(frame_counts: Mapping[str, int]) -> str:
    """Return advice to use cameras until they end and the others longer, as part of a sentence.

    Args:
        frame_counts: Number of frames of each camera that ends early, in the synchronized
            recording.
    """
    ends = {name: ((count, None),) for name, count in frame_counts.items()}
    return f"to use the other cameras longer, {_suggest_adding(ends)}"


def _suggest_adding(spans: Mapping[str, tuple[FrameSpan, ...]]) -> str:
    return (
        f'add "ignored_frames": {json.dumps(IgnoredFrames(spans).to_json())} to quarc-capture.json'
    )


def parse_ignored_frames(value: object) -> IgnoredFrames:
    """Parse the value of `ignored_frames` in `quarc-capture.json`.

    Raises:
        TypeError: The value is not an object that maps camera names to lists.
        ValueError: An entry of a list is neither a frame nor a span of frames.
    """
    if not isinstance(value, dict) or not all(isinstance(spans, list) for spans in value.values()):
        message = "'ignored_frames' is not an object that maps cameras to lists of frames"
        raise TypeError(message)
    return IgnoredFrames(
        {name: tuple(_parse_span(name, entry) for entry in spans) for name, spans in value.items()}
    )


def _parse_span(name: str, entry: object) -> FrameSpan:
    match entry:
        case int() if _is_frame(entry):
            return entry, entry
        case [int() as first, None] if _is_frame(first):
            return first, None
        case [int() as first, int() as last] if _is_frame(first) and first <= last <= _MAX_FRAME:
            return first, last
    message = (
        f"'ignored_frames' of {name} contains {entry!r}, which is neither a frame nor a pair of a "
        "first and a last frame"
    )
    raise ValueError(message)


def _is_frame(number: int) -> bool:
    return not isinstance(number, bool) and 0 <= number <= _MAX_FRAME
