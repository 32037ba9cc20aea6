"""Trains frame 0 once for all trials that use the same settings for its training.

Such trials differ only in later frames. Training frame 0 for every trial would give the same scene
each time, and would take most of the time of a study.
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

from atomic_files import write_atomically
from quarc_ref.datasets.capture import Points
from quarc_ref.encoder import encode_stream
from quarc_ref.encoder.resume.checkpoint import Checkpoint
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.straight_through import position_step
from quarc_ref.encoder.training.trainable import Attributes

TrainFunction = Callable[..., Attributes]  # the signature of `train_canonical`
_SECONDS_KEY = "seconds"
_ARRAY_NAMES = ("means", "rotations", "log_scales", "opacities", "sh_dc", "sh_rest")


class CanonicalCache:
    """Trains the canonical frame, or loads it if another trial has already trained it.

    Args:
        folder: Folder for trained canonical scenes.
        inputs: Everything that determines the trained scene, except settings and quantization
            steps.

    Attributes:
        seconds: Training time of the canonical frame in seconds, even if the frame was loaded; 0
            before `train` is called.
    """

    def __init__(self, folder: Path, inputs: Sequence[object]) -> None:
        self._folder = folder
        self._inputs = inputs
        self.seconds = 0.0

    def train(
        self,
        context: TrainingContext,
        points: Points,
        objective: CanonicalObjective,
        checkpoint: Checkpoint | None = None,
    ) -> Attributes:
        """Load the canonical frame, or train and save it; called like `train_canonical`."""
        path = self._folder / f"{self._compute_digest(objective)}.npz"
        if not path.is_file():
            start = time.perf_counter()
            attributes = train_canonical(context, points, objective, checkpoint)
            _save(path, attributes, time.perf_counter() - start)
        with np.load(path) as arrays:
            self.seconds = float(arrays[_SECONDS_KEY])
            tensors = [torch.from_numpy(arrays[name]).to(context.device) for name in _ARRAY_NAMES]
        return Attributes(*tensors)

    @contextmanager
    def use_in_encode(self) -> Iterator[None]:
        """Return a context manager within which `encode` calls `train` for the canonical frame."""
        with patch.object(encode_stream, "train_canonical", self.train):
            yield

    def _compute_digest(self, objective: CanonicalObjective) -> str:
        header = objective.header
        steps = (
            position_step(header), header.rotation_bits, header.log_scale_step,
            header.opacity_step, header.sh_dc_step, header.sh_rest_step, header.sh_degree,
        )  # fmt: skip
        digest_inputs = json.dumps(
            [self._inputs, repr(objective.settings), objective.rd_factor, steps]
        )
        return hashlib.sha256(digest_inputs.encode()).hexdigest()[:16]


def _save(path: Path, attributes: Attributes, seconds: float) -> None:
    arrays: dict[str, Any] = {
        name: tensor.cpu().numpy()
        for name, tensor in zip(_ARRAY_NAMES, attributes.tensors(), strict=True)
    }
    buffer = io.BytesIO()
    np.savez(buffer, **arrays | {_SECONDS_KEY: np.float64(seconds)})
    write_atomically(path, buffer.getvalue())
