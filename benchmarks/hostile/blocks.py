"""Judges mutants in blocks, so that an interrupted run can resume.

Each block is saved as a line of JSON. A failed mutant is saved as a file named after its number,
from which it can be generated again.
"""

import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from hostile import judge
from hostile.mutations import Mutant
from quarc_ref.format.errors import BitstreamError
from quarc_ref.inspection.peak_memory import measure_peak_mebibytes

BLOCK = 1000
_OTHER_MODES = tuple(way for way in judge.MODES if way != "decode")
_SHOWN = 20  # failures, by number
_SHARE = 40  # number of mutants of which each other way gets one


@dataclass(slots=True)
class Tally:
    """Results of mutants.

    Attributes:
        outcomes: Number of mutants for each outcome.
        modes: Number of mutants decoded in each way.
        frames: Number of decoded frames.
        seconds: Processor time of decoding.
        slowest: Seconds of the slowest mutant.
        slowest_number: Its number.
        peak_rss_mib: Peak memory of any process.
        failures: Numbers of failed mutants, with their outcomes.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    modes: Counter[str] = field(default_factory=Counter)
    frames: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    slowest_number: int = -1
    peak_rss_mib: float = 0.0
    failures: dict[int, str] = field(default_factory=dict)

    def note(self, number: int, way: str, verdict: judge.Verdict) -> None:
        """Count a mutant."""
        self.outcomes[verdict.outcome] += 1
        self.modes[way] += 1
        self.frames += verdict.frames
        self.seconds += verdict.seconds
        if verdict.seconds > self.slowest:
            self.slowest, self.slowest_number = verdict.seconds, number
        if verdict.is_failure:
            self.failures[number] = verdict.outcome

    def add(self, other: "Tally") -> None:
        """Add the results of another tally."""
        self.outcomes += other.outcomes
        self.modes += other.modes
        self.frames += other.frames
        self.seconds += other.seconds
        if other.slowest > self.slowest:
            self.slowest, self.slowest_number = other.slowest, other.slowest_number
        self.peak_rss_mib = max(self.peak_rss_mib, other.peak_rss_mib)
        self.failures |= other.failures

    def list_missing_reject_ids(self) -> list[str]:
        """Return the reject ids of SPEC 3.3 that no stream has reached."""
        kinds = [leaf for kind in BitstreamError.__subclasses__() for leaf in kind.__subclasses__()]
        return [leaf.reject_id for leaf in kinds if not self.outcomes[leaf.reject_id]]

    def as_json(self) -> dict[str, Any]:
        """Return the results as they are printed."""
        rejections = {
            name: count
            for name, count in self.outcomes.most_common()
            if name not in ("decoded", "declined", "hang", "escape")
        }
        first = sorted(self.failures)[:_SHOWN]
        return {
            "streams": self.outcomes.total(),
            "decoded": self.outcomes["decoded"],
            "declined": self.outcomes["declined"],
            "rejections": rejections,
            "escapes": self.outcomes["escape"],
            "hangs": self.outcomes["hang"],
            "peak_rss_mib": round(self.peak_rss_mib, 1),
            "slowest_s": round(self.slowest, 3),
            "slowest_number": self.slowest_number,
            "mean_ms": round(1000 * self.seconds / max(1, self.outcomes.total()), 3),
            "frames": self.frames,
            "modes": dict(self.modes),
            "failures": {str(number): self.failures[number] for number in first},
        }


def choose_mode(number: int) -> str:
    """Return the way in which a mutant is decoded."""
    place = number % _SHARE
    return _OTHER_MODES[place] if place < len(_OTHER_MODES) else "decode"


class Maker(Protocol):
    """Generates streams with arbitrary contents."""

    def make(self, number: int) -> Mutant:
        """Return the stream of a number, always the same."""
        ...


@dataclass(frozen=True, slots=True)
class Series:
    """Streams to judge.

    Attributes:
        maker: Makes them.
        choose_mode: Returns the way in which the stream of a number is decoded.
    """

    maker: Maker
    choose_mode: Callable[[int], str] = choose_mode


def judge_block(
    series: Series, first: int, count: int, folder: Path, begin: Callable[[int], object] = int
) -> Tally:
    """Judge consecutive streams and save the failures in a folder.

    Args:
        series: The streams.
        first: Number of the first stream.
        count: How many.
        folder: Folder for failures.
        begin: Called with every number before its stream is generated.
    """
    tally = Tally()
    for number in range(first, first + count):
        begin(number)
        mutant, way = series.maker.make(number), series.choose_mode(number)
        verdict = judge.judge(way, mutant.data, forged=mutant.forged)
        tally.note(number, way, verdict)
        if verdict.is_failure:
            (folder / f"{number}.quarc").write_bytes(mutant.data)
            reported = f"{verdict.outcome}, {way}, forged: {mutant.forged}, {mutant.recipe}\n"
            (folder / f"{number}.txt").write_text(reported + verdict.detail, "utf-8")
    tally.peak_rss_mib = measure_peak_mebibytes() or 0.0
    return tally


def append_block(path: Path, first: int, count: int, tally: Tally) -> None:
    """Append the results of a block."""
    kept = {
        "first": first,
        "count": count,
        "outcomes": dict(tally.outcomes),
        "modes": dict(tally.modes),
        "frames": tally.frames,
        "seconds": tally.seconds,
        "slowest": tally.slowest,
        "slowest_number": tally.slowest_number,
        "peak_rss_mib": tally.peak_rss_mib,
        "failures": tally.failures,
    }
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(kept) + "\n")


def read_blocks(path: Path) -> dict[tuple[int, int], Tally]:
    """Return the saved blocks by first number and count; incomplete lines are ignored."""
    blocks: dict[tuple[int, int], Tally] = {}
    lines = path.read_text("utf-8").split("\n") if path.exists() else []
    for line in lines[:-1]:
        kept = json.loads(line)
        key = (kept.pop("first"), kept.pop("count"))
        kept["outcomes"], kept["modes"] = Counter(kept["outcomes"]), Counter(kept["modes"])
        kept["failures"] = {int(number): outcome for number, outcome in kept["failures"].items()}
        blocks[key] = Tally(**kept)
    return blocks
