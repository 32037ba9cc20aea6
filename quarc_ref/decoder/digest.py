"""Serializes a state, and computes its CRC and digest: SPEC 9.

In each plane, Gaussians are in the order of their ids. The chunk of every frame contains
the CRC-32 of its state; the SHA-256 is used to compare decoders.
"""

import hashlib
from collections.abc import Iterator
from zlib import crc32

import numpy as np

from quarc_ref.decoder.scene import Scene


def state_crc(scene: Scene) -> int:
    """Return the CRC-32 that the chunk of a frame must contain (SPEC 9.2)."""
    covers_all_fields = scene.phase % scene.header.full_crc_interval == 0
    return compute_state_crc(scene, all_fields=covers_all_fields)


def compute_state_crc(scene: Scene, *, all_fields: bool) -> int:
    """Return the CRC-32 over all planes of a scene, or over all planes except the codes.

    Args:
        scene: Scene after the births of the frame.
        all_fields: Whether the CRC also covers the codes.
    """
    crc = 0
    for plane in _serialize_planes(scene, all_fields=all_fields):
        crc = crc32(plane, crc)
    return crc


def compute_digest(scene: Scene) -> str:
    """Return the SHA-256 of a frame's complete serialization as hex digits (SPEC 9.1)."""
    digest = hashlib.sha256()
    for plane in _serialize_planes(scene, all_fields=True):
        digest.update(plane)
    return digest.hexdigest()


def _serialize_planes(scene: Scene, *, all_fields: bool) -> Iterator[bytes | memoryview]:
    for number in (scene.count, scene.phase):
        yield number.to_bytes(4, "little")
    yield scene.ids.astype("<u4").data
    for field in (scene.positions, scene.rotations, *([scene.codes] if all_fields else [])):
        yield np.ascontiguousarray(field, dtype="<i4").data
