"""Settings of canonical frames."""

from dataclasses import dataclass

from quarc_ref.encoder.settings.ranges import (
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
    """Settings of frame 0 (3DGS training; paper section 3) and of later keyframes."""

    keyframe_interval: NonNegativeInt = described(
        0, "Frames between keyframes (canonical frames); 0: only frame 0 is one (paper)."
    )
    snapshot_interval: NonNegativeInt = described(
        0,
        "Frames between snapshots, which are keyframes coded against the last canonical frame "
        "(SPEC 7.9); 0 for none (paper).",
    )
    snapshot_dead_zone: NonNegativeInt = described(
        2,
        "Translation steps and rotation units within which a snapshot undoes moves since the "
        "canonical frame, which saves bytes; 0 to keep all moves.",
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

    def frame_kind(self, frame: int) -> bytes:
        """Return the chunk type of a frame: CANO, SNAP or FRAM."""
        if frame == 0 or (self.keyframe_interval and frame % self.keyframe_interval == 0):
            return container.CANO
        if self.snapshot_interval and frame % self.snapshot_interval == 0:
            return container.SNAP
        return container.FRAM
