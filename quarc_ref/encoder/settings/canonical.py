"""Settings of the training of frame 0, and of the keyframes after it."""

import math
from collections import Counter
from dataclasses import dataclass, replace

from quarc_ref.encoder.settings.ranges import (
    GaussianCount,
    NonNegativeFloat,
    NonNegativeInt,
    PositiveFloat,
    PositiveInt,
    UnitInterval,
    Validated,
)
from quarc_ref.format import container
from quarc_ref.format.described import described


@dataclass(frozen=True, slots=True)
class CanonicalSettings(Validated):
    """Settings of the training of frame 0 (3DGS; paper section 3), and of later keyframes.

    Later keyframes are trained like all other later frames, by motion, updates and births. Only
    `keyframe_interval` and the settings of snapshots apply to them.
    """

    keyframe_interval: NonNegativeInt = described(
        0,
        "Interval between keyframes (canonical frames), in frames; 0: only frame 0 is a keyframe "
        "(paper).",
    )
    snapshot_interval: NonNegativeInt = described(
        0,
        "Interval between snapshots, in frames; a snapshot is a keyframe that is coded relative to "
        "the last canonical frame (SPEC 7.9). 0: no snapshots (paper).",
    )
    snapshot_dead_zone: NonNegativeInt = described(
        2,
        "Largest change since the last canonical frame that a snapshot undoes to save bytes. The "
        "unit is a translation step for positions and 2^-stream.rotation_bits for rotations. 0: "
        "nothing is undone.",
    )
    iterations: PositiveInt = described(15_000, "Training iterations of frame 0 (paper: 15 000).")
    initial_gaussians: PositiveInt = described(
        1 << 20,
        "Maximum number of initial points to train from; if there are more, a random subset is "
        "used.",
    )
    max_gaussians: GaussianCount = described(
        1 << 20, "Maximum number of Gaussians; fewer with few views (max_gaussians_from_views)."
    )
    max_gaussians_from_views: NonNegativeInt = described(
        0,
        "Number of training views from which canonical.initial_gaussians and "
        "canonical.max_gaussians apply unchanged. With fewer views, both are reduced in "
        "proportion, because the scene would otherwise overfit these views. 0: never reduced "
        "(paper).",
    )
    sh_from_iter: NonNegativeInt = described(
        1000, "First iteration that trains SH degree 1 (paper: 1000)."
    )
    lambda_dssim: UnitInterval = described(
        0.2, "Weight w of D-SSIM in the loss; L1 has the weight 1 - w (paper: 0.2)."
    )
    position_noise: NonNegativeFloat = described(
        0.01,
        "Standard deviation of the noise added to positions during training, in world units "
        "(paper: 0.01); 0: no noise.",
    )
    axis_noise: NonNegativeFloat = described(
        0.0,
        "Standard deviation of the noise added to positions along each Gaussian's axes, as a "
        "multiple of its scales. The noise decreases linearly to 0 at the start of fine-tuning. "
        "0: no noise (paper).",
    )
    densify_from_iter: NonNegativeInt = described(
        500, "First iteration in which Gaussians can be densified."
    )
    densify_until_iter: NonNegativeInt = described(
        5000, "Iteration at which densification ends, at the latest when fine-tuning starts."
    )
    densification_interval: PositiveInt = described(100, "Iterations between densifications.")
    densify_grad_threshold: NonNegativeFloat = described(
        2e-4, "Mean screen-space gradient, in NDC, above which a Gaussian is densified."
    )
    densify_scale_threshold: NonNegativeFloat = described(
        0.01,
        "Scale, relative to the camera extent, above which a densified Gaussian is split instead "
        "of cloned.",
    )
    prune_opacity: UnitInterval = described(
        0.005, "Opacity, 0 to 1, below which densification prunes a Gaussian."
    )
    final_prune_opacity: UnitInterval = described(
        0.005, "Opacity, 0 to 1, below which a Gaussian is pruned after training."
    )
    half_resolution_until_iter: NonNegativeInt = described(
        0,
        "Number of initial iterations that use pictures of half the width and height, for speed; "
        "0: all iterations use the full resolution.",
    )
    ensemble_size: PositiveInt = described(
        1,
        "Number of scenes that are trained from different random numbers. Only the last is trained "
        "to the end and written. The median of all scenes, rendered for cameras between the "
        "training cameras (pseudo-views), is used in its training, and prevents haze in places "
        "that few cameras see. 1: no pseudo-views (paper).",
    )
    ensemble_from_views: NonNegativeInt = described(
        0,
        "Minimum number of training views for an ensemble; with fewer, only one scene is trained.",
    )
    pseudo_views_from: UnitInterval = described(
        0.3,
        "Fraction of the iterations after which pseudo-views are used. The other scenes of the "
        "ensemble are trained only until then.",
    )
    pseudo_view_ratio: UnitInterval = described(
        0.5,
        "Fraction of the following iterations, until the end of densification, that train on a "
        "pseudo-view besides their training view.",
    )
    exposure_lr: UnitInterval = described(
        0.0,
        "Weight of the latest estimate in the moving average of a camera's color gains; 0: no "
        "exposure compensation (paper).",
    )
    exposure_from_iter: NonNegativeInt = described(
        200,
        "First iteration that estimates the color gains of cameras, if canonical.exposure_lr is "
        "above 0.",
    )
    opacity_decay: UnitInterval = described(
        0.0,
        "Fraction of its opacity that a Gaussian loses whenever training renders it in a view or "
        "pseudo-view, from the first densification to the start of fine-tuning; 0: no decay "
        "(paper). 4C4D uses 0.001.",
    )
    opacity_reg: NonNegativeFloat = described(
        0.0,
        "Weight of the mean opacity in the loss; 0: no opacity regularization (paper). 3DGS-MCMC "
        "uses 0.01.",
    )
    scale_reg: NonNegativeFloat = described(
        0.0,
        "Weight of the mean scale in the loss; 0: no scale regularization (paper). 3DGS-MCMC uses "
        "0.01.",
    )
    quantize_from: UnitInterval = described(
        0.8,
        "Fraction of the iterations after which fine-tuning of the quantized attributes starts; "
        "1: no fine-tuning (paper).",
    )
    prune_rd_lambda: NonNegativeFloat = described(
        0.0,
        "Rate-distortion weight of a Gaussian. After densification, a Gaussian is pruned if its "
        "removal would change the pictures by less than a multiple of the median squared error "
        "around a Gaussian; the multiple rises to this weight in several prunings until "
        "fine-tuning. Together, they remove at most three quarters of the visible Gaussians. If "
        "the weight is above 0, three prunings during densification remove the half of the "
        "Gaussians that contributes least, but keep at least the initial number, and at least a "
        "quarter of canonical.max_gaussians. 0: no pruning by contribution "
        "(paper).",
    )
    code_rd_lambda: NonNegativeFloat = described(
        0.0,
        "Rate-distortion weight, relative to the loss, of the estimated rate in nats per Gaussian. "
        "The rate includes all codes except position and opacity. 0: the loss has no rate term "
        "(paper).",
    )
    quantize_rd_lambda: NonNegativeFloat = described(
        0.0,
        "Rate-distortion weight of the codes of rotations and SH DC. Halfway through fine-tuning, "
        "a code other than the nearest is chosen if it saves enough bits: each bit may change the "
        "pictures by this multiple of the median squared error around a Gaussian. 0: the nearest "
        "codes are always used (paper).",
    )
    lr_end_factor: UnitInterval = described(
        1.0,
        "Learning rates at the end of fine-tuning, relative to those at its start (cosine decay); "
        "1: no decay.",
    )
    position_lr: PositiveFloat = described(
        1.6e-4, "Initial learning rate of positions, relative to the camera extent."
    )
    position_lr_final: PositiveFloat = described(
        1.6e-6, "Final learning rate of positions, relative to the camera extent."
    )
    sh_dc_lr: NonNegativeFloat = described(2.5e-3, "Learning rate of SH coefficients of degree 0.")
    sh_rest_lr: NonNegativeFloat = described(
        2.5e-3 / 20, "Learning rate of SH coefficients of degree 1."
    )
    opacity_lr: NonNegativeFloat = described(0.05, "Learning rate of opacity logits.")
    scale_lr: NonNegativeFloat = described(5e-3, "Learning rate of log-scales.")
    rotation_lr: NonNegativeFloat = described(1e-3, "Learning rate of rotations (quaternions).")

    @property
    def fine_tuning_start(self) -> int:
        """Index of the first iteration of fine-tuning, which trains quantized attributes."""
        return math.ceil(self.quantize_from * self.iterations)

    @property
    def densification_end(self) -> int:
        """Index of the first iteration after densification, which ends before fine-tuning."""
        return min(self.densify_until_iter, self.fine_tuning_start)

    @property
    def pseudo_view_steps(self) -> range:
        """Indices of the iterations that may train on a pseudo-view, too.

        They end with densification: later iterations only refine the Gaussians that there are,
        so that hardly any new haze forms.
        """
        start = max(1, math.ceil(self.pseudo_views_from * self.iterations))
        return range(start, self.densification_end)

    @property
    def scene_count(self) -> int:
        """Number of scenes that are trained: 1 if no iteration uses a pseudo-view."""
        return self.ensemble_size if self.pseudo_view_ratio and self.pseudo_view_steps else 1

    @property
    def training_steps(self) -> int:
        """Number of training iterations of all scenes."""
        return (self.scene_count - 1) * self.pseudo_view_steps.start + self.iterations

    @property
    def pseudo_view_count(self) -> int:
        """Expected number of pseudo-views that are used."""
        is_used = self.scene_count > 1
        return round(self.pseudo_view_ratio * len(self.pseudo_view_steps)) if is_used else 0

    @property
    def half_resolution_steps(self) -> int:
        """Number of the training iterations, of all scenes, that use half the width and height."""
        half_until = self.half_resolution_until_iter
        return (self.scene_count - 1) * min(half_until, self.pseudo_view_steps.start) + min(
            half_until, self.iterations
        )

    def count_ensemble(self, step: int) -> int:
        """Return how many scenes of the ensemble are complete after `step` iterations."""
        if self.scene_count == 1:
            return 0
        return min(self.scene_count, (step - 1) // self.pseudo_view_steps.start)

    def limit_to_views(self, view_count: int) -> "CanonicalSettings":
        """Return the settings for a number of training views.

        See `max_gaussians_from_views` and `ensemble_from_views`.
        """
        limited = self
        if view_count < self.ensemble_from_views:
            limited = replace(limited, ensemble_size=1)
        if view_count < self.max_gaussians_from_views:
            initial_gaussians, max_gaussians = (
                max(1, count * view_count // self.max_gaussians_from_views)
                for count in (self.initial_gaussians, self.max_gaussians)
            )
            limited = replace(
                limited, initial_gaussians=initial_gaussians, max_gaussians=max_gaussians
            )
        return limited

    def frame_kind(self, frame: int) -> bytes:
        """Return the chunk type of a frame: CANO, SNAP or FRAM."""
        if frame == 0 or (self.keyframe_interval and frame % self.keyframe_interval == 0):
            return container.CANO
        if self.snapshot_interval and frame % self.snapshot_interval == 0:
            return container.SNAP
        return container.FRAM

    def count_frame_kinds(self, frame_count: int) -> Counter[bytes]:
        """Return how many of the first `frame_count` frames have each chunk type."""
        return Counter(self.frame_kind(frame) for frame in range(frame_count))
