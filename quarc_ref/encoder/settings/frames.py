"""Settings of the frames between keyframes: motion, updates and births."""

from dataclasses import dataclass
from typing import Literal

from quarc_ref.encoder.settings.ranges import (
    Logit,
    NonNegativeFloat,
    NonNegativeInt,
    UnitInterval,
    Validated,
)
from quarc_ref.format.described import described

RateModel = Literal["l1", "group_log"]
Placement = Literal["gate", "errors"]
WarmStart = Literal["anchors", "projection"]


@dataclass(frozen=True, slots=True)
class MotionSettings(Validated):
    """Stage 1 of a frame: motion residuals of the anchors (paper section 4)."""

    iterations: NonNegativeInt = described(
        100, "Iterations that train a frame's motion (paper: 100)."
    )
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
        100, "Iterations that train a frame's new Gaussians (paper: 100); 0 for no births."
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
        "views that it must achieve, relative to the loss of decoded frame 0, times the number of "
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
