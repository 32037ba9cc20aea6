"""Means over seeds, how far the seeds scatter, and what two means differ by."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean, stdev

Figures = Mapping[str, float | None]


@dataclass(frozen=True, slots=True)
class Spread:
    """A figure over seeds.

    Attributes:
        mean: Over the seeds.
        deviation: Standard deviation of a seed, by n - 1; None of a single one.
        count: How many seeds there are.
    """

    mean: float
    deviation: float | None
    count: int

    @property
    def variance_of_mean(self) -> float | None:
        """Square of the standard error of the mean; None of a single seed."""
        return None if self.deviation is None else self.deviation**2 / self.count

    def as_json(self) -> dict[str, float | None]:
        """Return it by name."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Difference:
    """What a mean is above another.

    Attributes:
        amount: The first less the second.
        error: Its standard error; None where a single seed does not tell.
    """

    amount: float
    error: float | None


def summarize(values: Sequence[float]) -> Spread:
    """Return mean and deviation of a figure.

    Args:
        values: One to a seed, at least one.
    """
    return Spread(fmean(values), stdev(values) if len(values) > 1 else None, len(values))


def summarize_figures(rows: Iterable[Figures]) -> dict[str, Spread]:
    """Return the spread of every figure that any of the rows has, over those that have it."""
    found: dict[str, list[float]] = {}
    for row in rows:
        for name, value in row.items():
            if value is not None:
                found.setdefault(name, []).append(value)
    return {name: summarize(values) for name, values in found.items()}


def subtract(ours: Spread, theirs: Spread) -> Difference:
    """Return by how much the mean of one study is above that of another, seeds taken as drawn."""
    return Difference(
        ours.mean - theirs.mean, _join_errors([ours.variance_of_mean, theirs.variance_of_mean])
    )


def average_differences(differences: Sequence[Difference]) -> Difference:
    """Return the mean of differences on several captures and held-out sets.

    Its error is that of the seeds alone: it tells nothing of other captures.

    Args:
        differences: At least one.
    """
    count = len(differences)
    variances = [None if it.error is None else it.error**2 for it in differences]
    error = _join_errors(variances)
    amount = fmean(it.amount for it in differences)
    return Difference(amount, None if error is None else error / count)


def _join_errors(variances: Sequence[float | None]) -> float | None:
    """Return the standard error of a sum; None where the error of a part is not known."""
    known = [variance for variance in variances if variance is not None]
    return math.sqrt(sum(known)) if len(known) == len(variances) else None
