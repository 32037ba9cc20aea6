"""encoder/: hand-written scenes for testing encoders."""

from math import sqrt
from typing import Any

from making.scenes import pick_between


def make_scenes() -> dict[str, Any]:
    """Return the scenes by name."""
    header = {"level": 10, "level_count": 2, "gaussians_per_anchor": 2, "anchor_ratio": 2}
    shifts = [[0.01, -0.02, 0.0], [0.0, 0.0, 0.05], [0.0, 0.0, 0.0]]
    births = [
        {"births": _make_gaussians(3, 8)},
        {"shift": shifts[0]},
        {"births": _make_gaussians(2, 9)},
    ]
    return {
        "moved": _make_scene(header | {"sh_degree": 1}, 12, [{"shift": shift} for shift in shifts]),
        "born": _make_scene(header | {"sh_degree": 0, "rotation_bits": 10}, 7, births),
    }


def _make_scene(header: dict[str, int], count: int, frames: list[Any]) -> dict[str, Any]:
    return {"header": header, "canonical": _make_gaussians(count, count), "frames": frames}


def _make_gaussians(count: int, seed: int) -> list[dict[str, list[float]]]:
    return [_make_gaussian(seed, number) for number in range(count)]


def _make_gaussian(seed: int, number: int) -> dict[str, list[float]]:
    def make_numbers(size: int, field_number: int, limit: float) -> list[float]:
        numbers = (pick_between(-1000, 1000, seed, number, field_number, k) for k in range(size))
        return [round(value * limit / 1000, 6) for value in numbers]

    quaternion = make_numbers(4, 2, 1.0)
    length = sqrt(sum(v * v for v in quaternion)) or 1.0
    return {
        "position": make_numbers(3, 1, 0.5),
        "rotation": [v / length for v in quaternion],
        "log_scales": [v - 3 for v in make_numbers(3, 3, 1.0)],
        "opacity": make_numbers(1, 4, 3.0),
        "sh_dc": make_numbers(3, 5, 1.5),
        "sh_rest": make_numbers(9, 6, 0.2),
    }
