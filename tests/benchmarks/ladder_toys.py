"""Toy states and fits for the tests of the ladder benchmark."""

from dataclasses import replace

import numpy as np
import torch

from ladder.fitting import fit_rung
from ladder.rounding import allow_updates
from ladder.rungs import RUNGS
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import dequantize
from quarc_ref.decoder.reconstruct import begin_frame, move
from quarc_ref.encoder.training.quantize import quantize_gaussians
from quarc_ref.encoder.training.trainable import from_splats
from quarc_ref.format.records import StreamHeader
from tests.encoder.toys import SMALL, make_context, make_splats

QUICK_SETTINGS = replace(SMALL, motion=replace(SMALL.motion, lr=2e-3))  # blobs move 0.05 per frame


def make_state():
    header = StreamHeader(gaussians_per_anchor=4)
    attributes = from_splats(make_splats(0), torch.device("cpu"))
    return begin_canonical(header, 0, quantize_gaussians(attributes, header))


def begin_toy_frame(frame=1):
    start_state = allow_updates(begin_frame(make_state(), 0))
    return replace(start_state, scene=replace(start_state.scene, frame=frame))


def move_frame():
    start_state = begin_toy_frame()
    levels = start_state.required_anchors.levels
    return move(start_state, [np.zeros((6, level.owners.size), dtype=np.int64) for level in levels])


def make_attributes(start_state):
    return from_splats(dequantize(start_state.scene), torch.device("cpu"))


def fit_toy_rung(name, iterations=8, config=QUICK_SETTINGS):
    start_state = begin_toy_frame()
    return start_state, fit_rung(make_context(), start_state, RUNGS[name], iterations, config)
