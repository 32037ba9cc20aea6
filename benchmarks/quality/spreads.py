"""Statistics over seeds: means, deviations, and differences of means."""

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
        deviation: Standard deviation over seeds, by n - 1; None for a single seed.
        count: Number of seeds.
    """

    mean: float
    deviation: float | None
    count: int

    @property
    def variance_of_mean(self) -> float | None:
        """Square of the standard error of the mean; None for a single seed."""
        return None if self.deviation is None else self.deviation**2 / self.count

    def as_json(self) -> dict[str, float | None]:
        """Return the spread by name."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Difference:
    """Difference of two means.

    Attributes:
        amount: The first minus the second.
        error: Its standard error; None if a mean is of a single seed.
    """

    amount: float
    error: float | None


def summarize(values: Sequence[float]) -> Spread:
    """Return mean and deviation of a figure.

    Args:
        values: One value for each seed, at least one.
    """
    return Spread(fmean(values), stdev(values) if len(values) > 1 else None, len(values))


def summarize_figures(rows: Iterable[Figures]) -> dict[str, Spread]:
    """Return the spread of every figure, over the rows that have it."""
    found: dict[str, list[float]] = {}
    for row in rows:
        for name, value in row.items():
            if value is not None:
                found.setdefault(name, []).append(value)
    return {name: summarize(values) for name, values in found.items()}


def subtract(ours: Spread, theirs: Spread) -> Difference:
    """Return the difference between the means of two studies, with seeds as random samples."""
    return Difference(
        ours.mean - theirs.mean, _join_errors([ours.variance_of_mean, theirs.variance_of_mean])
    )


def average_differences(differences: Sequence[Difference]) -> Difference:
    """Return the mean of differences over several captures and held-out sets.

    Its error describes only the variation between seeds, not between captures.

    Args:
        differences: At least one.
    """
    count = len(differences)
    variances = [None if it.error is None else it.error**2 for it in differences]
    error = _join_errors(variances)
    amount = fmean(it.amount for it in differences)
    return Difference(amount, None if error is None else error / count)


def _join_errors(variances: Sequence[float | None]) -> float | None:
    """Return the standard error of a sum; None if an error is unknown."""
    known = [variance for variance in variances if variance is not None]
    return math.sqrt(sum(known)) if len(known) == len(variances) else None
