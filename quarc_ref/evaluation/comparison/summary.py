"""Summarizes a comparison as operating points, paired differences and BD-rates."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean, stdev

from quarc_ref.evaluation.camera_meter import Measures
from quarc_ref.evaluation.comparison.bd_rate import BjontegaardDeltas, Curve, compare_curves
from quarc_ref.evaluation.comparison.entries import Label
from quarc_ref.evaluation.comparison.measure import Comparison, MeasuredEntry
from quarc_ref.inspection.stream_summary import KILOBYTE

_MEGABIT = 1e6
_MIN_DIFFERENCE = 0.005  # dB; smaller differences are printed as 0.00


@dataclass(frozen=True, slots=True)
class Statistics:
    """Mean and standard deviation of numbers.

    Attributes:
        mean: Mean of the numbers.
        deviation: Sample standard deviation, with divisor n - 1; None for a single number.
    """

    mean: float
    deviation: float | None


@dataclass(frozen=True, slots=True)
class PairedDifference:
    """PSNR of a point minus PSNR of the first point, compared view by view.

    Attributes:
        psnr: Mean and deviation of the differences over all pairs, in dB. A pair consists of two
            views, one of each point, for the same camera and frame.
        better_share: Share of the pairs in which the point has the higher PSNR; a difference below
            0.005 dB counts as half a pair.
        pair_count: Number of pairs.
    """

    psnr: Statistics
    better_share: float
    pair_count: int


@dataclass(frozen=True, slots=True, eq=False)
class OperatingPoint:
    """An operating point of a method.

    Attributes:
        label: Label that the entries at this point share.
        kind: Human-readable kind of the entries at this point.
        run_count: Number of entries at this point, which are runs with the same settings.
        metrics: Mean and deviation over the runs, by metric; None for a metric without values.
        byte_count: Size of all frames in bytes; None if unknown.
        is_size_stated: Whether the user stated the size of an entry.
        kilobytes_per_frame: Size per frame in KB of 1024 bytes; None if unknown.
        megabits_per_second: Mean bit rate in Mb/s at the frame rate of the entries; None if
            unknown.
        paired_difference: Differences from the first operating point; None for the first point
            itself.
        frame_counts: Numbers of frames of the entries, including frames that are not measured.
    """

    label: Label
    kind: str
    run_count: int
    metrics: dict[str, Statistics | None]
    byte_count: Statistics | None
    is_size_stated: bool
    kilobytes_per_frame: Statistics | None
    megabits_per_second: float | None
    paired_difference: PairedDifference | None
    frame_counts: frozenset[int]


@dataclass(frozen=True, slots=True)
class MethodDeltas:
    """Bjontegaard deltas of a method against the reference method.

    Attributes:
        method: Name of the method.
        psnr: Deltas computed from PSNR.
        ssim: Deltas computed from SSIM.
    """

    method: str
    psnr: BjontegaardDeltas
    ssim: BjontegaardDeltas


@dataclass(frozen=True, slots=True, eq=False)
class Summary:
    """Results of a comparison.

    Attributes:
        points: Operating points in the order of the command line.
        reference: Method with which all other methods are compared; None if there is only one
            method.
        deltas: Deltas of every other method; a method is omitted if both it and the reference
            method have only one point.
    """

    points: list[OperatingPoint]
    reference: str | None
    deltas: list[MethodDeltas]


def summarize(comparison: Comparison) -> Summary:
    """Summarize a comparison."""
    groups = _group_by_label(comparison.measured_entries)
    first = next(iter(groups.values()))
    points = [
        _make_point(label, runs, None if runs is first else first, comparison.frames_per_second)
        for label, runs in groups.items()
    ]
    point_counts = Counter(point.label.method for point in points)
    methods = list(point_counts)
    deltas = [
        MethodDeltas(
            method,
            *(_compare_methods(points, methods[0], method, metric) for metric in ("psnr", "ssim")),
        )
        for method in methods[1:]
        if max(point_counts[methods[0]], point_counts[method]) > 1
    ]
    return Summary(points, methods[0] if len(methods) > 1 else None, deltas)


def _group_by_label(measured_entries: Sequence[MeasuredEntry]) -> dict[Label, list[MeasuredEntry]]:
    groups: dict[Label, list[MeasuredEntry]] = {}
    for entry in measured_entries:
        groups.setdefault(entry.label, []).append(entry)
    return groups


def _make_point(
    label: Label,
    runs: Sequence[MeasuredEntry],
    reference_runs: Sequence[MeasuredEntry] | None,
    frames_per_second: float,
) -> OperatingPoint:
    means = [run.quality.mean() for run in runs]
    sizes = [run.info.byte_count for run in runs]
    kilobytes_per_frame = [
        size / len(run.info.frames) / KILOBYTE
        for run, size in zip(runs, sizes, strict=True)
        if size is not None
    ]
    rate = compute_statistics_or_none(kilobytes_per_frame)
    return OperatingPoint(
        label,
        runs[0].info.kind,
        len(runs),
        {name: compute_statistics_or_none(_list_values(means, name)) for name in means[0]},
        compute_statistics_or_none([size for size in sizes if size is not None]),
        any(run.info.is_size_stated for run in runs),
        rate,
        None if rate is None else rate.mean * KILOBYTE * 8 * frames_per_second / _MEGABIT,
        None if reference_runs is None else compute_paired_difference(runs, reference_runs),
        frozenset(len(run.info.frames) for run in runs),
    )


def compute_statistics_or_none(numbers: Sequence[float]) -> Statistics | None:
    """Return the mean and deviation of numbers; None for an empty sequence."""
    return compute_statistics(numbers) if numbers else None


def compute_statistics(numbers: Sequence[float]) -> Statistics:
    """Return the mean and deviation of a non-empty sequence of numbers."""
    return Statistics(fmean(numbers), stdev(numbers) if len(numbers) > 1 else None)


def compute_paired_difference(
    runs: Sequence[MeasuredEntry], reference_runs: Sequence[MeasuredEntry]
) -> PairedDifference:
    """Return the PSNR differences between the views of two points, after averaging over runs."""
    psnr, reference_psnr = _list_view_psnr(runs), _list_view_psnr(reference_runs)
    differences = [
        psnr_value - reference_value
        for psnr_value, reference_value in zip(psnr, reference_psnr, strict=True)
    ]
    better_share = fmean(_score(difference) for difference in differences)
    return PairedDifference(compute_statistics(differences), better_share, len(differences))


def _score(difference: float) -> float:
    """Return 1 for a higher PSNR, 0 for a lower one, and 1/2 for one that is equal when printed."""
    return 0.5 if abs(difference) < _MIN_DIFFERENCE else float(difference > 0)


def _list_view_psnr(runs: Sequence[MeasuredEntry]) -> list[float]:
    """Return the PSNR of every measured view, averaged over the runs."""
    psnr_by_run = [
        [
            _require_value(view["psnr"])
            for views in run.quality.per_camera.values()
            for view in views
            if view
        ]
        for run in runs
    ]
    return [fmean(values) for values in zip(*psnr_by_run, strict=True)]


def _require_value(value: float | None) -> float:
    if value is None:
        message = "a view has no PSNR"
        raise ValueError(message)
    return value


def _list_values(rows: Iterable[Measures], name: str) -> list[float]:
    return [value for row in rows if (value := row[name]) is not None]


def _build_curve(points: Sequence[OperatingPoint], method: str, metric: str) -> Curve:
    """Return the rate and quality of a method's points; points of unknown rate are omitted."""
    return [
        (point.kilobytes_per_frame.mean, quality.mean)
        for point in points
        if point.label.method == method
        and point.kilobytes_per_frame is not None
        and (quality := point.metrics[metric]) is not None
    ]


def _compare_methods(
    points: Sequence[OperatingPoint], reference_method: str, method: str, metric: str
) -> BjontegaardDeltas:
    counts = sorted(
        {
            count
            for point in points
            if point.label.method in (reference_method, method)
            for count in point.frame_counts
        }
    )
    if len(counts) > 1:
        remark = (
            f"the entries have {' and '.join(map(str, counts))} frames, so their bytes per frame "
            "include different shares of the first frame"
        )
        return BjontegaardDeltas(None, None, remark)
    return compare_curves(
        _build_curve(points, reference_method, metric), _build_curve(points, method, metric)
    )
