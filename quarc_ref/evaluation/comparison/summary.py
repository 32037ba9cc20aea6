"""Results of a comparison: operating points over runs, paired differences, BD-rate."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev

from quarc_ref.evaluation.camera_meter import Measures
from quarc_ref.evaluation.comparison.bd_rate import Curve, Delta, compare_curves
from quarc_ref.evaluation.comparison.entries import Label
from quarc_ref.evaluation.comparison.measure import Comparison, Measured
from quarc_ref.evaluation.quality import average
from quarc_ref.inspection.stream_summary import KILOBYTE

_MEGABIT = 1e6


@dataclass(frozen=True, slots=True)
class Spread:
    """A mean and its standard deviation.

    Attributes:
        mean: Mean of the numbers.
        deviation: Standard deviation (n - 1); None for a single number.
    """

    mean: float
    deviation: float | None


@dataclass(frozen=True, slots=True)
class Paired:
    """Paired differences between a point and the first one, by view.

    Attributes:
        psnr: PSNR differences over all pairs of views of the same camera and frame, dB.
        better: Share of the pairs in which the point is better.
        pairs: Number of pairs.
    """

    psnr: Spread
    better: float
    pairs: int


@dataclass(frozen=True, slots=True, eq=False)
class Point:
    """An operating point of a method.

    Attributes:
        label: Label of its entries.
        kind: Human-readable kind of its entries.
        runs: Number of its entries, which are runs with the same settings.
        figures: Mean and deviation of each metric over the runs, by name; None if no run has it.
        byte_count: Size of all frames, bytes; None if unknown.
        kilobytes_per_frame: Size per frame, KB of 1024 bytes; None if unknown.
        megabits_per_second: Bit rate at the entries' frame rate; None if unknown.
        paired: Differences from the first point; None for the first point.
    """

    label: Label
    kind: str
    runs: int
    figures: dict[str, Spread | None]
    byte_count: Spread | None
    kilobytes_per_frame: Spread | None
    megabits_per_second: float | None
    paired: Paired | None


@dataclass(frozen=True, slots=True)
class MethodDelta:
    """Bjontegaard's deltas of a method against the first one.

    Attributes:
        method: Name of the method.
        psnr: Deltas by PSNR.
        ssim: Deltas by SSIM.
    """

    method: str
    psnr: Delta
    ssim: Delta


@dataclass(frozen=True, slots=True, eq=False)
class Summary:
    """Results of a comparison.

    Attributes:
        points: Operating points in the order in which they were named.
        reference: Method with which the others are compared; None if there is only one.
        deltas: Deltas of the other methods, where they or the reference have several points.
    """

    points: list[Point]
    reference: str | None
    deltas: list[MethodDelta]


def summarize(comparison: Comparison) -> Summary:
    """Summarize a comparison."""
    groups = _group(comparison.measured)
    first = next(iter(groups.values()))
    points = [
        _make_point(label, runs, None if runs is first else first, comparison.frames_per_second)
        for label, runs in groups.items()
    ]
    counts = Counter(point.label.method for point in points)
    methods = list(counts)
    deltas = [
        MethodDelta(method, *(_compare(points, methods[0], method, it) for it in ("psnr", "ssim")))
        for method in methods[1:]
        if max(counts[methods[0]], counts[method]) > 1
    ]
    return Summary(points, methods[0] if len(methods) > 1 else None, deltas)


def _group(measured: Sequence[Measured]) -> dict[Label, list[Measured]]:
    groups: dict[Label, list[Measured]] = {}
    for each in measured:
        groups.setdefault(each.label, []).append(each)
    return groups


def _make_point(
    label: Label, runs: Sequence[Measured], first: Sequence[Measured] | None, pace: float
) -> Point:
    means = [run.quality.mean() for run in runs]
    sizes = [run.info.byte_count for run in runs]
    per_frame = [
        size / len(run.info.frames) / KILOBYTE
        for run, size in zip(runs, sizes, strict=True)
        if size is not None
    ]
    rate = spread(per_frame)
    return Point(
        label,
        runs[0].info.kind,
        len(runs),
        {name: spread(_values(means, name)) for name in means[0]},
        spread([size for size in sizes if size is not None]),
        rate,
        None if rate is None else rate.mean * KILOBYTE * 8 * pace / _MEGABIT,
        None if first is None else pair(runs, first),
    )


def spread(numbers: Sequence[float]) -> Spread | None:
    """Return the mean and deviation of numbers; None if there are none."""
    return spread_of(numbers) if numbers else None


def spread_of(numbers: Sequence[float]) -> Spread:
    """Return the mean and deviation of at least one number."""
    return Spread(fmean(numbers), stdev(numbers) if len(numbers) > 1 else None)


def pair(runs: Sequence[Measured], first: Sequence[Measured]) -> Paired:
    """Return the differences between two points, by views averaged over the runs of a point."""
    ours, theirs = _list_views(runs), _list_views(first)
    differences = [a - b for a, b in zip(ours, theirs, strict=True)]
    better = fmean(difference > 0 for difference in differences)
    return Paired(spread_of(differences), better, len(differences))


def _list_views(runs: Sequence[Measured]) -> list[float]:
    """Return the PSNR of every view, averaged over the runs."""
    by_run = [
        [_number(view["psnr"]) for views in run.quality.per_camera.values() for view in views]
        for run in runs
    ]
    return [fmean(values) for values in zip(*by_run, strict=True)]


def _number(value: float | None) -> float:
    if value is None:
        message = "every view has a PSNR"
        raise ValueError(message)
    return value


def _values(rows: Iterable[Measures], name: str) -> list[float]:
    return [value for row in rows if (value := row[name]) is not None]


def _trace(points: Sequence[Point], method: str, figure: str) -> Curve:
    """Return rate and quality of the points of a method that have both."""
    return [
        (point.kilobytes_per_frame.mean, found.mean)
        for point in points
        if point.label.method == method
        and point.kilobytes_per_frame is not None
        and (found := point.figures[figure]) is not None
    ]


def _compare(points: Sequence[Point], reference: str, method: str, figure: str) -> Delta:
    return compare_curves(_trace(points, reference, figure), _trace(points, method, figure))


def average_cameras(measured: Measured) -> list[Measures]:
    """Return the means over the cameras, one `Measures` per frame."""
    return [average(views) for views in zip(*measured.quality.per_camera.values(), strict=True)]
