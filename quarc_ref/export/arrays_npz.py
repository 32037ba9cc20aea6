"""Exports a frame as a NumPy archive with the integer state and the dequantized floats."""

import io
from typing import Any

import numpy as np

from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.scene import Scene
from quarc_ref.export.clip import Clip, Frame


def build(frame: Frame, _clip: Clip) -> bytes:
    """Build the NumPy archive of a frame."""
    return build_npz(frame.scene, frame.splats)


def build_npz(scene: Scene, splats: Splats) -> bytes:
    """Build an uncompressed `.npz` archive.

    The archive contains `ids`, `state_positions`, `state_rotations` and `state_codes` from
    the `Scene`, and `positions`, `rotations`, `log_scales`, `opacities` and `sh` from the
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
    # The file must not depend on the memory layout of arrays, which differs between engines.
    contiguous_arrays: dict[str, Any] = {
        name: np.ascontiguousarray(arrays[name]) for name in arrays
    }
    np.savez(buffer, **contiguous_arrays)
    return buffer.getvalue()
