"""Settings of the frames after frame 0: motion, updates and births."""

from dataclasses import dataclass
from typing import Literal

from quarc_ref.encoder.settings.ranges import (
    BirthCount,
    Logit,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFraction,
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
        100,
        "Training iterations of the motion and updates of a frame (paper: 100); 0: the initial "
        "residuals of the motion are coded without training.",
    )
    lr: NonNegativeFloat = described(
        5e-4,
        "Learning rate of motion residuals at anchor level 1 (the finest): that of rotations, as "
        "components of quaternions, and, if motion.translation_lr is 0, that of translations, in "
        "world units (paper: 5e-4).",
    )
    translation_lr: NonNegativeFloat = described(
        0.0,
        "Learning rate of translation residuals at anchor level 1 (the finest), in position "
        "steps, whose size depends on the scale of the capture; 0: motion.lr in world units "
        "(paper).",
    )
    level_lr_factor: NonNegativeFloat = described(
        1.0,
        "Learning rate of an anchor level, relative to that of the next finer level; 1: equal "
        "learning rates (paper).",
    )
    lr_end_factor: UnitInterval = described(
        1.0,
        "Learning rates of motion and updates at the last iteration, relative to the first (cosine "
        "decay); 1: no decay (paper).",
    )
    lambda_dssim: UnitInterval = described(
        0.2,
        "Weight w of D-SSIM in the loss of motion, updates and births; L1 has the weight 1 - w.",
    )
    rate_model: RateModel = described(
        "l1",
        "Model that estimates the rate of motion residuals. l1: their mean magnitude in world "
        "units (paper). group_log: the mean over anchors of ln(1 + norm of the anchor's residuals "
        "in steps).",
    )
    rd_lambda: NonNegativeFloat = described(
        1.0,
        "Rate-distortion weight of the motion residuals. With motion.rate_model=group_log, the "
        "weight is relative to the loss of decoded frame 0; with l1, it is absolute (paper: 1). "
        "0: the loss has no rate term.",
    )
    warm_start: WarmStart = described(
        "anchors",
        "Source of the initial motion residuals. anchors: the residuals of the same anchor in the "
        "previous frame or, after resampling, the mean of the three nearest anchors (paper). "
        "projection: a fit to the previous motion of the Gaussians, from the coarsest anchor level "
        "to the finest.",
    )
    momentum: NonNegativeFloat = described(
        0.6,
        "Factor by which the initial motion residuals of a frame are multiplied; 0: training "
        "starts without motion.",
    )
    follow_exposures: bool = described(
        False,
        "Whether the color gains of the cameras are estimated again in each frame, because "
        "exposures can change over time; changes of up to 1 % are ignored. Only if "
        "canonical.exposure_lr is above 0. False: the gains of frame 0 are kept (paper: no gains).",
    )


@dataclass(frozen=True, slots=True)
class BirthSettings(Validated):
    """Stage 2 of a frame: new Gaussians where the scene changes (paper section 5)."""

    iterations: NonNegativeInt = described(
        100, "Training iterations of the new Gaussians of a frame (paper: 100); 0: no births."
    )
    placement: Placement = described(
        "gate",
        "Where new Gaussians are placed. gate: near the Gaussians that pass the change gate, as "
        "their clones (paper). errors: at the pixels with the largest errors.",
    )
    gate_views: NonNegativeInt = described(
        4,
        "With births.placement=gate, the number of training views that the change gate uses; 0: "
        "all Gaussians pass the gate.",
    )
    grad_threshold: NonNegativeFloat = described(
        1.5e-4,
        "Screen-space gradient, in NDC, above which a new Gaussian larger than "
        "births.max_parent_scale is split at births.split_iters. With births.placement=gate, an "
        "existing Gaussian up to that scale is cloned if its gradient, weighted by the change "
        "gate, is above this threshold.",
    )
    error_threshold: NonNegativeFloat = described(
        0.08,
        "With births.placement=errors, a pixel can get a new Gaussian only if its mean absolute "
        "error over the color channels, 0 to 1, is above this threshold.",
    )
    error_radius: NonNegativeInt = described(
        1,
        "With births.placement=errors, a pixel gets a new Gaussian only if no pixel has a larger "
        "error in the square that extends this many pixels to each side; 0: pixels are not "
        "compared.",
    )
    death_opacity: UnitInterval = described(
        1.0,
        "Opacity, 0 to 1, below which a Gaussian may be deleted to make room for a new one; 1: "
        "any Gaussian may be deleted, which keeps the number of Gaussians constant (paper).",
    )
    max_births: BirthCount = described(
        1 << 12, "Maximum number of new Gaussians per frame; 0: no births."
    )
    max_parent_scale: NonNegativeFloat = described(
        0.01,
        "Scale, relative to the camera extent, above which a new Gaussian can be split at "
        "births.split_iters. With births.placement=gate, only Gaussians up to this scale are "
        "cloned.",
    )
    spread: NonNegativeFloat = described(
        2.0,
        "Standard deviation of the offset of a clone from its parent with births.placement=gate, "
        "as a multiple of the parent's scales.",
    )
    opacity_logit: Logit = described(
        0.1, "Initial opacity of a new Gaussian, as a logit (0: opacity 0.5)."
    )
    lr_factor: NonNegativeFloat = described(
        15.0, "Initial learning rates of new Gaussians, relative to those of frame 0."
    )
    lr_end_factor: UnitInterval = described(
        1.0,
        "Learning rates of new Gaussians at the last iteration, relative to the first (cosine "
        "decay); 1: no decay (paper).",
    )
    split_iters: tuple[int, ...] = described(
        (40, 80),
        "Iterations before which new Gaussians are split (births.grad_threshold) or pruned "
        "(births.prune_opacity, prune_radius and prune_scale); empty: no splits, and pruning only "
        "by opacity, after training.",
    )
    prune_opacity: UnitInterval = described(
        0.01,
        "Opacity, 0 to 1, below which a new Gaussian is pruned at births.split_iters and after "
        "training.",
    )
    prune_radius: NonNegativeFloat = described(
        20.0,
        "Radius on screen, in pixels, above which a new Gaussian is pruned at births.split_iters.",
    )
    prune_scale: NonNegativeFloat = described(
        0.1,
        "Scale, relative to the camera extent, above which a new Gaussian is pruned at "
        "births.split_iters.",
    )
    rd_selection: bool = described(
        False,
        "Code a new Gaussian only if it lowers the loss of the training views by more than the "
        "cost of its bytes, which births.rd_lambda sets (not in the paper).",
    )
    rd_lambda: NonNegativeFloat = described(
        0.0,
        "Rate-distortion weight of births, used with births.rd_selection. The weight is the "
        "decrease of the mean loss of the training views that is required per byte, multiplied by "
        "the number of Gaussians and divided by the loss of decoded frame 0. 0: the new Gaussians "
        "of a frame are coded if together they lower the loss.",
    )


@dataclass(frozen=True, slots=True)
class UpdateSettings(Validated):
    """Updates of individual Gaussians, in streams that allow them (SPEC 7.8; not in the paper)."""

    lr: NonNegativeFloat = described(
        0.16, "Learning rate of the residuals of updates, in quantization steps; 0: no updates."
    )
    rd_lambda: NonNegativeFloat = described(
        0.084,
        "Rate-distortion weight of updates, relative to the loss of decoded frame 0. The rate of "
        "updates is estimated as the mean over all Gaussians of the sum of ln(1 + magnitude in "
        "steps) over their residuals. 0: the loss has no rate term.",
    )
    choose_at: PositiveFraction = described(
        0.6,
        "Fraction of the motion iterations after which the residuals of updates are chosen for the "
        "first time (see updates.quantize_rd_lambda), but at least one iteration. They are chosen "
        "again at the end; between, only those that are not 0 are trained.",
    )
    quantize_rd_lambda: NonNegativeFloat = described(
        0.02,
        "Rate-distortion weight of choosing residuals: a residual is reduced, or set to 0, if this "
        "saves enough bits. Each bit may increase the mean loss of the training views by this "
        "multiple of the loss of decoded frame 0, divided by the number of Gaussians. 0: all "
        "trained residuals are coded.",
    )
    death_opacity: UnitInterval = described(
        0.02,
        "Opacity, 0 to 1, below which a Gaussian is deleted if an update has reduced its opacity.",
    )
