"""Adapts the quantization steps of an encode to the pictures of its capture (`steps`).

All steps are chosen before frame 0 is trained. After training, the translation step is chosen
again, from the error of frame 0, except in segments. A resumed encode copies this step from the
partial stream.
"""

from collections.abc import Iterator
from dataclasses import replace

from quarc_ref.datasets.capture import Capture, Points
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.steps import MaskedPicture, propose_steps, replace_translation_step
from quarc_ref.encoder.world_frame import set_world_frame
from quarc_ref.format.cameras import Camera
from quarc_ref.format.records import StreamHeader


def adapt_steps_to_capture(config: EncoderConfig, capture: Capture) -> EncoderConfig:
    """Return settings whose quantization steps suit the training views of a capture.

    All segments of a capture get the same steps, so that their streams can be joined.

    Raises:
        CaptureError: A picture cannot be read.
        EncodeError: No initial point is visible in a training view, or the format does not support
            the steps.
    """
    full_capture = capture.full_capture
    header = propose_steps(config.stream, config.steps, *_list_step_inputs(full_capture))
    return replace(config, stream=set_world_frame(header, full_capture.notes))


def should_measure_error(config: EncoderConfig, capture: Capture) -> bool:
    """Return whether the translation step depends on the error of frame 0.

    Segments of a capture need equal steps, so theirs do not depend on it.
    """
    return config.steps.translation_error > 0 and capture is capture.full_capture


def adapt_steps_to_error(config: EncoderConfig, capture: Capture, error: float) -> EncoderConfig:
    """Return settings whose translation step suits the error of frame 0.

    A step far below the error would cost bytes for motion that is invisible beside the error; a
    step far above it would add to the error. Large plain areas reduce the error and the sharpness
    of the pictures by the same factor, so they do not affect the step.

    Args:
        config: Settings from `adapt_steps_to_capture`.
        capture: The whole capture.
        error: Root-mean-square error of frame 0, as a fraction of white.

    Raises:
        CaptureError: A picture cannot be read.
        EncodeError: No initial point is visible in a training view.
    """
    change = config.steps.translation_error * error
    header = replace_translation_step(config.stream, change, *_list_step_inputs(capture))
    return replace(config, stream=header)


def copy_translation_step(config: EncoderConfig, header: StreamHeader) -> EncoderConfig:
    """Return settings with the translation step of an existing header."""
    return replace(config, stream=replace(config.stream, translation_step=header.translation_step))


def _list_step_inputs(capture: Capture) -> tuple[list[Camera], Points, Iterator[MaskedPicture]]:
    """Return the training cameras, the initial points, and the pictures and masks of frame 0."""
    indices = capture.training_at(0)
    cameras = [capture.cameras[index] for index in indices]
    pictures = ((capture.image(index, 0), capture.mask(index, 0)) for index in indices)
    return cameras, capture.points, pictures
