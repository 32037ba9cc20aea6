"""Training objective of a canonical frame, and its schedule."""

import math
from dataclasses import dataclass

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.format.records import StreamHeader


@dataclass(frozen=True, slots=True)
class CanonicalObjective:
    """Training objective of a canonical frame, and its schedule.

    Attributes:
        settings: Schedule, thresholds and weights.
        header: Header of the stream, which has the quantization steps.
        rd_lambda: Factor of the settings' rate-distortion weights.
    """

    settings: CanonicalSettings
    header: StreamHeader
    rd_lambda: float = 1.0

    @property
    def fine_step(self) -> int:
        """The first iteration of fine-tuning, which quantizes."""
        return math.ceil(self.settings.quantize_from * self.settings.iterations)

    def densifies_at(self, step: int) -> bool:
        """Return whether an iteration ends with densification."""
        settings = self.settings
        is_within = settings.densify_from_iter <= step < settings.densify_until_iter
        return is_within and step % settings.densification_interval == 0

    def decays_opacity_at(self, step: int) -> bool:
        """Return whether an iteration decays the opacities of rendered Gaussians."""
        settings = self.settings
        return bool(settings.opacity_decay) and settings.densify_from_iter <= step < self.fine_step

    def prune_weight_at(self, step: int) -> float:
        """Return the contribution below which an iteration prunes Gaussians; 0 for no pruning.

        Gaussians are pruned twice: at the end of densification, and halfway to it with half
        the weight, because new Gaussians have not converged yet.
        """
        weight = self.settings.prune_rd_lambda * self.rd_lambda
        last = min(self.settings.densify_until_iter, self.fine_step)
        if step == last // 2:
            return weight / 2
        return weight if step == last else 0.0
