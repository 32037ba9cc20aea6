"""Defines claims about size and quality; each compares a measured number with a limit."""

from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.inspection.stream_summary import FrameSummary, StreamSummary

AMORTIZED_FRAMES = 300  # number of frames over which the bytes of the canonical frame are spread


@dataclass(frozen=True, slots=True)
class Claim:
    """A measured number, and the limit that it should meet.

    Attributes:
        name: Description of the number.
        value: Measured number; None if it could not be measured.
        bound: The limit, which is a maximum or a minimum.
        is_maximum: Whether the limit is a maximum instead of a minimum.
    """

    name: str
    value: float | None
    bound: float
    is_maximum: bool = True

    @property
    def holds(self) -> bool | None:
        """Whether the number meets the limit; None if it could not be measured."""
        if self.value is None:
            return None
        return self.value <= self.bound if self.is_maximum else self.value >= self.bound

    def as_json(self) -> dict[str, object]:
        """Return the claim as the JSON object that `--json` prints."""
        relation = "at most" if self.is_maximum else "at least"
        return {
            "claim": self.name,
            "is": self.value,
            "asked": f"{relation} {self.bound:g}",
            "holds": self.holds,
        }


def amortize(one_time_bytes: float, frame_bytes: Sequence[float]) -> float:
    """Return the bytes per frame if `one_time_bytes` are spread over `AMORTIZED_FRAMES` frames.

    Args:
        one_time_bytes: Bytes of the canonical frame, and of other data that a stream contains only
            once.
        frame_bytes: Bytes of each measured later frame; all later frames are assumed to take their
            mean.
    """
    return one_time_bytes / AMORTIZED_FRAMES + mean(frame_bytes)


def amortize_file(summary: StreamSummary) -> float:
    """Return the amortized bytes per frame of the file, with framing, headers and index."""
    frame_bytes = [frame.chunk_bytes for frame in list_inter_frames(summary)]
    return amortize(summary.total_bytes - sum(frame_bytes), frame_bytes)


def amortize_estimate(summary: StreamSummary) -> float:
    """Return the amortized bytes per frame by the paper's zero-order estimate, without overhead."""
    frame_bytes = [
        frame.estimate_bytes["motion"] + frame.estimate_bytes["births"]
        for frame in list_inter_frames(summary)
    ]
    return amortize(summary.frames[0].estimate_bytes["canonical"], frame_bytes)


def list_motion_claims(summary: StreamSummary) -> list[Claim]:
    """Return the claims that compare motion with its estimate, and the claim on bytes per birth."""
    later_frames = list_inter_frames(summary)
    worst_ratio = max(
        map(_compute_motion_ratio, later_frames), key=lambda ratio: ratio or 0.0, default=None
    )
    coded_bytes, birth_count = summary.coded_bytes(), sum(frame.births for frame in later_frames)
    estimate = sum(frame.estimate_bytes["motion"] for frame in later_frames)
    return [
        Claim(
            "motion bytes / estimate, whole stream", divide(coded_bytes["motion"], estimate), 0.65
        ),
        Claim("motion bytes / estimate, worst frame with motion", worst_ratio, 1.0),
        Claim("bytes per birth", divide(coded_bytes["births"], birth_count), 16.0),
    ]


def list_canonical_claims(
    canonical_bytes: int, psnr: float, name: str, other: tuple[float, float] | None, bound: float
) -> list[Claim]:
    """Return the claims that compare frame 0 with the same scene in another format.

    Args:
        canonical_bytes: Bytes of the canonical frame.
        psnr: PSNR of frame 0 in dB.
        name: Name of the other format.
        other: Size in bytes and PSNR in dB of the file in the other format; None if unavailable.
        bound: Maximum ratio of the two sizes (canonical frame / other file).
    """
    size_ratio, psnr_gain = (canonical_bytes / other[0], psnr - other[1]) if other else (None, None)
    return [
        Claim(f"bytes of the canonical frame / bytes of the {name} file", size_ratio, bound),
        Claim(f"PSNR of frame 0 minus that of {name}, dB", psnr_gain, 0.0, is_maximum=False),
    ]


def list_paper_claims(
    summary: StreamSummary,
    psnr: Sequence[float],
    paper_summary: StreamSummary,
    paper_psnr: Sequence[float],
) -> list[Claim]:
    """Return the claims that compare a stream with the estimate and PSNR of preset `paper`."""
    motion = mean([frame.coded_bytes["motion"] for frame in list_inter_frames(summary)])
    paper_motion = mean(
        [frame.estimate_bytes["motion"] for frame in list_inter_frames(paper_summary)]
    )
    total_ratio = divide(amortize_file(summary), amortize_estimate(paper_summary))
    return [
        Claim(
            f"bytes per frame, over {AMORTIZED_FRAMES} frames / paper's estimate", total_ratio, 0.25
        ),
        Claim("motion bytes / paper's estimate", divide(motion, paper_motion), 0.1),
        Claim("PSNR minus the paper's, dB", mean(psnr) - mean(paper_psnr), 0.0, is_maximum=False),
    ]


def list_fourdgs_claims(
    summary: StreamSummary, first_bytes: float | None, total_bytes: float | None
) -> list[Claim]:
    """Return the claims that compare the stream with a `4dgs` file of its decoded frames.

    Args:
        summary: Summary of the stream.
        first_bytes: Size of a `4dgs` file of the first frame; None if the package is missing.
        total_bytes: Size of a `4dgs` file of all frames; None if the package is missing.
    """
    total_ratio, amortized_ratio, later_frame_count = None, None, len(list_inter_frames(summary))
    if later_frame_count and first_bytes is not None and total_bytes is not None:
        total_ratio = divide(summary.total_bytes, total_bytes)
        amortized_fourdgs_bytes = amortize(
            first_bytes, [(total_bytes - first_bytes) / later_frame_count]
        )
        amortized_ratio = divide(amortize_file(summary), amortized_fourdgs_bytes)
    return [
        Claim("bytes of the stream / bytes of the fourdgs file", total_ratio, 0.1),
        Claim(
            f"bytes of the stream / bytes of the fourdgs file, both over {AMORTIZED_FRAMES} frames",
            amortized_ratio,
            0.1,
        ),
    ]


def list_inter_frames(summary: StreamSummary) -> list[FrameSummary]:
    """Return the frames that are not canonical."""
    return [frame for frame in summary.frames if not frame.canonical]


def mean(numbers: Sequence[float]) -> float:
    """Return the mean; 0 for an empty list."""
    return sum(numbers) / len(numbers) if numbers else 0.0


def divide(dividend: float, divisor: float) -> float | None:
    """Return the quotient; None if the divisor is 0."""
    return dividend / divisor if divisor else None


def _compute_motion_ratio(frame: FrameSummary) -> float | None:
    """Return a frame's motion bytes divided by their estimate; None if nothing moves."""
    return divide(frame.coded_bytes["motion"], frame.estimate_bytes["motion"])
