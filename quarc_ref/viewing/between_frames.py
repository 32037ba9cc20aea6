"""Gaussians at times between frames, for slow motion and moving cameras.

Gaussians of two successive frames with the same id are the same. Positions, scales and colors are
interpolated, and so are opacities, not their logits. Births fade in, and deaths fade out. The
format defines no such values, so they are only for viewing.
"""

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np

from quarc_ref.decoder import Scene, Splats, dequantize
from quarc_ref.decoder.dequantize import Float32
from quarc_ref.export.activate import compute_opacities
from quarc_ref.format.arrays import Int64

_MIN_OPACITY = 1e-6


class FramesInOrder:
    """The Gaussians of a stream at ascending times.

    Args:
        scenes: Decoded frames in order.
    """

    def __init__(self, scenes: Iterator[Scene]) -> None:
        self._scenes = scenes
        self._scene: Scene | None = None
        self._next_scene: Scene | None = None

    def find(self, frame: int, share: float = 0.0) -> Splats:
        """Return the Gaussians of a frame, or between it and the next one.

        Args:
            frame: Ordinal of the frame; not less than in earlier calls.
            share: Share of the way to the next frame, from 0 to below 1. The next frame is read
                only if the share is above 0. If the next frame is a keyframe, whose Gaussians have
                new ids, the frame stays until then.
        """
        while self._scene is None or self._scene.frame < frame:
            self._scene, self._next_scene = self._next_scene or next(self._scenes), None
        if not share:
            return dequantize(self._scene)
        self._next_scene = self._next_scene or next(self._scenes)
        if self._next_scene.phase == 0:
            return dequantize(self._scene)
        return interpolate(self._scene, self._next_scene, share)


def interpolate(first: Scene, second: Scene, share: float) -> Splats:
    """Return the Gaussians of two successive frames at a share of the way to the second frame."""
    _, kept, still = np.intersect1d(first.ids, second.ids, assume_unique=True, return_indices=True)
    deaths = np.setdiff1d(np.arange(first.count), kept, assume_unique=True)
    births = np.setdiff1d(np.arange(second.count), still, assume_unique=True)
    start, end = dequantize(first), dequantize(second)
    groups = (
        _interpolate_rows(_select(start, kept), _select(end, still), share),
        _fade(_select(start, deaths), 1 - share),
        _fade(_select(end, births), share),
    )
    return Splats(
        *(
            np.concatenate([getattr(group, field.name) for group in groups])
            for field in fields(Splats)
        )
    )


def _interpolate_rows(first: Splats, second: Splats, share: float) -> Splats:
    """Interpolate Gaussians, which are in the same order."""

    def mix(start: Float32, end: Float32) -> Float32:
        return start + np.float32(share) * (end - start)

    dots = (first.rotations * second.rotations).sum(axis=1, keepdims=True)
    rotations = mix(np.where(dots < 0, -first.rotations, first.rotations), second.rotations)
    norms: Float32 = np.linalg.norm(rotations, axis=1, keepdims=True)
    opacities = mix(compute_opacities(first), compute_opacities(second))
    return Splats(
        positions=mix(first.positions, second.positions),
        rotations=rotations / norms,
        log_scales=mix(first.log_scales, second.log_scales),
        opacities=_deactivate(opacities),
        sh=mix(first.sh, second.sh),
    )


def _fade(splats: Splats, factor: float) -> Splats:
    """Multiply opacities by a factor."""
    opacities = np.float32(factor) * compute_opacities(splats)
    return replace(splats, opacities=_deactivate(opacities))


def _select(splats: Splats, rows: Int64) -> Splats:
    return Splats(*(getattr(splats, field.name)[rows] for field in fields(Splats)))


def _deactivate(opacities: Float32) -> Float32:
    clipped = np.clip(opacities, _MIN_OPACITY, 1 - _MIN_OPACITY)
    logits: Float32 = np.log(clipped / (1 - clipped))
    return logits
