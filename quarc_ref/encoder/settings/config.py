"""All encoder settings, with their defaults and descriptions.

Where the QuARC-GS paper states a value, the default is that value. `presets` defines named sets
of settings; `--set motion.lr=5e-4` changes a single setting. The metadata of a field contains
its description, which `quarc-ref encode --list-settings` prints. Each iteration is one optimizer
step; lengths are in world units unless stated otherwise.
"""

from dataclasses import dataclass, field, replace

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.settings.frames import BirthSettings, MotionSettings, UpdateSettings
from quarc_ref.encoder.settings.ranges import (
    FrameKilobytes,
    NonNegativeFloat,
    PositiveFloat,
    Quality,
    Seed,
    Validated,
)
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.described import described
from quarc_ref.format.frame_rate import to_clock
from quarc_ref.format.records import StreamHeader


@dataclass(frozen=True, slots=True)
class StepSettings(Validated):
    """Quantization steps relative to the capture's resolution (not in the paper)."""

    position_pixels: NonNegativeFloat = described(
        0.0,
        "Quantization step of Gaussian positions, in pixels at the scene's distance; 0: use "
        "stream.position_step, which is in lattice units.",
    )
    translation_change: NonNegativeFloat = described(
        0.0,
        "Root-mean-square pixel change, as a fraction of white, that a shift of the pictures of "
        "frame 0 by one translation step should cause. The translation step is chosen accordingly, "
        "but is at most one pixel. 0: use stream.translation_step, which is in lattice units.",
    )
    translation_error: NonNegativeFloat = described(
        0.0,
        "Root-mean-square pixel change that a shift by one translation step should cause, relative "
        "to the root-mean-square error of frame 0 after its training. Segments need equal steps, "
        "so they use steps.translation_change instead. 0: use steps.translation_change.",
    )


# Settings that cannot be changed, because the encoder sets them, and what determines them.
FIXED_SETTINGS = {
    "stream.level": "the number of Gaussians",
    "stream.timescale": "the frame rate of the capture",
    "stream.frame_ticks": "the frame rate of the capture",
    "stream.seed": "the setting seed",
    "stream.snapshots": "canonical.snapshot_interval",
}
# Settings that have no effect unless these fields of `StepSettings` are 0.
_REPLACED_SETTINGS = {
    "stream.position_step": ("position_pixels",),
    "stream.translation_step": ("translation_change", "translation_error"),
}


@dataclass(frozen=True, slots=True)
class EncoderConfig(Validated):
    """All settings of an encode.

    Attributes:
        stream: Header fields. The encoder replaces those in `FIXED_SETTINGS`, and steps that
            `steps` sets.
        steps: Quantization steps relative to the capture's resolution.
        canonical: Settings of the training of frame 0, and of keyframes.
        motion: Settings of stage 1 (motion) of later frames.
        updates: Settings of updates of individual Gaussians in stage 1, used if
            `stream.updates` is set.
        births: Settings of stage 2 (births) of later frames.
    """

    stream: StreamHeader = field(default_factory=StreamHeader)
    steps: StepSettings = field(default_factory=StepSettings)
    canonical: CanonicalSettings = field(default_factory=CanonicalSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    updates: UpdateSettings = field(default_factory=UpdateSettings)
    births: BirthSettings = field(default_factory=BirthSettings)
    quality: Quality = described(
        50.0, "Quality, 0 to 100 (--quality): an increase of 20 halves all rate-distortion weights."
    )
    rd_lambda: PositiveFloat = described(
        1.0,
        "Factor by which all rate-distortion weights are multiplied (--lambda); larger values "
        "mean fewer bytes and lower quality.",
    )
    target_kb_per_frame: FrameKilobytes = described(
        0.0,
        "Target for the mean size of the frames that are not keyframes, in units of 1024 bytes; "
        "0: no target.",
    )
    seed: Seed = described(
        0,
        "Seed of all random numbers, which determine the sampled anchors, the order of views, the "
        "noise and the positions of new Gaussians.",
    )


def find_replacement(config: EncoderConfig, path: str) -> str | None:
    """Return the name of the setting that replaces another one; None if that one has an effect."""
    for name in _REPLACED_SETTINGS.get(path, ()):
        if getattr(config.steps, name):
            return f"steps.{name}"
    return None


def limit_gaussians(config: EncoderConfig, view_count: int) -> EncoderConfig:
    """Return the settings for a number of training views: `CanonicalSettings.limit_to_views`."""
    return replace(config, canonical=config.canonical.limit_to_views(view_count))


def make_header(
    config: EncoderConfig, frames_per_second: float, gaussian_count: int
) -> StreamHeader:
    """Make the header of a stream.

    Args:
        config: All settings; `config.stream` provides the fields that are not set here.
        frames_per_second: Frame rate of the capture.
        gaussian_count: Number of Gaussians in the canonical frame. The conformance level is the
            lowest one that allows `gaussian_count` + `births.max_births` Gaussians, and
            `births.max_births` births.
    """
    timescale, frame_ticks = to_clock(frames_per_second)
    max_births = config.births.max_births
    max_gaussians = gaussian_count + max_births
    return replace(
        config.stream,
        level=min(
            level
            for level, limits in LEVELS.items()
            if max_gaussians <= limits.gaussians and max_births <= limits.births
        ),
        timescale=timescale,
        frame_ticks=frame_ticks,
        seed=config.seed,
        snapshots=config.canonical.snapshot_interval > 0,
    )
