"""Paints (patterns with three colors and parameters), and palettes chosen from a seed.

Colors are chosen in Oklab, where different hues of equal lightness and chroma look equally
bright and equally colorful.
"""

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.options import draw_uniform

Color = tuple[float, float, float]

_OKLAB_TO_CONE = np.array(
    [
        [1.0, 0.3963377774, 0.2158037573],
        [1.0, -0.1055613458, -0.0638541728],
        [1.0, -0.0894841775, -1.2914855480],
    ]
)
_CONE_TO_LINEAR = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)
_MIN_COMPONENT, _MAX_COMPONENT = 0.01, 0.92


@dataclass(frozen=True, slots=True)
class Paint:
    """Appearance of a surface.

    Attributes:
        pattern: One of the patterns of `texture_kernels`.
        first: First color, linear RGB from 0 to 1.
        second: Second color, linear RGB from 0 to 1.
        third: Third color, linear RGB from 0 to 1.
        scale: Period of the pattern in meters; patterns without a period ignore it.
        phase: Offset of the pattern; for the pattern `SCREEN`, the share of the second picture.
        gloss: Strength of specular highlights.
        glow: Emitted light as a multiple of the color.
    """

    pattern: int
    first: Color
    second: Color
    third: Color
    scale: float = 1.0
    phase: float = 0.0
    gloss: float = 0.0
    glow: float = 0.0

    def as_row(self) -> NDArray[np.float64]:
        """Return the paint as `[14]` numbers: colors, scale, phase, gloss, glow and pattern."""
        pattern, *attributes = astuple(self)
        return np.hstack((*attributes, pattern))


@dataclass(frozen=True, slots=True)
class Palette:
    """Colors of a scene.

    Attributes:
        toy_colors: Six saturated colors of different hues for toys and other objects.
        light: Off-white.
        dark: Nearly black.
        wood: Light and dark color of the floor and the furniture.
        brick: Light and dark color of bricks, and color of the mortar.
        wall: Light and dark color of the wallpaper, and color of the paneling.
    """

    toy_colors: tuple[Color, ...]
    light: Color
    dark: Color
    wood: tuple[Color, Color]
    brick: tuple[Color, Color, Color]
    wall: tuple[Color, Color, Color]


def oklab_to_linear(lightness: float, chroma: float, hue: float) -> Color:
    """Convert an Oklab color, whose hue is in turns, to linear RGB."""
    angle = 2 * math.pi * hue
    lab = np.array([lightness, chroma * math.cos(angle), chroma * math.sin(angle)])
    linear = np.clip(_CONE_TO_LINEAR @ (_OKLAB_TO_CONE @ lab) ** 3, _MIN_COMPONENT, _MAX_COMPONENT)
    return float(linear[0]), float(linear[1]), float(linear[2])


def choose_palette(seed: int) -> Palette:
    """Choose the colors of a scene from a seed."""
    first_toy_hue, wall_hue, wood_tone, brick_tone = draw_uniform(seed, "palette", 4)
    toy_lightnesses = (0.66, 0.78, 0.62, 0.70, 0.58, 0.64)
    wood_hue = 0.15 + 0.05 * wood_tone
    brick_hue = 0.08 + 0.12 * brick_tone
    return Palette(
        toy_colors=tuple(
            oklab_to_linear(toy_lightnesses[i], 0.14, first_toy_hue + i / 6) for i in range(6)
        ),
        light=oklab_to_linear(0.95, 0.015, wall_hue),
        dark=oklab_to_linear(0.28, 0.03, wall_hue),
        wood=(oklab_to_linear(0.72, 0.085, wood_hue), oklab_to_linear(0.53, 0.08, wood_hue)),
        brick=(
            oklab_to_linear(0.60, 0.10, brick_hue),
            oklab_to_linear(0.47, 0.09, brick_hue),
            oklab_to_linear(0.80, 0.02, brick_hue),
        ),
        wall=(
            oklab_to_linear(0.86, 0.045, wall_hue),
            oklab_to_linear(0.76, 0.065, wall_hue),
            oklab_to_linear(0.93, 0.012, wall_hue + 0.5),
        ),
    )


def mix(first: Sequence[float], second: Sequence[float], share: float) -> Color:
    """Interpolate between two colors in linear RGB."""
    r, g, b = (a + share * (b - a) for a, b in zip(first, second, strict=True))
    return r, g, b
