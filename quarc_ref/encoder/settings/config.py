"""All encoder settings, with their defaults and what they mean.

The defaults are the paper's values where it states one. `presets` names whole sets of
settings; `--set motion.lr=5e-4` changes one. Fields carry their description as metadata,
which `quarc-ref encode --list-settings` prints. Iteration counts are optimizer steps;
lengths are world units unless stated otherwise.
"""

from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Literal

from quarc_ref.encoder.settings.ranges import (
    Logit,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    Quality,
    Seed,
    UnitInterval,
    Validated,
)
from quarc_ref.format import container
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.described import described
from quarc_ref.format.records import StreamHeader

RateModel = Literal["l1", "group_log"]
Placement = Literal["gate", "errors"]
WarmStart = Literal["anchors", "projection"]


@dataclass(frozen=True, slots=True)
class StepSettings(Validated):
    """Quantization steps relative to the capture's resolution (not in the paper)."""

    position_pixels: NonNegativeFloat = described(
        0.0,
        "Step of Gaussian positions, in pixels at the scene's distance; 0 takes "
        "stream.position_step, in lattice units.",
    )
    translation_change: NonNegativeFloat = described(
        0.0,
        "Step of translation residuals: the shift that changes the pictures of frame 0 by this "
        "much on average (white is 1), at most one pixel; 0 takes stream.translation_step.",
    )


@dataclass(frozen=True, slots=True)
class CanonicalSettings(Validated):
    """Canonical frames: training of frame 0 (3DGS; paper section 3), and later keyframes."""

    keyframe_interval: NonNegativeInt = described(
        0, "Frames between keyframes (canonical frames); 0: only frame 0 is one (paper)."
    )
    snapshot_interval: NonNegativeInt = described(
        0,
        "Frames between snapshots, which are keyframes coded against the last canonical frame "
        "(SPEC 7.9); 0 for none (paper).",
    )
    iterations: PositiveInt = described(15_000, "Training iterations (paper: 15 000).")
    initial_gaussians: PositiveInt = described(
        1 << 20, "Maximum number of initial points used; more are subsampled."
    )
    max_gaussians: PositiveInt = described(1 << 20, "Maximum number of Gaussians.")
    sh_from_iter: NonNegativeInt = described(
        1000, "Iteration from which SH degree 1 is trained (paper: 1000)."
    )
    lambda_dssim: UnitInterval = described(
        0.2, "Weight of D-SSIM in the loss; the rest is L1 (paper: 0.2)."
    )
    position_noise: NonNegativeFloat = described(
        0.01, "Standard deviation of noise added to positions (paper: 0.01)."
    )
    axis_noise: NonNegativeFloat = described(
        0.0,
        "Standard deviation of noise along each Gaussian's axes, in its scales; decays linearly "
        "to 0 at the start of fine-tuning (not in the paper).",
    )
    densify_from_iter: NonNegativeInt = described(500, "First iteration of densification (500).")
    densify_until_iter: NonNegativeInt = described(5000, "Last iteration of densification (5000).")
    densification_interval: PositiveInt = described(100, "Iterations between densifications (100).")
    densify_grad_threshold: NonNegativeFloat = described(
        2e-4, "Mean screen-space gradient, in NDC, above which a Gaussian is densified (2e-4)."
    )
    densify_scale_threshold: NonNegativeFloat = described(
        0.01, "Scale, relative to the extent, above which it is split and not cloned (0.01)."
    )
    prune_opacity: UnitInterval = described(
        0.005, "Opacity below which densification prunes a Gaussian (0.005)."
    )
    final_prune_opacity: UnitInterval = described(
        0.005, "Opacity below which a Gaussian is pruned after training (0.005)."
    )
    half_resolution_until_iter: NonNegativeInt = described(
        0, "Iterations that train at half width and height, for speed."
    )
    exposure_lr: UnitInterval = described(
        0.0,
        "Rate at which a camera's color gains follow their estimate, per iteration; 0: all "
        "cameras have the same exposure (paper).",
    )
    exposure_from_iter: NonNegativeInt = described(
        200, "Iteration from which exposures are estimated."
    )
    opacity_decay: UnitInterval = described(
        0.0,
        "Fraction of its opacity that a Gaussian loses each time it is rendered, from the first "
        "densification to fine-tuning (not in the paper; 4C4D: 0.001).",
    )
    opacity_reg: NonNegativeFloat = described(
        0.0, "Weight of the mean opacity in the loss (not in the paper; 3DGS-MCMC: 0.01)."
    )
    scale_reg: NonNegativeFloat = described(
        0.0, "Weight of the mean scale in the loss (not in the paper; 3DGS-MCMC: 0.01)."
    )
    quantize_from: UnitInterval = described(
        0.8,
        "Fraction of the iterations after which all attributes are quantized while training: "
        "fine-tuning (not in the paper).",
    )
    prune_rd_lambda: NonNegativeFloat = described(
        0.0,
        "Rate-distortion weight of a Gaussian: those that change the pictures by less than this "
        "many medians of the squared error around a Gaussian are pruned after densification, and "
        "at half the weight halfway; 0 keeps all (paper).",
    )
    code_rd_lambda: NonNegativeFloat = described(
        0.0,
        "Rate-distortion weight of the estimated nats of a Gaussian's codes other than position "
        "and opacity, relative to the loss (not in the paper).",
    )
    lr_end_factor: UnitInterval = described(
        1.0, "Learning rates at the end of fine-tuning, relative to its start; cosine decay."
    )
    position_lr: PositiveFloat = described(
        1.6e-4, "Initial learning rate of positions, relative to the extent (1.6e-4)."
    )
    position_lr_final: PositiveFloat = described(
        1.6e-6, "Final learning rate of positions, relative to the extent (1.6e-6)."
    )
    sh_dc_lr: NonNegativeFloat = described(2.5e-3, "Learning rate of SH degree 0 (2.5e-3).")
    sh_rest_lr: NonNegativeFloat = described(
        2.5e-3 / 20, "Learning rate of SH degree 1 (2.5e-3 / 20)."
    )
    opacity_lr: NonNegativeFloat = described(0.05, "Learning rate of opacity logits (0.05).")
    scale_lr: NonNegativeFloat = described(5e-3, "Learning rate of log-scales (5e-3).")
    rotation_lr: NonNegativeFloat = described(1e-3, "Learning rate of rotations (1e-3).")

    def kind_due(self, frame: int) -> bytes:
        """The chunk type of a frame: CANO, SNAP or FRAM."""
        if frame == 0 or (self.keyframe_interval and frame % self.keyframe_interval == 0):
            return container.CANO
        if self.snapshot_interval and frame % self.snapshot_interval == 0:
            return container.SNAP
        return container.FRAM


@dataclass(frozen=True, slots=True)
class MotionSettings(Validated):
    """Stage 1 of a frame: motion residuals of the anchors (paper section 4)."""

    iterations: NonNegativeInt = described(100, "Iterations of a frame's motion (paper: 100).")
    lr: NonNegativeFloat = described(
        5e-4, "Learning rate of residuals at level 1, world units (paper: 5e-4)."
    )
    translation_lr: NonNegativeFloat = described(
        0.0,
        "Learning rate of translations at level 1, in their quantization steps, so that it scales "
        "with the capture (not in the paper); 0 takes motion.lr.",
    )
    level_lr_factor: NonNegativeFloat = described(
        1.0, "Factor of the learning rate from an anchor level to the next coarser one (1)."
    )
    lr_end_factor: UnitInterval = described(
        1.0, "Learning rates at the last iteration, relative to the first; cosine decay (1)."
    )
    lambda_dssim: UnitInterval = described(
        0.2, "Weight of D-SSIM in the loss; the rest is L1 (0.2)."
    )
    rate_model: RateModel = described(
        "l1",
        "Estimate of the residuals' rate: l1, their mean magnitude in world units (paper), or "
        "group_log, the mean over anchors of ln(1 + norm of the anchor's symbols).",
    )
    rd_lambda: NonNegativeFloat = described(
        1.0,
        "Rate-distortion weight of that estimate in the loss (1 with l1); with group_log it is "
        "relative to the loss of decoded frame 0.",
    )
    warm_start: WarmStart = described(
        "anchors",
        "Initial residuals: anchors, the previous residual of the anchor or the mean of its three "
        "nearest (paper), or projection, each Gaussian's previous motion fitted from the coarsest "
        "level to the finest.",
    )
    momentum: NonNegativeFloat = described(
        0.6, "Factor of the previous motion in the initial residuals (0.6)."
    )


@dataclass(frozen=True, slots=True)
class BirthSettings(Validated):
    """Stage 2 of a frame: new Gaussians where the scene changes (paper section 5)."""

    iterations: NonNegativeInt = described(
        100, "Iterations of a frame's new Gaussians (paper: 100); 0 for no births."
    )
    placement: Placement = described(
        "gate",
        "Where new Gaussians start: gate, clones of Gaussians that pass the change gate (paper), "
        "or errors, at the pixels with the largest error.",
    )
    gate_views: NonNegativeInt = described(
        4, "Training views of the change gate (4); 0 lets all Gaussians pass."
    )
    grad_threshold: NonNegativeFloat = described(
        1.5e-4, "Gated screen-space gradient, in NDC, above which a Gaussian is cloned (1.5e-4)."
    )
    error_threshold: NonNegativeFloat = described(
        0.08, "Mean absolute error over the colors above which a pixel gets a Gaussian."
    )
    error_radius: NonNegativeInt = described(
        1, "Pixels on each side among which such a pixel must have the largest error."
    )
    death_opacity: UnitInterval = described(
        1.0,
        "Opacity below which a Gaussian may be deleted to make room for a new one; at 1 all may, "
        "which keeps the number of Gaussians constant (paper).",
    )
    max_births: NonNegativeInt = described(1 << 12, "Maximum number of new Gaussians of a frame.")
    max_parent_scale: NonNegativeFloat = described(
        0.01, "Largest scale of a cloned Gaussian, relative to the extent (0.01)."
    )
    spread: NonNegativeFloat = described(
        2.0, "Standard deviation of a clone's offset, in scales of its parent (2)."
    )
    opacity_logit: Logit = described(0.1, "Initial opacity logit (0.1).")
    lr_factor: NonNegativeFloat = described(
        15.0, "Learning rates relative to those of canonical frames (15)."
    )
    lr_end_factor: UnitInterval = described(
        1.0, "Learning rates at the last iteration, relative to the first; cosine decay (1)."
    )
    split_iters: tuple[int, ...] = described(
        (40, 80), "Iterations at which large new Gaussians are split (40, 80)."
    )
    prune_opacity: UnitInterval = described(
        0.01, "Opacity below which a new Gaussian is pruned (0.01)."
    )
    prune_radius: NonNegativeFloat = described(
        20.0, "Screen radius, in pixels, above which a new Gaussian is pruned (20)."
    )
    prune_scale: NonNegativeFloat = described(
        0.1, "Scale, relative to the extent, above which a new Gaussian is pruned (0.1)."
    )
    rd_selection: bool = described(
        False,
        "Keep only new Gaussians that lower the loss of the training views by more than their "
        "bytes cost (not in the paper).",
    )
    rd_lambda: NonNegativeFloat = described(
        0.0,
        "Rate-distortion weight of a byte of births: the decrease of the mean loss of the training "
        "views that it must buy, relative to the loss of decoded frame 0, times the number of "
        "Gaussians (not in the paper).",
    )


@dataclass(frozen=True, slots=True)
class UpdateSettings(Validated):
    """Updates of single Gaussians, in streams that allow them (SPEC 7.8; not in the paper)."""

    lr: NonNegativeFloat = described(
        0.12, "Learning rate of residuals, in their quantization steps; 0 for no updates."
    )
    rd_lambda: NonNegativeFloat = described(
        0.2,
        "Rate-distortion weight of the mean over Gaussians of ln(1 + norm of its residuals in "
        "steps), relative to the loss of decoded frame 0.",
    )
    select_at: UnitInterval = described(
        0.5, "Fraction of the iterations after which the Gaussians to update are selected."
    )
    min_gain: NonNegativeFloat = described(
        0.5,
        "Decrease of the mean loss of the training views that an update must bring, relative to "
        "the loss of decoded frame 0, times the number of Gaussians.",
    )
    death_opacity: UnitInterval = described(
        0.02, "Opacity below which a Gaussian that an update fades is deleted."
    )


@dataclass(frozen=True, slots=True)
class EncoderConfig(Validated):
    """All settings of an encode.

    Attributes:
        stream: Header fields; the encoder sets clock, conformance level, seed and snapshots.
        steps: Header fields that are derived from the capture.
        canonical: Canonical frames.
        motion: Stage 1 of every other frame.
        updates: Updates of single Gaussians, part of stage 1, where `stream.updates` is set.
        births: Stage 2 of every other frame.
    """

    stream: StreamHeader = field(default_factory=StreamHeader)
    steps: StepSettings = field(default_factory=StepSettings)
    canonical: CanonicalSettings = field(default_factory=CanonicalSettings)
    motion: MotionSettings = field(default_factory=MotionSettings)
    updates: UpdateSettings = field(default_factory=UpdateSettings)
    births: BirthSettings = field(default_factory=BirthSettings)
    quality: Quality = described(
        50.0, "Quality, 0 to 100 (--quality): each 20 more halve every rate-distortion weight."
    )
    rd_lambda: PositiveFloat = described(
        1.0, "Factor of every rate-distortion weight (--lambda): larger means fewer bytes."
    )
    target_kb_per_frame: NonNegativeFloat = described(
        0.0, "Target size of a frame that is not a keyframe, in KB of 1024 bytes; 0 for no target."
    )
    seed: Seed = described(
        0, "Seed of all random numbers: anchor sampling, order of views, noise, placement."
    )


def make_header(
    config: EncoderConfig, frames_per_second: float, gaussian_count: int
) -> StreamHeader:
    """The header of a stream.

    Args:
        config: Its `stream`, except for clock, conformance level, seed and snapshots.
        frames_per_second: Frame rate of the capture.
        gaussian_count: Gaussians of the canonical frame; the conformance level leaves room for
            one frame's births besides.
    """
    clock = Fraction(frames_per_second).limit_denominator(_CLOCK_LIMIT)
    most = gaussian_count + config.births.max_births
    return replace(
        config.stream,
        level=min(level for level, limits in LEVELS.items() if most <= limits.gaussians),
        timescale=clock.numerator,
        frame_ticks=clock.denominator,
        seed=config.seed,
        snapshots=config.canonical.snapshot_interval > 0,
    )


_CLOCK_LIMIT = 1001
