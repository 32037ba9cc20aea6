"""Options of a synthetic capture, and random numbers that depend on its seed."""

from dataclasses import dataclass
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from quarc_ref.synth.variants import VARIANTS, Variant

_MIN_SIDE = 16
_MAX_CAMERAS = 99


@dataclass(frozen=True, slots=True)
class SynthOptions:
    """Options of a synthetic capture, except for its folder.

    Attributes:
        width: Picture width in pixels; must be even.
        height: Picture height in pixels; must be even.
        frames: Number of frames of every camera.
        frames_per_second: Frame rate of every camera.
        seed: Seed of the random colors, patterns, motions and camera positions.
        cameras: Number of training cameras; the capture also has one held-out camera.
        variant: Name of the variant of the scene, a key of `VARIANTS`.
        has_masks: Whether the capture has masks of the robot, which are its alpha: the background
            is transparent. Only the variants that show the robot alone can have them.
    """

    width: int = 160
    height: int = 120
    frames: int = 24
    frames_per_second: int = 30
    seed: int = 0
    cameras: int = 12
    variant: str = "playroom"
    has_masks: bool = False

    def __post_init__(self) -> None:
        for name in ("width", "height"):
            size = getattr(self, name)
            if size < _MIN_SIDE or size % 2:
                message = f"{name} is {size}; it must be even and at least {_MIN_SIDE}"
                raise ValueError(message)
        for name, minimum in (("frames", 1), ("frames_per_second", 1), ("seed", 0), ("cameras", 2)):
            if getattr(self, name) < minimum:
                message = f"{name} is {getattr(self, name)}, below {minimum}"
                raise ValueError(message)
        if self.cameras > _MAX_CAMERAS:
            message = f"cameras is {self.cameras}; it must be at most {_MAX_CAMERAS}"
            raise ValueError(message)
        if self.variant not in VARIANTS:
            message = f"variant is {self.variant!r}, not one of {', '.join(VARIANTS)}"
            raise ValueError(message)
        if self.has_masks and not self.variant_properties.is_hall:
            stages = ", ".join(name for name, variant in VARIANTS.items() if variant.is_hall)
            message = f"variant {self.variant} has no masks; {stages} have them"
            raise ValueError(message)

    @property
    def variant_properties(self) -> Variant:
        """The properties of the scene's variant."""
        return VARIANTS[self.variant]


def draw_uniform(seed: int, purpose: str, count: int) -> NDArray[np.float64]:
    """Return uniform random numbers from 0 to 1 that depend on a seed and a purpose."""
    return make_generator(seed, purpose).random(count)


def make_generator(seed: int, purpose: str) -> np.random.Generator:
    """Return a random number generator that is independent for every seed and purpose."""
    return np.random.default_rng([seed, crc32(purpose.encode())])
