"""Quality of a stream: metrics of every camera and frame, and their means."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import fmean

from quarc_ref.evaluation.camera_meter import VARIANTS, Measures
from quarc_ref.evaluation.metrics import MAX_DECIBELS

# Heading, name of the metric, format.
EVAL_METRIC_COLUMNS = (
    ("PSNR", "psnr", ".2f"),
    ("cc", "cc_psnr", ".2f"),
    ("SSIM", "ssim", ".4f"),
    ("cc", "cc_ssim", ".4f"),
    ("moving", "moving_psnr", ".2f"),
    ("cc", "moving_cc_psnr", ".2f"),
    ("static", "static_psnr", ".2f"),
    ("cc", "static_cc_psnr", ".2f"),
    ("flicker", "flicker", ".3f"),
    ("of truth", "truth_flicker", ".3f"),
    ("LPIPS", "lpips", ".4f"),
)
_MISSING = "-"


@dataclass(frozen=True, slots=True)
class Quality:
    """Metrics of a stream.

    Attributes:
        per_camera: `Measures` of every frame, by camera name; empty if a view was not measured.
        variants: Description of each metric's exact variant, keyed by metric name.
    """

    per_camera: Mapping[str, Sequence[Measures]]
    variants: Mapping[str, str] = field(default_factory=lambda: VARIANTS)

    @property
    def psnr(self) -> tuple[float, ...]:
        """PSNR of every frame in dB, averaged over the cameras."""
        return self._list_frame_values("psnr")

    @property
    def ssim(self) -> tuple[float, ...]:
        """SSIM (`ssim_inria`) of every frame, averaged over the cameras."""
        return self._list_frame_values("ssim")

    def count_views_at_max_psnr(self) -> tuple[int, int]:
        """Return the number of views whose PSNR is `MAX_DECIBELS`, and the number of all views."""
        psnr = [view["psnr"] for views in self.per_camera.values() for view in views if view]
        return psnr.count(MAX_DECIBELS), len(psnr)

    def by_camera(self) -> dict[str, Measures]:
        """Return the means over the frames, by camera name; None if no view has a value."""
        means = {camera: average(frames) for camera, frames in self.per_camera.items()}
        missing = dict.fromkeys(name for mean in means.values() for name in mean)
        return {camera: {**missing, **mean} for camera, mean in means.items()}

    def by_frame(self) -> list[Measures]:
        """Return the means over the cameras, by frame."""
        return [average(views) for views in zip(*self.per_camera.values(), strict=True)]

    def mean(self) -> Measures:
        """Return the means of `by_camera` over the cameras, which all have the same weight."""
        return average(self.by_camera().values())

    def headings(self) -> list[str]:
        """Return the headings of the metric columns of `as_rows`."""
        return [heading for heading, metric, _ in EVAL_METRIC_COLUMNS if metric in self.mean()]

    def as_rows(self) -> list[list[str]]:
        """Return rows of a name and the metrics: one row per camera and one for their mean."""
        named_metrics = [*self.by_camera().items(), ("mean", self.mean())]
        return [
            [
                name,
                *(
                    _format_metric(metrics[metric], format_spec)
                    for _, metric, format_spec in EVAL_METRIC_COLUMNS
                    if metric in metrics
                ),
            ]
            for name, metrics in named_metrics
        ]

    def as_json(self, frames: Sequence[int]) -> dict[str, object]:
        """Return the quality as part of the output of `eval --json`.

        Args:
            frames: Ordinals of the measured frames. Those between them have null as their values.
        """
        measured = dict(zip(frames, self.by_frame(), strict=True))
        by_frame = [measured.get(frame, {}) for frame in range(frames[0], frames[-1] + 1)]
        mean = self.mean()
        return {
            "psnr": mean["psnr"],
            "ssim": mean["ssim"],
            "psnr_per_frame": [metrics.get("psnr") for metrics in by_frame],
            "ssim_per_frame": [metrics.get("ssim") for metrics in by_frame],
            "quality": {
                "mean": mean,
                "cameras": [
                    {"camera": camera, **metrics} for camera, metrics in self.by_camera().items()
                ],
            },
            "metrics": dict(self.variants),
        }

    def _list_frame_values(self, metric: str) -> tuple[float, ...]:
        return tuple(
            value for metrics in self.by_frame() if (value := metrics.get(metric)) is not None
        )


def average(measures: Iterable[Measures]) -> Measures:
    """Return the mean of each metric over the rows that have a value; None if no row has one."""
    rows = list(measures)
    values_by_name = {
        name: [value for row in rows if (value := row.get(name)) is not None]
        for name in dict.fromkeys(name for row in rows for name in row)
    }
    return {name: fmean(values) if values else None for name, values in values_by_name.items()}


def _format_metric(value: float | None, format_spec: str) -> str:
    return _MISSING if value is None else format(value, format_spec)
