"""Statistics over seeds: means, deviations, and differences of means."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from statistics import fmean, stdev

Figures = Mapping[str, float | None]


@dataclass(frozen=True, slots=True)
class Statistics:
    """Mean and standard deviation of a metric over seeds.

    Attributes:
        mean: Mean over the seeds.
        deviation: Sample standard deviation (divisor n - 1) over the seeds; None for one seed.
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
        """Return the statistics as a JSON object."""
        return asdict(self)


@dataclass(frozen=True, slots=True)
class Difference:
    """The difference of two means.

    Attributes:
        amount: First mean minus second mean.
        error: Standard error of the difference; None if one of the studies has a single seed.
    """

    amount: float
    error: float | None


def summarize(values: Sequence[float]) -> Statistics:
    """Return the mean and standard deviation of a metric.

    Args:
        values: One value per seed; at least one value.
    """
    return Statistics(fmean(values), stdev(values) if len(values) > 1 else None, len(values))


def summarize_figures(rows: Iterable[Figures]) -> dict[str, Statistics]:
    """Return the mean and deviation of each figure over the rows in which it is defined."""
    values_by_name: dict[str, list[float]] = {}
    for row in rows:
        for name, value in row.items():
            if value is not None:
                values_by_name.setdefault(name, []).append(value)
    return {name: summarize(values) for name, values in values_by_name.items()}


def subtract(first: Statistics, second: Statistics) -> Difference:
    """Return the difference of two means; the seeds of both are taken as independent samples."""
    return Difference(
        first.mean - second.mean,
        _compute_standard_error([first.variance_of_mean, second.variance_of_mean]),
    )


def average_differences(differences: Sequence[Difference]) -> Difference:
    """Return the mean of differences over several captures and held-out sets.

    Its error covers only the variation between seeds, not the variation between captures.

    Args:
        differences: At least one difference.
    """
    count = len(differences)
    variances = [
        None if difference.error is None else difference.error**2 for difference in differences
    ]
    error = _compute_standard_error(variances)
    amount = fmean(difference.amount for difference in differences)
    return Difference(amount, None if error is None else error / count)


def _compute_standard_error(variances: Sequence[float | None]) -> float | None:
    """Return the standard error of a sum of values with these variances; None if one is unknown."""
    known_variances = [variance for variance in variances if variance is not None]
    return math.sqrt(sum(known_variances)) if len(known_variances) == len(variances) else None
