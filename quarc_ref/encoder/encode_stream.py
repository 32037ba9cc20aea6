"""Multi-view video to a stream: frame 0, then every frame from the decoded one before.

points ──> train_canonical ──> commit_canonical ──> state of frame 0
state ──> begin_frame ──> fit_motion ──> commit_motion
                                             │
          state of the next frame <── commit_births <── fit_births

Every `canonical.every` frames `commit_frame_as_canonical` takes the place of `commit_births`.
"""

from dataclasses import dataclass, field, replace
from typing import BinaryIO

import numpy as np
import torch

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import State
from quarc_ref.encoder.births import fit_births
from quarc_ref.encoder.canonical import train_canonical
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.config import BirthSettings, EncoderConfig, make_header
from quarc_ref.encoder.exposure import Exposures
from quarc_ref.encoder.motion import fit_motion
from quarc_ref.encoder.presets import choose_preset, list_settings
from quarc_ref.encoder.progress import Progress, Silence
from quarc_ref.encoder.quantize import keep_representable, quantize_gaussians
from quarc_ref.encoder.rate_control import price_bytes
from quarc_ref.encoder.steps import propose_steps
from quarc_ref.encoder.studio import Studio
from quarc_ref.encoder.trainable import from_splats
from quarc_ref.encoder.views import TrainingViews, measure_extent
from quarc_ref.format.records import OPACITY
from quarc_ref.rendering.backends import choose_device, choose_rasterizer


@dataclass(frozen=True, slots=True)
class EncodeOptions:
    """How to encode a capture.

    Attributes:
        config: All settings of training and stream.
        frames: How many, from the first; None for all.
        device: `cpu`, `cuda`, or `auto`: CUDA where there is one and gsplat with it.
        progress: Is told of every step.
    """

    config: EncoderConfig = field(default_factory=lambda: choose_preset("main"))
    frames: int | None = None
    device: str = "auto"
    progress: Progress = field(default_factory=Silence)


def encode(capture: Capture, sink: BinaryIO, options: EncodeOptions | None = None) -> None:
    """Encode a capture into a stream.

    Args:
        capture: Multi-view video; its held-out cameras are not looked at.
        sink: Is written to by appending; every frame is whole when the next begins.
        options: Settings.

    Raises:
        CaptureError: A picture cannot be read.
        EncodeError: The scene cannot be written with these settings.
    """
    options = options or EncodeOptions()
    studio = _make_studio(capture, options)
    config = suit_capture(options.config, capture)
    header = make_header(config, capture.frames_per_second, config.canonical.max_gaussians)
    attributes = train_canonical(studio, capture.points, price_bytes(config, []).canonical, header)
    gaussians = quantize_gaussians(keep_representable(attributes, header), header)
    header = make_header(config, capture.frames_per_second, gaussians.count)
    loop = ClosedLoop(sink, header, capture.cameras, _describe(capture, options))
    state = loop.commit_canonical(gaussians, frame=0)
    if config.canonical.exposure_rate:
        settle_exposures(studio, state)
    frame_count = min(options.frames or capture.frame_count, capture.frame_count)
    sizes: list[int] = []
    for frame in range(1, frame_count):
        options.progress.advance("frames", frame, frame_count)
        begun = loop.begin_frame(count_deaths(state, gaussians.count, config.births))
        priced = price_bytes(config, sizes)
        motion = fit_motion(studio, state, begun, priced.motion)
        moved = loop.commit_motion(motion.symbols)
        births = fit_births(studio, moved, motion.statistics, priced)
        if config.canonical.every and frame % config.canonical.every == 0:
            state = loop.commit_frame_as_canonical(births)
        else:
            state = loop.commit_births(births)
            sizes.append(loop.frame_bytes)
        studio.views.forget_before(frame)
    loop.finish()
    options.progress.advance("frames", frame_count, frame_count)


def suit_capture(config: EncoderConfig, capture: Capture) -> EncoderConfig:
    """Return settings whose stream has the steps that suit the capture's training views.

    Raises:
        EncodeError: No training view sees an initial point.
    """
    views = [capture.cameras[index] for index in capture.training]
    return replace(config, stream=propose_steps(config.stream, config.steps, views, capture.points))


def settle_exposures(studio: Studio, state: State) -> None:
    """Find the exposures anew from decoded frame 0, so that no later frame hangs on more."""
    drawn = from_splats(dequantize(state.scene), studio.device).activated()
    with torch.no_grad():
        studio.exposures.settle(
            (studio.render(drawn, view).image, studio.views.picture(view, state.scene.frame))
            for view in range(len(studio.views.cameras))
        )


def count_deaths(state: State, target: int, settings: BirthSettings) -> int:
    """Return how many Gaussians a frame loses: those that are too many, and may die."""
    header = state.scene.header
    logits = state.scene.codes[OPACITY.start] * header.opacity_step
    may_die = int(np.count_nonzero(1 / (1 + np.exp(-logits)) < settings.deaths_below))
    return min(max(0, state.scene.count - target), may_die)


def _make_studio(capture: Capture, options: EncodeOptions) -> Studio:
    device = choose_device(options.device)
    views = TrainingViews(capture, device)
    rasterizer = choose_rasterizer(device)
    extent = measure_extent(views.cameras)
    exposures = Exposures(len(views.cameras), device)
    return Studio(
        views, rasterizer, device, options.config.seed, options.progress, extent, exposures
    )


def _describe(capture: Capture, options: EncodeOptions) -> dict[str, str]:
    """Return the metadata of a stream: what it was made from, and how."""
    settings = dict(list_settings(options.config))
    return {
        "capture": capture.name,
        "fingerprint": capture.fingerprint,
        "settings": " ".join(f"{name}={value}" for name, value in settings.items()),
    }
