"""Weights, quantization steps and schedule for training a canonical frame."""

import math
from dataclasses import dataclass

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.format.records import StreamHeader


@dataclass(frozen=True, slots=True)
class CanonicalObjective:
    """Loss weights, quantization steps and schedule for training a canonical frame.

    Attributes:
        settings: Schedule, thresholds and weights.
        header: Header of the stream, which contains the quantization steps.
        rd_lambda: Factor by which the rate-distortion weights of the settings are multiplied.
    """

    settings: CanonicalSettings
    header: StreamHeader
    rd_lambda: float = 1.0

    @property
    def fine_tuning_start(self) -> int:
        """Index of the first iteration of fine-tuning, which trains quantized attributes."""
        return math.ceil(self.settings.quantize_from * self.settings.iterations)

    def should_densify(self, step: int) -> bool:
        """Return whether an iteration ends with densification."""
        settings = self.settings
        is_in_range = settings.densify_from_iter <= step < settings.densify_until_iter
        return is_in_range and step % settings.densification_interval == 0

    def should_decay_opacity(self, step: int) -> bool:
        """Return whether an iteration decays the opacities of rendered Gaussians."""
        settings = self.settings
        return (
            bool(settings.opacity_decay)
            and settings.densify_from_iter <= step < self.fine_tuning_start
        )

    def prune_threshold_at(self, step: int) -> float:
        """Return the contribution below which an iteration prunes Gaussians; 0 to prune none.

        Gaussians are pruned twice: halfway to the end of densification, and at its end.
        The first threshold is half of the second, because new Gaussians have not converged yet.
        """
        threshold = self.settings.prune_rd_lambda * self.rd_lambda
        last_prune_step = min(self.settings.densify_until_iter, self.fine_tuning_start)
        if step == last_prune_step // 2:
            return threshold / 2
        return threshold if step == last_prune_step else 0.0
