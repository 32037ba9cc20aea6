"""Learning rates of the training of frame 0."""

import math

from quarc_ref.encoder.settings.canonical import CanonicalSettings
from quarc_ref.encoder.training.trainable import cosine_decay


def canonical_learning_rates(settings: CanonicalSettings, extent: float) -> tuple[float, ...]:
    """Return the initial learning rate of each attribute, in the order of `Attributes`."""
    return (
        settings.position_lr * extent,
        settings.rotation_lr,
        settings.scale_lr,
        settings.opacity_lr,
        settings.sh_dc_lr,
        settings.sh_rest_lr,
    )


def learning_rates_at(settings: CanonicalSettings, extent: float, step: int) -> list[float]:
    """Return the learning rate of each attribute in an iteration, in the order of `Attributes`.

    The learning rate of positions decays exponentially from the first to the last iteration.
    During fine-tuning, all learning rates are also multiplied by a cosine decay.
    """
    progress = step / settings.iterations
    log_initial, log_final = math.log(settings.position_lr), math.log(settings.position_lr_final)
    position_lr = math.exp(log_initial + (log_final - log_initial) * progress) * extent
    fine_tuning_step = step - settings.fine_tuning_start
    decay = 1.0
    if fine_tuning_step >= 0:
        fine_tuning_steps = settings.iterations - settings.fine_tuning_start
        decay = cosine_decay(fine_tuning_step, fine_tuning_steps, settings.lr_end_factor)
    other_lrs = canonical_learning_rates(settings, extent)[1:]
    return [decay * lr for lr in (position_lr, *other_lrs)]
