"""Groups rows by capture and held-out set."""

from collections.abc import Iterable
from dataclasses import dataclass

from quality.seed_statistics import Statistics, summarize_figures
from studies import Row

# For each column: heading, name of the figure, format specification.
COLUMNS = (
    ("PSNR", "held_out_psnr", ".2f"),
    ("cc", "held_out_cc_psnr", ".2f"),
    ("SSIM", "held_out_ssim", ".4f"),
    ("LPIPS", "held_out_lpips", ".4f"),
    ("moving", "held_out_moving_psnr", ".2f"),
    ("moving cc", "held_out_moving_cc_psnr", ".2f"),
    ("static cc", "held_out_static_cc_psnr", ".2f"),
    ("flicker", "held_out_flicker", ".2f"),
    ("truth flicker", "held_out_truth_flicker", ".2f"),
    ("training gain", "training_gain_psnr", ".2f"),
    ("training moving", "training_moving_gain_psnr", ".2f"),
    ("training static", "training_static_gain_psnr", ".2f"),
    ("dB / 100", "held_out_slope", ".1f"),
    ("Gaussians", "gaussians", ".0f"),
    ("side B", "bytes_side", ".0f"),
    ("canonical B", "bytes_canonical", ".0f"),
    ("motion B", "bytes_motion", ".0f"),
    ("updates B", "bytes_updates", ".0f"),
    ("births B", "bytes_births", ".0f"),
    ("other B", "bytes_other", ".0f"),
    ("KB / frame", "kb_per_frame", ".2f"),
    ("s first", "seconds_first", ".1f"),
    ("s / frame", "seconds_frame", ".2f"),
)
COLUMN_NAMES = tuple(name for _, name, _ in COLUMNS)


@dataclass(frozen=True, slots=True)
class Group:
    """The rows of a capture and a held-out set; they differ only in the seed.

    Attributes:
        capture: Name of the capture.
        held_out_set: Ordinal of the held-out set.
        rows: Rows in the order of the seeds.
    """

    capture: str
    held_out_set: int
    rows: tuple[Row, ...]

    @property
    def label(self) -> str:
        """Name for tables and plots."""
        return f"{self.capture}/{self.held_out_set}"

    def compute_statistics(self) -> dict[str, Statistics]:
        """Return the mean and deviation of each figure over the seeds."""
        return summarize_figures(row["figures"] for row in self.rows)

    def compute_frame_statistics(self) -> list[dict[str, Statistics]]:
        """Return for each frame the statistics of each figure that is measured on cameras."""
        return [
            summarize_figures(
                {
                    f"{group}_{name}": value
                    for group, frames in row["per_frame"].items()
                    for name, value in frames[frame].items()
                }
                for row in self.rows
            )
            for frame in range(self.rows[0]["frames"])
        ]

    def as_json(self) -> dict[str, object]:
        """Return the group as a JSON object."""
        return {
            "capture": self.capture,
            "held_out_set": self.held_out_set,
            "held_out": self.rows[0]["held_out"],
            "fingerprint": self.rows[0]["protocol"]["fingerprint"],
            "frames": self.rows[0]["frames"],
            "seeds": [row["seed"] for row in self.rows],
            "figures": {
                name: statistics.as_json() for name, statistics in self.compute_statistics().items()
            },
        }


def group_rows(rows: Iterable[Row]) -> list[Group]:
    """Return a group for each pair of capture and held-out set, in order of appearance."""
    grouped: dict[tuple[str, int], list[Row]] = {}
    for row in rows:
        grouped.setdefault((row["capture"], row["held_out_set"]), []).append(row)
    return [Group(*key, tuple(members)) for key, members in grouped.items()]
