"""Toy captures with masks."""

import numpy as np

from quarc_ref.datasets.capture import Capture
from tests.encoder.toys import HEIGHT, WIDTH

BORDER = 28


class ColumnMasks:
    """A mask source that masks the columns from `border` in all frames of all cameras."""

    def __init__(self, border=BORDER):
        self._mask = np.zeros((HEIGHT, WIDTH), bool)
        self._mask[:, :border] = True

    def read(self, _camera, _frame):
        return self._mask


class NoisySource:
    """A picture source that replaces the columns from `BORDER` by noise."""

    def __init__(self, capture):
        self._capture = capture

    def read(self, camera, frame):
        picture = self._capture.image(camera, frame).copy()
        noise = np.random.default_rng([camera, frame]).integers(0, 256, picture.shape, np.uint8)
        picture[:, BORDER:] = noise[:, BORDER:]
        return picture


def add_masks(capture, source=None, masks=None):
    """Return a capture with masks, and with pictures from `source` instead of its own."""
    return Capture(
        capture.name, capture.cameras, capture.frame_count, capture.frames_per_second,
        capture.points, source or _CopiedSource(capture), capture.fingerprint,
        masks=masks or ColumnMasks(),
    )  # fmt: skip


class _CopiedSource:
    def __init__(self, capture):
        self._capture = capture

    def read(self, camera, frame):
        return self._capture.image(camera, frame).copy()
