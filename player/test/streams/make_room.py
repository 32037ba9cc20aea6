"""Write `room.quarc`, the stream that the browser tests play: `make_room.py OUTPUT`.

The scene is a room of about 3000 Gaussians, in which a ball rises and falls and sparks appear.
This program makes all Gaussians; none are trained. The stream has three cameras, one of them with
an upright picture, two canonical frames, and an index.
"""

import sys
from pathlib import Path

import numpy as np

from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.files import atomic_file
from quarc_ref.format.arrays import Int64
from quarc_ref.format.cameras import Camera
from quarc_ref.format.records import Births, Gaussians, StreamHeader

FRAMES, CANONICAL_EVERY = 24, 12
UNITS_PER_METER = 1 << 12  # lattice units
BALL_CENTER = np.array([0.3, 0.0, 0.2])  # in frame 0, meters
MOVED_RADIUS = 0.4  # meters around the center of the ball, within which anchors move with it
SPEED = 16  # translation steps per frame

# y points down, as in most captures, so the up axis in the header is -y (4).
HEADER = StreamHeader(
    sh_dc_step=1 / 16, sh_rest_step=1 / 16, log_scale_step=1 / 8, up_axis=4, seed=24
)
CAMERAS = (
    ("front", (0.0, -0.3, -3.0), 160, 120, 140.0),
    ("side", (2.2, -0.7, -1.9), 160, 120, 130.0),
    ("upright", (-1.2, -0.2, -2.6), 90, 160, 120.0),
)


def main() -> None:
    """Write the stream; the file appears when it is complete."""
    rng = np.random.default_rng(24)
    cameras = tuple(make_camera(*row) for row in CAMERAS)
    with atomic_file(Path(sys.argv[1])) as sink:
        loop = ClosedLoop(sink, HEADER, cameras, {"title": "a ball in a room"})
        loop.commit_canonical(make_scene(rng), 0)
        center = BALL_CENTER.copy()
        for frame in range(1, FRAMES):
            speed = -SPEED if frame < FRAMES // 2 else SPEED
            start = loop.start_frame(0)
            symbols = [
                make_symbols(level.positions, center, speed if level_index == 0 else 0)
                for level_index, level in enumerate(start.state.required_anchors.levels)
            ]
            moved = loop.move_frame(start, symbols)
            center[1] += speed * HEADER.translation_step / UNITS_PER_METER
            births = make_sparks(moved.state.scene.positions, moved.state.scene.codes, center, rng)
            if frame % CANONICAL_EVERY == 0:
                loop.commit_as_canonical(moved, births)
            else:
                loop.commit_frame(moved, births)
        loop.finish()


def make_camera(
    name: str, position: tuple[float, float, float], width: int, height: int, focal: float
) -> Camera:
    """Return a camera at a position, in meters, that looks at the center of the room."""
    center = np.array(position)
    ahead = -center / np.linalg.norm(center)
    right = np.cross([0.0, 1.0, 0.0], ahead)
    right /= np.linalg.norm(right)
    rotation = np.stack([right, np.cross(ahead, right), ahead])
    rows = tuple(np.float32(rotation).ravel().tolist())
    translation = tuple(np.float32(-rotation @ center).tolist())
    principal, is_held_out = (width / 2, height / 2), name == "side"
    return Camera(
        name, width, height, focal, focal, *principal, rows, translation, 0.2, is_held_out
    )


def make_scene(rng: np.random.Generator) -> Gaussians:
    """Return the Gaussians of the floor, two walls, a column and the ball."""
    floor = rng.uniform((-1.5, 0.95, -1.5), (1.5, 1.0, 1.5), (900, 3))
    back = rng.uniform((-1.5, -1.0, 1.45), (1.5, 1.0, 1.5), (900, 3))
    wall = rng.uniform((-1.5, -1.0, -1.5), (-1.45, 1.0, 1.5), (500, 3))
    column = rng.uniform((0.9, -0.4, 0.4), (1.1, 1.0, 0.6), (300, 3))
    ball = rng.normal(size=(400, 3))
    ball = BALL_CENTER + 0.25 * ball / np.linalg.norm(ball, axis=1, keepdims=True)
    squares = np.floor(floor[:, [0, 2]] / 0.5).sum(axis=1) % 2
    stripes = np.floor(back[:, 0] / 0.3) % 2
    colors = np.concatenate(
        [
            np.where(squares[:, None] > 0, [0.75, 0.72, 0.65], [0.25, 0.27, 0.32]),
            np.where(stripes[:, None] > 0, [0.55, 0.62, 0.7], [0.68, 0.74, 0.8]),
            np.tile([0.5, 0.56, 0.5], (500, 1)),
            np.tile([0.8, 0.66, 0.36], (300, 1)),
            np.where(ball[:, 1:2] > BALL_CENTER[1], [0.8, 0.25, 0.18], [0.95, 0.5, 0.25]),
        ]
    )
    scales = np.repeat([0.06, 0.06, 0.07, 0.04, 0.03], [900, 900, 500, 300, 400])
    return quantize_scene(np.concatenate([floor, back, wall, column, ball]), colors, scales, rng)


def quantize_scene(
    means: np.ndarray, colors: np.ndarray, scales: np.ndarray, rng: np.random.Generator
) -> Gaussians:
    """Quantize Gaussians by the steps of the header; other attributes are random."""
    count = len(means)
    codes = np.zeros((16, count), dtype=np.int64)
    sizes = np.log(scales) + rng.normal(0, 0.25, (3, count))
    codes[:3] = np.rint(sizes / HEADER.log_scale_step)
    codes[3] = np.rint(rng.uniform(0.5, 5.0, count) / HEADER.opacity_step)
    codes[4:7] = np.rint((colors.T - 0.5) / 0.2820948 / HEADER.sh_dc_step)
    codes[7:] = rng.laplace(0, 0.5, (9, count))
    largest = rng.integers(0, 4, (1, count))
    components = rng.uniform(-0.5, 0.5, (3, count)) * (1 << HEADER.rotation_bits)
    rotations = np.concatenate([largest, components.astype(np.int64)])
    return Gaussians(
        np.rint(means.T * UNITS_PER_METER / HEADER.position_step).astype(np.int64), rotations, codes
    )


def make_symbols(positions: np.ndarray, center: np.ndarray, speed: int) -> Int64:
    """Return symbols `[planes, A]` that move the anchors near the ball by `speed` steps along y."""
    symbols = np.zeros((HEADER.symbol_planes, positions.shape[1]), dtype=np.int64)
    near = np.linalg.norm(positions / UNITS_PER_METER - center[:, None], axis=0) < MOVED_RADIUS
    symbols[1, near] = speed
    return symbols


def make_sparks(
    positions: np.ndarray, codes: np.ndarray, center: np.ndarray, rng: np.random.Generator
) -> Births:
    """Return the births of four Gaussians, whose parents are near the center of the ball."""
    near = np.flatnonzero(
        np.linalg.norm(positions / UNITS_PER_METER - center[:, None], axis=0) < MOVED_RADIUS
    )
    parents = np.sort(rng.choice(near, 4))
    offsets = rng.normal(0, 0.1 * UNITS_PER_METER / HEADER.position_step, (3, 4)).astype(np.int64)
    rotations = np.array([[0], [0], [0], [0]], dtype=np.int64).repeat(4, axis=1)
    return Births(parents, Gaussians(offsets, rotations, codes[:, parents].astype(np.int64)))


if __name__ == "__main__":
    main()
