"""Claims about rates: each has a number, a limit, and whether it holds."""

from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.inspection.stream_summary import FrameSummary, StreamSummary

AMORTIZED_FRAMES = 300


@dataclass(frozen=True, slots=True)
class Claim:
    """A number and its limit.

    Attributes:
        name: Description of the number.
        value: None if it could not be measured.
        bound: The limit.
        is_ceiling: Whether the limit is a maximum; otherwise it is a minimum.
    """

    name: str
    value: float | None
    bound: float
    is_ceiling: bool = True

    @property
    def holds(self) -> bool | None:
        """Whether the number is within the limit; None without a number."""
        if self.value is None:
            return None
        return self.value <= self.bound if self.is_ceiling else self.value >= self.bound

    def as_json(self) -> dict[str, object]:
        """Return the claim as printed by `--json`."""
        asked = "at most" if self.is_ceiling else "at least"
        return {
            "claim": self.name,
            "is": self.value,
            "asked": f"{asked} {self.bound:g}",
            "holds": self.holds,
        }


def amortize(canonical: float, moved: Sequence[float]) -> float:
    """Return bytes per frame of a stream whose first frame serves `AMORTIZED_FRAMES`.

    Args:
        canonical: Bytes of that frame, and of everything that occurs once.
        moved: Bytes of every later frame, represented by their mean.
    """
    return canonical / AMORTIZED_FRAMES + mean(moved)


def amortize_file(summary: StreamSummary) -> float:
    """Return the real bytes per frame, including framing, headers and index."""
    moved = [frame.chunk_bytes for frame in list_inter_frames(summary)]
    return amortize(summary.total_bytes - sum(moved), moved)


def amortize_estimate(summary: StreamSummary) -> float:
    """Return bytes per frame by the paper's estimate: zero-order, without overhead."""
    moved = [
        frame.estimate_bytes["motion"] + frame.estimate_bytes["births"]
        for frame in list_inter_frames(summary)
    ]
    return amortize(summary.frames[0].estimate_bytes["canonical"], moved)


def claim_motion(summary: StreamSummary) -> list[Claim]:
    """Return the claims that compare motion and births with the estimate of the same symbols."""
    moved = list_inter_frames(summary)
    worst = max(map(_motion_ratio, moved), key=lambda ratio: ratio or 0.0, default=None)
    coded, newborn = summary.coded_bytes(), sum(frame.births for frame in moved)
    estimate = sum(frame.estimate_bytes["motion"] for frame in moved)
    return [
        Claim("motion / estimate, whole stream", divide(coded["motion"], estimate), 0.65),
        Claim("motion / estimate, worst frame that moves", worst, 1.0),
        Claim("bytes of a newborn", divide(coded["births"], newborn), 16.0),
    ]


def claim_canonical(
    mine: int, my_psnr: float, name: str, theirs: tuple[float, float] | None, bound: float
) -> list[Claim]:
    """Return the claims that compare frame 0 with its file in another format.

    Args:
        mine: Bytes of the canonical frame.
        my_psnr: PSNR of frame 0 in dB.
        name: Name of the other format.
        theirs: Bytes and PSNR of its file; None if unavailable.
        bound: Limit of the ratio of bytes.
    """
    ratio, gain = (mine / theirs[0], my_psnr - theirs[1]) if theirs else (None, None)
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
    whole = divide(amortize_file(summary), amortize_estimate(paper))
    return [
        Claim(f"whole stream over {AMORTIZED_FRAMES} frames / paper's estimate", whole, 0.25),
        Claim("motion / paper's estimate", divide(motion, paper_motion), 0.1),
        Claim("PSNR less the paper's, dB", mean(psnr) - mean(paper_psnr), 0.0, is_ceiling=False),
    ]


def claim_fourdgs(summary: StreamSummary, first: float | None, total: float | None) -> list[Claim]:
    """Return the claims that compare the stream with the decoded frames in a `4dgs` file.

    Args:
        summary: Of the stream.
        first: Bytes of its first frame; None if the package is not installed.
        total: Bytes of all.
    """
    whole, amortized, moved = None, None, len(list_inter_frames(summary))
    if moved and first is not None and total is not None:
        whole = divide(summary.total_bytes, total)
        theirs = amortize(first, [(total - first) / moved])
        amortized = divide(amortize_file(summary), theirs)
    return [
        Claim("whole stream / fourdgs", whole, 0.1),
        Claim(f"whole stream / fourdgs, both over {AMORTIZED_FRAMES} frames", amortized, 0.1),
    ]


def list_inter_frames(summary: StreamSummary) -> list[FrameSummary]:
    """Return the frames that are not canonical."""
    return [frame for frame in summary.frames if not frame.canonical]


def mean(numbers: Sequence[float]) -> float:
    """Return the mean; 0 of an empty list."""
    return sum(numbers) / len(numbers) if numbers else 0.0


def divide(part: float, whole: float) -> float | None:
    """Return a ratio; None if the divisor is 0."""
    return part / whole if whole else None


def _motion_ratio(frame: FrameSummary) -> float | None:
    """Return the ratio of a frame's motion to its estimate; None if nothing moves."""
    return divide(frame.coded_bytes["motion"], frame.estimate_bytes["motion"])
