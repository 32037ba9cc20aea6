"""Weights, quantization steps and schedule for the training of frame 0."""

from dataclasses import dataclass

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.format.records import StreamHeader

_PRUNING_COUNT = 4
_EARLY_SHARE, _MAX_LAST_SHARE = 0.5, 0.75
# Early prunings keep at least this fraction (1/4) of `max_gaussians`.
_MIN_SHARE_OF_LIMIT = 4


@dataclass(frozen=True, slots=True)
class Pruning:
    """Which of the visible Gaussians a pruning by contribution removes.

    Attributes:
        threshold: Contribution below which Gaussians are pruned, as a multiple of the median
            squared error around a Gaussian. None: as many as `max_share` and `min_count` allow.
        max_share: Maximum fraction of the visible Gaussians that is pruned.
        min_count: Minimum number of visible Gaussians that is kept, if there are as many.
    """

    threshold: float | None
    max_share: float
    min_count: int = 0


@dataclass(frozen=True, slots=True)
class CanonicalObjective:
    """Loss weights, quantization steps and schedule for the training of frame 0.

    Attributes:
        settings: Schedule, thresholds and weights.
        header: Header of the stream, which contains the quantization steps.
        rd_factor: Factor by which the rate-distortion weights of the settings are multiplied.
    """

    settings: CanonicalSettings
    header: StreamHeader
    rd_factor: float = 1.0

    @property
    def quantize_rd_lambda(self) -> float:
        """Rate-distortion weight of codes (`rdoq`), multiplied by `rd_factor`."""
        return self.settings.quantize_rd_lambda * self.rd_factor

    def should_choose_codes(self, step: int) -> bool:
        """Return whether an iteration, halfway through fine-tuning, begins by choosing codes."""
        start = self.settings.fine_tuning_start
        halfway = (start + self.settings.iterations) // 2
        return bool(self.quantize_rd_lambda) and start < step == halfway

    def should_densify(self, step: int) -> bool:
        """Return whether an iteration ends with densification."""
        settings = self.settings
        is_in_range = settings.densify_from_iter <= step < settings.densification_end
        return is_in_range and step % settings.densification_interval == 0

    def should_decay_opacity(self, step: int) -> bool:
        """Return whether an iteration decays the opacities of rendered Gaussians."""
        settings = self.settings
        return (
            bool(settings.opacity_decay)
            and settings.densify_from_iter <= step < settings.fine_tuning_start
        )

    def pruning_at(self, step: int, initial_count: int) -> Pruning | None:
        """Return the pruning by contribution at the start of an iteration, or None.

        Three early prunings, at equal intervals before the end of densification, remove the half
        of the Gaussians that contributes least, because densification then replaces them where
        the error is greater. The last one, after densification, or in the last iteration if
        densification has no end, removes the Gaussians whose contribution does not justify their
        rate.

        Args:
            step: Index of the iteration.
            initial_count: Number of Gaussians from which training started.
        """
        settings = self.settings
        threshold = settings.prune_rd_lambda * self.rd_factor
        last_step = min(settings.densification_end, settings.iterations - 1)
        if not threshold or not step:
            return None
        if step == last_step:
            return Pruning(threshold, max_share=_MAX_LAST_SHARE)
        if step in {last_step * k // _PRUNING_COUNT for k in range(1, _PRUNING_COUNT)}:
            min_count = max(initial_count, settings.max_gaussians // _MIN_SHARE_OF_LIMIT)
            return Pruning(None, max_share=_EARLY_SHARE, min_count=min_count)
        return None
