"""Runs the encoder in floats, to measure the quality of the method without rounding.

The schedule, random numbers and rules are the same as in `encoder.encode_stream`, but each frame
starts from the trained values of the previous frame instead of its decoded values. Residuals are
applied without rounding. Sampling anchors requires integer positions, so positions are stored on a
lattice that is almost as fine as floats. The result is not a stream.
"""

import math
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from canonical_cache import TrainFunction
from paper.trials import Trial
from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import append_births, begin_frame
from quarc_ref.decoder.state import State
from quarc_ref.encoder.adapt_steps import adapt_steps_to_capture
from quarc_ref.encoder.frame_coder import FrameStart
from quarc_ref.encoder.frames.birth_selection import ByteCost
from quarc_ref.encoder.frames.births import count_deaths, fit_births
from quarc_ref.encoder.frames.motion import fit_motion
from quarc_ref.encoder.frames.rate_control import RateDistortion, choose_rd_factor
from quarc_ref.encoder.frames.surrogate import deform
from quarc_ref.encoder.settings.config import make_header
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.measurements import measure_loss, refit_exposures
from quarc_ref.encoder.training.quantize import drop_unrepresentable, quantize_gaussians
from quarc_ref.encoder.training.straight_through import without_rounding
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.coding.gaussian_planes import sort_canonical, write_births
from quarc_ref.format.constants import POSITION_LIMIT, ROTATION_BITS_LIMIT, ROTATION_ONE
from quarc_ref.format.records import Births, StreamHeader

_LATTICE_DOUBLINGS = 6
_STEP_DIVISOR = 16


@dataclass(frozen=True, slots=True, eq=False)
class FloatFrame:
    """A frame of a trial that is not quantized.

    Attributes:
        state: State after the frame; its `motion` and `symbols` are in quantization steps, but not
            rounded.
        deaths: Number of deleted Gaussians.
    """

    state: State
    deaths: int


def encode_unquantized(
    capture: Capture,
    trial: Trial,
    frames: int,
    context: TrainingContext,
    train: TrainFunction = train_canonical,
) -> Iterator[FloatFrame]:
    """Yield the frames of a trial, without rounding the parts given by `trial.floats`.

    Args:
        capture: Capture to encode; its held-out cameras are not used.
        trial: Settings, and the parts that stay in floats.
        frames: Number of frames.
        context: Training context of the capture.
        train: Function that trains the canonical frame.
    """
    config = adapt_steps_to_capture(trial.config, capture)
    state = _make_canonical_state(context, capture, trial, train)
    initial_count = state.scene.count
    reference_loss = measure_loss(context, state, config.motion.lambda_dssim)
    yield FloatFrame(state, 0)
    for frame in range(1, frames):
        context.observers.progress.advance("frames", frame, frames)
        deaths = count_deaths(state, initial_count, config.births)
        frame_start = begin_frame(state, deaths)
        if trial.rebinds:
            frame_start = _rebind(frame_start)
        rd = RateDistortion(choose_rd_factor(config, []), reference_loss)
        with without_rounding():
            motion = fit_motion(
                context, FrameStart(state, frame_start, deaths), config.motion, rd=rd
            )
        moved_frame = move_without_rounding(frame_start, motion.residuals)
        births = fit_births(
            context,
            moved_frame,
            motion.statistics,
            config,
            ByteCost(
                rd.scale_relative(config.births.rd_lambda) / moved_frame.scene.count,
                partial(_count_birth_bytes, moved_frame.birth_counts),
            ),
        )
        state = moved_frame if births is None else append_births(moved_frame, births)
        context.views.drop_frames_before(frame)
        context.observers.progress.advance("frames", frame + 1, frames)
        yield FloatFrame(state, deaths)


def _count_birth_bytes(birth_counts: ContextCounts, births: Births) -> int:
    return write_births(births, birth_counts).byte_count()


def refine_header(header: StreamHeader, extent: float) -> StreamHeader:
    """Return a header with the same residual steps, but finer quantization steps for the rest.

    Args:
        header: Header of a stream with the trial's settings.
        extent: Largest absolute coordinate in world units; the lattice must extend to twice this
            value.
    """
    spare_bits = math.log2(POSITION_LIMIT / (2 * extent)) - header.lattice_exponent
    doublings = max(0, min(_LATTICE_DOUBLINGS, math.floor(spare_bits)))
    return replace(
        header,
        lattice_exponent=header.lattice_exponent + doublings,
        position_step=max(1, (header.position_step << doublings) // _STEP_DIVISOR),
        translation_step=header.translation_step << doublings,
        rotation_bits=ROTATION_BITS_LIMIT,
        log_scale_step=header.log_scale_step / _STEP_DIVISOR,
        opacity_step=header.opacity_step / _STEP_DIVISOR,
        sh_dc_step=header.sh_dc_step / _STEP_DIVISOR,
        sh_rest_step=header.sh_rest_step / _STEP_DIVISOR,
    )


def move_without_rounding(frame_start: State, residuals: torch.Tensor) -> State:
    """Return the state after unrounded residuals have moved its Gaussians (SPEC 7.5, Eq. 2).

    Args:
        frame_start: State after `begin_frame`.
        residuals: `[A, c]` in steps, for the anchors of all levels, level 1 first.
    """
    scene, anchors = frame_start.scene, frame_start.required_anchors
    level_starts = np.cumsum([level.owners.size for level in anchors.levels])[:-1]
    levels = np.split(residuals.double().cpu().numpy().T, level_starts, axis=1)
    motion = sum(
        (level[:, binding] for level, binding in zip(levels, anchors.binding, strict=True)),
        np.zeros_like(frame_start.motion, dtype=np.float64),
    )
    rotations = _rotate(frame_start, motion[3:] / scene.header.rotation_unity)
    positions = scene.positions + motion[:3] * scene.header.translation_step
    moved_scene = replace(
        scene,
        positions=np.rint(positions).clip(-POSITION_LIMIT, POSITION_LIMIT).astype(np.int32),
        rotations=rotations,
    )
    unrounded_motion: Any = motion  # a state has integers, but this one is never coded
    return replace(frame_start, scene=moved_scene, motion=unrounded_motion, symbols=tuple(levels))


def _rotate(frame_start: State, residuals: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return the rotations, `[4, N]` in Q22, after rotating them by residuals `[c - 3, N]`."""
    splats = from_splats(dequantize(frame_start.scene), torch.device("cpu"))
    zero_translation = torch.zeros_like(splats.means)
    rotated_splats = deform(
        splats, zero_translation, torch.from_numpy(residuals.T), frame_start.scene.header
    )
    quaternions = torch.nn.functional.normalize(rotated_splats.rotations.double(), dim=1)
    rotations: NDArray[np.int32] = np.rint(quaternions.numpy().T * ROTATION_ONE).astype(np.int32)
    return rotations


def _rebind(frame_start: State) -> State:
    """Bind every Gaussian to its nearest anchors, as the released code does."""
    anchors, positions = frame_start.required_anchors, frame_start.scene.positions.T
    binding = [cKDTree(level.positions.T).query(positions)[1] for level in anchors.levels]
    return replace(frame_start, anchors=Anchors(anchors.levels, np.stack(binding)))


def _make_canonical_state(
    context: TrainingContext, capture: Capture, trial: Trial, train: TrainFunction
) -> State:
    config = adapt_steps_to_capture(trial.config, capture)
    header = make_header(config, capture.frames_per_second, config.canonical.max_gaussians)
    with without_rounding() if trial.floats == "all" else nullcontext():
        objective = CanonicalObjective(config.canonical, header, choose_rd_factor(config, []))
        attributes = train(context, capture.points, objective)
    representable_attributes = drop_unrepresentable(attributes, header)
    fine_header = refine_header(header, float(representable_attributes.means.abs().max()))
    gaussians = quantize_gaussians(representable_attributes, fine_header)
    _, _, sorted_gaussians = sort_canonical(gaussians)
    state = begin_canonical(fine_header, 0, sorted_gaussians)
    if config.canonical.exposure_lr:
        refit_exposures(context, state)
    return state
