"""A frame as a NumPy archive: the integer state, and its dequantized floats."""

import io
from typing import Any

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.scene import Scene
from quarc_ref.export.clip import Clip, Frame


def build(frame: Frame, _clip: Clip) -> bytes:
    """Return the bytes of a frame's file."""
    return build_npz(frame.scene, frame.splats)


def build_npz(scene: Scene, splats: Splats) -> bytes:
    """Return the bytes of an uncompressed archive.

    It holds `ids`, `state_positions`, `state_rotations`, `state_codes` as in
    `Scene`, and `positions`, `rotations`, `log_scales`, `opacities`, `sh` as in
    `Splats`.
    """
    arrays = {
        "ids": scene.ids,
        "state_positions": scene.positions,
        "state_rotations": scene.rotations,
        "state_codes": scene.codes.astype(np.int32),
        "positions": splats.positions,
        "rotations": splats.rotations,
        "log_scales": splats.log_scales,
        "opacities": splats.opacities,
        "sh": splats.sh,
    }
    buffer = io.BytesIO()
    # However arrays stand in memory, which is up to the engine, the file is the same.
    packed: dict[str, Any] = {name: np.ascontiguousarray(arrays[name]) for name in arrays}
    np.savez(buffer, **packed)
    return buffer.getvalue()
