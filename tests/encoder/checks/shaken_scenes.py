"""Recordings of a textured wall that a person crosses, by cameras that are moved or covered."""

import numpy as np
from scipy.ndimage import gaussian_filter, shift

from quarc_ref.encoder.checks.recording import GrayFrames, Recording

ROWS, COLUMNS = 54, 96


def paint_wall(seed=0):
    """Return the `[rows, columns]` gray levels of the wall."""
    noise = np.random.default_rng(seed).normal(size=(ROWS, COLUMNS))
    wall = gaussian_filter(noise, 1.5)
    return np.clip(110 + 45 * wall / wall.std(), 20, 235).astype(np.float32)


def move(picture, x, y):
    """Return a picture, shifted by pixels to the right and down."""
    return shift(picture, (y, x), order=3, mode="mirror").astype(np.float32)


def film(frame_count=40, change=None, seed=0, frames=None, block_size=4):
    """Return the recording of a camera.

    Args:
        frame_count: Number of pictures.
        change: Function of frame and picture that returns what the camera shows instead.
        seed: Seed of the wall and of the noise.
        frames: The frames of the pictures; None for consecutive frames.
        block_size: As in `Recording`.
    """
    frames = np.arange(frame_count) if frames is None else frames
    generator, wall = np.random.default_rng(seed), paint_wall(seed)
    pictures = []
    for index, frame in enumerate(frames.tolist()):
        picture = change(frame, wall) if change else wall
        picture = picture + generator.normal(0, 1, wall.shape)
        left = 3 * index % COLUMNS
        picture[10:, left : left + 20] = 60
        pictures.append(picture)
    levels = np.clip(np.stack(pictures), 0, 255)
    usable = np.ones(len(frames), dtype=bool)
    samples = GrayFrames(frames, np.round(levels * 128).astype(np.uint16), usable)
    return Recording(block_size, samples, samples, {})
