"""Claims about rates: each compares a measured number with a limit."""

from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.inspection.stream_summary import FrameSummary, StreamSummary

AMORTIZED_FRAMES = 300


@dataclass(frozen=True, slots=True)
class Claim:
    """A measured number and its limit.

    Attributes:
        name: Description of the number.
        value: Measured number; None if it could not be measured.
        bound: Limit of the number.
        is_ceiling: Whether the limit is a maximum; otherwise it is a minimum.
    """

    name: str
    value: float | None
    bound: float
    is_ceiling: bool = True

    @property
    def holds(self) -> bool | None:
        """Whether the number is within the limit; None if it could not be measured."""
        if self.value is None:
            return None
        return self.value <= self.bound if self.is_ceiling else self.value >= self.bound

    def as_json(self) -> dict[str, object]:
        """Return the claim as a JSON object, as `--json` prints it."""
        relation = "at most" if self.is_ceiling else "at least"
        return {
            "claim": self.name,
            "is": self.value,
            "asked": f"{relation} {self.bound:g}",
            "holds": self.holds,
        }


def amortize(once_bytes: float, frame_bytes: Sequence[float]) -> float:
    """Return the bytes per frame of a stream with one canonical frame in `AMORTIZED_FRAMES`.

    Args:
        once_bytes: Bytes of the canonical frame, and of all other data that occurs once.
        frame_bytes: Bytes of each later frame; their mean represents all later frames.
    """
    return once_bytes / AMORTIZED_FRAMES + mean(frame_bytes)


def amortize_file(summary: StreamSummary) -> float:
    """Return the amortized bytes per frame of the file, including framing, headers and index."""
    frame_bytes = [frame.chunk_bytes for frame in list_inter_frames(summary)]
    return amortize(summary.total_bytes - sum(frame_bytes), frame_bytes)


def amortize_estimate(summary: StreamSummary) -> float:
    """Return the amortized bytes per frame by the paper's zero-order estimate, without overhead."""
    frame_bytes = [
        frame.estimate_bytes["motion"] + frame.estimate_bytes["births"]
        for frame in list_inter_frames(summary)
    ]
    return amortize(summary.frames[0].estimate_bytes["canonical"], frame_bytes)


def claim_motion(summary: StreamSummary) -> list[Claim]:
    """Return the claims that compare motion and births with the estimate of the same symbols."""
    later_frames = list_inter_frames(summary)
    worst_ratio = max(
        map(_motion_ratio, later_frames), key=lambda ratio: ratio or 0.0, default=None
    )
    coded_bytes, birth_count = summary.coded_bytes(), sum(frame.births for frame in later_frames)
    estimate = sum(frame.estimate_bytes["motion"] for frame in later_frames)
    return [
        Claim("motion / estimate, whole stream", divide(coded_bytes["motion"], estimate), 0.65),
        Claim("motion / estimate, worst frame that moves", worst_ratio, 1.0),
        Claim("bytes of a newborn", divide(coded_bytes["births"], birth_count), 16.0),
    ]


def claim_canonical(
    canonical_bytes: int, psnr: float, name: str, other: tuple[float, float] | None, bound: float
) -> list[Claim]:
    """Return the claims that compare frame 0 with a file of it in another format.

    Args:
        canonical_bytes: Bytes of the canonical frame.
        psnr: PSNR of frame 0 in dB.
        name: Name of the other format.
        other: Bytes and PSNR of the file in the other format; None if unavailable.
        bound: Limit of the ratio of bytes.
    """
    ratio, gain = (canonical_bytes / other[0], psnr - other[1]) if other else (None, None)
    return [
        Claim(f"canonical / {name}", ratio, bound),
        Claim(f"PSNR of frame 0 less that of {name}, dB", gain, 0.0, is_ceiling=False),
    ]


def claim_against_paper(
    summary: StreamSummary, psnr: Sequence[float], paper: StreamSummary, paper_psnr: Sequence[float]
) -> list[Claim]:
    """Return the claims that compare the stream with the estimate of the preset `paper`."""
    motion = mean([frame.coded_bytes["motion"] for frame in list_inter_frames(summary)])
    paper_motion = mean([frame.estimate_bytes["motion"] for frame in list_inter_frames(paper)])
    total_ratio = divide(amortize_file(summary), amortize_estimate(paper))
    return [
        Claim(f"whole stream over {AMORTIZED_FRAMES} frames / paper's estimate", total_ratio, 0.25),
        Claim("motion / paper's estimate", divide(motion, paper_motion), 0.1),
        Claim("PSNR less the paper's, dB", mean(psnr) - mean(paper_psnr), 0.0, is_ceiling=False),
    ]


def claim_fourdgs(
    summary: StreamSummary, first_bytes: float | None, total_bytes: float | None
) -> list[Claim]:
    """Return the claims that compare the stream with the decoded frames in a `4dgs` file.

    Args:
        summary: Summary of the stream.
        first_bytes: Bytes of a `4dgs` file of the first frame; None if the package is missing.
        total_bytes: Bytes of a `4dgs` file of all frames.
    """
    total_ratio, amortized_ratio, later_count = None, None, len(list_inter_frames(summary))
    if later_count and first_bytes is not None and total_bytes is not None:
        total_ratio = divide(summary.total_bytes, total_bytes)
        amortized_other = amortize(first_bytes, [(total_bytes - first_bytes) / later_count])
        amortized_ratio = divide(amortize_file(summary), amortized_other)
    return [
        Claim("whole stream / fourdgs", total_ratio, 0.1),
        Claim(f"whole stream / fourdgs, both over {AMORTIZED_FRAMES} frames", amortized_ratio, 0.1),
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


def _motion_ratio(frame: FrameSummary) -> float | None:
    """Return the ratio of a frame's motion bytes to their estimate; None if nothing moves."""
    return divide(frame.coded_bytes["motion"], frame.estimate_bytes["motion"])
