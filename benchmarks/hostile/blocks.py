"""Judges mutants in blocks of consecutive numbers, so that an interrupted run can resume.

Each block is saved as a line of JSON. A mutant that fails is saved in a file whose name is the
number of the mutant; the same mutant can be generated again from that number.
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

BLOCK_SIZE = 1000
_OTHER_MODES = tuple(mode for mode in judge.MODES if mode != "decode")
_MAX_LISTED_FAILURES = 20
_MODE_PERIOD = 40  # each mode except `decode` decodes one mutant out of 40


@dataclass(slots=True)
class Tally:
    """Totals over judged mutants.

    Attributes:
        outcomes: Number of mutants with each outcome.
        modes: Number of mutants decoded in each mode.
        frames: Number of decoded frames.
        seconds: Total processor time of decoding, in seconds.
        slowest: Processor time of the slowest mutant, in seconds.
        slowest_number: Number of the slowest mutant.
        peak_rss_mib: Largest peak memory of all processes, in MiB.
        failures: Outcome of each failed mutant, by the number of the mutant.
    """

    outcomes: Counter[str] = field(default_factory=Counter)
    modes: Counter[str] = field(default_factory=Counter)
    frames: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    slowest_number: int = -1
    peak_rss_mib: float = 0.0
    failures: dict[int, str] = field(default_factory=dict)

    def add_verdict(self, number: int, mode: str, verdict: judge.Verdict) -> None:
        """Add the verdict on a mutant."""
        self.outcomes[verdict.outcome] += 1
        self.modes[mode] += 1
        self.frames += verdict.frames
        self.seconds += verdict.seconds
        if verdict.seconds > self.slowest:
            self.slowest, self.slowest_number = verdict.seconds, number
        if verdict.is_failure:
            self.failures[number] = verdict.outcome

    def add(self, other: "Tally") -> None:
        """Add the results of another tally to this one."""
        self.outcomes += other.outcomes
        self.modes += other.modes
        self.frames += other.frames
        self.seconds += other.seconds
        if other.slowest > self.slowest:
            self.slowest, self.slowest_number = other.slowest, other.slowest_number
        self.peak_rss_mib = max(self.peak_rss_mib, other.peak_rss_mib)
        self.failures |= other.failures

    def list_missing_reject_ids(self) -> list[str]:
        """Return the reject ids of SPEC 3.3 that are not the outcome of any stream."""
        reject_ids = [
            error_class.reject_id
            for base_class in BitstreamError.__subclasses__()
            for error_class in base_class.__subclasses__()
        ]
        return [reject_id for reject_id in reject_ids if not self.outcomes[reject_id]]

    def as_json(self) -> dict[str, Any]:
        """Return the results as a JSON object for printing."""
        rejections = {
            name: count
            for name, count in self.outcomes.most_common()
            if name not in ("decoded", "declined", "hang", "escape")
        }
        listed_failures = sorted(self.failures)[:_MAX_LISTED_FAILURES]
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
            "failures": {str(number): self.failures[number] for number in listed_failures},
        }


def choose_mode(number: int) -> str:
    """Return the mode (a key of `judge.MODES`) in which the mutant with this number is decoded."""
    remainder = number % _MODE_PERIOD
    return _OTHER_MODES[remainder] if remainder < len(_OTHER_MODES) else "decode"


class StreamMaker(Protocol):
    """Generates streams that may be malformed."""

    def make(self, number: int) -> Mutant:
        """Return the stream with the given number; a number always gives the same stream."""
        ...


@dataclass(frozen=True, slots=True)
class Series:
    """A series of streams to judge.

    Attributes:
        maker: Generates the streams.
        choose_mode: Returns the mode for decoding the stream with the given number.
    """

    maker: StreamMaker
    choose_mode: Callable[[int], str] = choose_mode


def judge_block(
    series: Series, first: int, count: int, folder: Path, on_start: Callable[[int], object] = int
) -> Tally:
    """Judge consecutive streams, and save each stream that fails.

    Args:
        series: Series of the streams.
        first: Number of the first stream.
        count: Number of streams.
        folder: Folder for streams that fail.
        on_start: Called with every number before its stream is generated.
    """
    tally = Tally()
    for number in range(first, first + count):
        on_start(number)
        try:
            mutant, mode = series.maker.make(number), series.choose_mode(number)
            verdict = judge.judge(mode, mutant.data, has_forged_crcs=mutant.has_forged_crcs)
        except Exception as error:
            error.add_note(f"while generating or judging stream {number}")
            raise
        tally.add_verdict(number, mode, verdict)
        if verdict.is_failure:
            (folder / f"{number}.quarc").write_bytes(mutant.data)
            report = (
                f"{verdict.outcome}, {mode}, forged: {mutant.has_forged_crcs}, {mutant.recipe}\n"
            )
            (folder / f"{number}.txt").write_text(report + verdict.detail, "utf-8")
    tally.peak_rss_mib = measure_peak_mebibytes() or 0.0
    return tally


def append_block(path: Path, first: int, count: int, tally: Tally) -> None:
    """Append the results of a block to a file, as a line of JSON."""
    entry = {
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
        file.write(json.dumps(entry) + "\n")


def read_blocks(path: Path) -> dict[tuple[int, int], Tally]:
    """Return the saved blocks by first number and count; an incomplete last line is ignored."""
    blocks: dict[tuple[int, int], Tally] = {}
    lines = path.read_text("utf-8").split("\n") if path.exists() else []
    for line in lines[:-1]:
        entry = json.loads(line)
        key = (entry.pop("first"), entry.pop("count"))
        entry["outcomes"], entry["modes"] = Counter(entry["outcomes"]), Counter(entry["modes"])
        entry["failures"] = {int(number): outcome for number, outcome in entry["failures"].items()}
        blocks[key] = Tally(**entry)
    return blocks
