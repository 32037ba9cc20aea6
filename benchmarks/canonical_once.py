"""Trains frame 0 only once for all trials with the same canonical settings.

The trials differ in the motion after it. Training it again would give the same scene each time, and
take a large part of their time.
"""

import hashlib
import io
import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import torch

from kept_files import write_atomically
from quarc_ref.datasets.capture import Points
from quarc_ref.encoder import encode_stream
from quarc_ref.encoder.resume.checkpoint import Checkpoint
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.straight_through import position_step
from quarc_ref.encoder.training.trainable import Attributes

Train = Callable[..., Attributes]  # as `train_canonical`
_SECONDS = "seconds"
_NAMES = ("means", "rotations", "log_scales", "opacities", "sh_dc", "sh_rest")


class CanonicalOnce:
    """Trains the canonical frame, or loads it if another trial has trained it.

    Args:
        folder: Folder for canonical scenes.
        inputs: Everything that the training depends on, except settings and steps.

    Attributes:
        seconds: Duration of the training; 0 before it.
    """

    def __init__(self, folder: Path, inputs: Sequence[object]) -> None:
        self._folder = folder
        self._said = inputs
        self.seconds = 0.0

    def train(
        self,
        context: TrainingContext,
        points: Points,
        objective: CanonicalObjective,
        checkpoint: Checkpoint | None = None,
    ) -> Attributes:
        """Load or train the canonical frame; a replacement for `train_canonical`."""
        path = self._folder / f"{self._digest(objective)}.npz"
        if not path.is_file():
            started = time.perf_counter()
            attributes = train_canonical(context, points, objective, checkpoint)
            _save(path, attributes, time.perf_counter() - started)
        with np.load(path) as kept:
            self.seconds = float(kept[_SECONDS])
            tensors = [torch.from_numpy(kept[name]).to(context.device) for name in _NAMES]
        return Attributes(*tensors)

    @contextmanager
    def within_encode(self) -> Iterator[None]:
        """Make `encode` take the canonical frame from here within this context."""
        with patch.object(encode_stream, "train_canonical", self.train):
            yield

    def _digest(self, objective: CanonicalObjective) -> str:
        header = objective.header
        steps = (
            position_step(header), header.rotation_bits, header.log_scale_step,
            header.opacity_step, header.sh_dc_step, header.sh_rest_step, header.sh_degree,
        )  # fmt: skip
        inputs = json.dumps([self._said, repr(objective.settings), objective.rd_lambda, steps])
        return hashlib.sha256(inputs.encode()).hexdigest()[:16]


def _save(path: Path, attributes: Attributes, seconds: float) -> None:
    arrays: dict[str, Any] = {
        name: tensor.cpu().numpy()
        for name, tensor in zip(_NAMES, attributes.tensors(), strict=True)
    }
    buffer = io.BytesIO()
    np.savez(buffer, **arrays | {_SECONDS: np.float64(seconds)})
    write_atomically(path, buffer.getvalue())
