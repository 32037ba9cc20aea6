"""Weights, quantization steps and schedule for the training of frame 0."""

from dataclasses import dataclass

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.format.records import StreamHeader

_EARLY_PRUNING_COUNT, _LATE_PRUNING_COUNT = 3, 8
_EARLY_SHARE, _MAX_LATE_SHARE = 0.5, 0.75
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
        the error is greater. Late prunings, from the end of densification to fine-tuning, remove
        the Gaussians whose contribution does not justify their rate. Their threshold rises in
        equal steps: Gaussians that take over from pruned ones contribute more from then on.

        Args:
            step: Index of the iteration.
            initial_count: Number of Gaussians from which training started.
        """
        settings = self.settings
        threshold = settings.prune_rd_lambda * self.rd_factor
        if not threshold or not step:
            return None
        late_factors = self._late_pruning_factors()
        if step in late_factors:
            max_share = 1 - (1 - _MAX_LATE_SHARE) ** (1 / len(late_factors))
            return Pruning(late_factors[step] * threshold, max_share)
        interval_count, end = _EARLY_PRUNING_COUNT + 1, min(late_factors)
        if step in {end * k // interval_count for k in range(1, interval_count)}:
            min_count = max(initial_count, settings.max_gaussians // _MIN_SHARE_OF_LIMIT)
            return Pruning(None, max_share=_EARLY_SHARE, min_count=min_count)
        return None

    def _late_pruning_factors(self) -> dict[int, float]:
        """Return the factors of the threshold in late prunings, by iteration.

        If fine-tuning follows densification at once, there is one pruning, with factor 1.
        """
        settings, count = self.settings, _LATE_PRUNING_COUNT
        start = min(settings.densification_end, settings.iterations - 1)
        span = min(settings.fine_tuning_start, settings.iterations) - start
        return {start + span * k // count: (k + 1) / count for k in range(count)}
