"""Applies the same edit to all decoded frames: crop, erase, transform, recolor.

The anchors of a stream depend on the number of Gaussians and on their positions. An edit that
changes this number or any position requires all frames to be fitted again. Each Gaussian keeps
its identity across frames.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.scene import Scene
from quarc_ref.encoder.frame_errors import name_frame_in_errors
from quarc_ref.encoder.scenes.encode_scenes import GivenFrame
from quarc_ref.encoder.scenes.recolor import Recoloring
from quarc_ref.export.up_direction import UP_KEY, find_up_direction, format_up_direction
from quarc_ref.export.upright import multiply_quaternions, rotate_sh
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import EncodeError
from quarc_ref.format.records import StreamHeader

_ROTATION_TOLERANCE = 1e-4


@dataclass(frozen=True, slots=True)
class Similarity:
    """A rotation, a uniform scaling and a shift: p becomes scale * rotation * p + shift.

    Attributes:
        rotation: Rotation matrix as nine numbers, row by row.
        scale: Factor above 0.
        shift: Translation after scaling, world units.
    """

    rotation: tuple[float, ...]
    scale: float
    shift: tuple[float, float, float]

    @classmethod
    def from_matrix(cls, matrix: NDArray[np.float64]) -> "Similarity":
        """Return the similarity that a matrix `[3, 4]` or `[4, 4]` describes.

        Raises:
            ValueError: The matrix is not a similarity: it mirrors, shears or scales non-uniformly.
        """
        linear_part = matrix[:3, :3]
        determinant = float(np.linalg.det(linear_part)) if np.isfinite(matrix).all() else 0.0
        if matrix.shape == (4, 4) and not np.allclose(matrix[3], [0, 0, 0, 1]):
            determinant = 0.0
        scale = max(determinant, 0.0) ** (1 / 3)
        rotation = linear_part / (scale or 1.0)
        if not scale or np.abs(rotation @ rotation.T - np.eye(3)).max() > _ROTATION_TOLERANCE:
            message = "the matrix is not a rotation combined with a uniform scaling and a shift"
            raise ValueError(message)
        x, y, z = matrix[:3, 3].tolist()
        return cls(tuple(rotation.ravel().tolist()), scale, (x, y, z))

    @property
    def rotation_matrix(self) -> NDArray[np.float64]:
        """The `[3, 3]` rotation matrix."""
        return np.array(self.rotation).reshape(3, 3)

    def apply(self, splats: Splats) -> Splats:
        """Return the transformed Gaussians, whose SH coefficients are rotated as well.

        Raises:
            EncodeError: A position exceeds the range of binary32.
        """
        positions = (
            self.scale * (splats.positions.astype(np.float64) @ self.rotation_matrix.T) + self.shift
        )
        if np.abs(positions).max(initial=0) > np.finfo(np.float32).max:
            message = "the transformation moves a Gaussian too far away"
            raise EncodeError(message)
        return replace(
            splats,
            positions=positions.astype(np.float32),
            rotations=multiply_quaternions(
                _matrix_to_quaternion(self.rotation_matrix), splats.rotations
            ),
            log_scales=splats.log_scales + np.float32(np.log(self.scale)),
            sh=rotate_sh(self.rotation_matrix, splats.sh),
        )

    def apply_to_camera(self, camera: Camera) -> Camera:
        """Return a camera that sees the transformed scene as `camera` sees the original scene."""
        rotation = np.array(camera.rotation).reshape(3, 3) @ self.rotation_matrix.T
        translation = self.scale * np.array(camera.translation) - rotation @ self.shift
        return replace(
            camera,
            rotation=tuple(rotation.ravel().tolist()),
            translation=tuple(translation.tolist()),
            near=camera.near * self.scale,
        )

    def apply_to_header(self, header: StreamHeader) -> StreamHeader:
        """Return a header with the transformed scale and up axis (0 if no axis points up).

        Raises:
            EncodeError: The size of a world unit is out of the format's range.
        """
        up_axis = 0
        if header.up_axis:
            axis_index, sign = (header.up_axis - 1) // 2, 1 - 2 * ((header.up_axis - 1) % 2)
            up_direction = sign * self.rotation_matrix[:, axis_index]
            axis = int(np.abs(up_direction).argmax())
            if abs(abs(up_direction[axis]) - 1) < _ROTATION_TOLERANCE:
                up_axis = 1 + 2 * axis + int(up_direction[axis] < 0)
        with np.errstate(over="ignore"):  # an infinite size is rejected below
            meters_per_unit = float(np.float32(header.meters_per_unit / self.scale))
        try:
            return replace(header, up_axis=up_axis, meters_per_unit=meters_per_unit)
        except ValueError as error:
            message = (
                f"scaling by {self.scale:.6g} is not possible, because a world unit would be "
                f"{meters_per_unit:.6g} m: {error}"
            )
            raise EncodeError(message) from error

    def apply_to_metadata(self, metadata: dict[str, str], header: StreamHeader) -> dict[str, str]:
        """Return metadata with the transformed up direction, unless an axis points up.

        Args:
            metadata: Metadata of the original stream.
            header: Header of the original stream.
        """
        other_entries = {key: text for key, text in metadata.items() if key != UP_KEY}
        direction = find_up_direction(header.up_axis, metadata)
        if direction is None or self.apply_to_header(header).up_axis:
            return other_entries
        up_text = format_up_direction(self.rotation_matrix @ direction)
        return {**other_entries, UP_KEY: up_text}


@dataclass(frozen=True, slots=True)
class Edit:
    """Changes that are applied to every frame, in the order listed here.

    Attributes:
        boxes: Boxes `(min x, min y, min z, max x, max y, max z)` in world units. Only Gaussians
            inside all boxes are kept.
        spheres: Spheres `(center x, center y, center z, radius)` in world units. Gaussians
            inside a sphere are removed.
        similarity: Transformation of the scene; None: no transformation.
        recoloring: Change of the colors; None: no change.
    """

    boxes: tuple[tuple[float, ...], ...] = field(default=())
    spheres: tuple[tuple[float, ...], ...] = field(default=())
    similarity: Similarity | None = None
    recoloring: Recoloring | None = None

    @property
    def changes_only_colors(self) -> bool:
        """Whether the edit changes only colors, so that `recolor` can apply it exactly."""
        return not (self.boxes or self.spheres or self.similarity)

    def apply(self, splats: Splats, ids: Int64) -> GivenFrame:
        """Return the edited Gaussians of a frame with their ids.

        Raises:
            EncodeError: The edit removes all Gaussians, or moves one too far away.
        """
        rows = np.flatnonzero(self._find_kept(splats.positions))
        if not rows.size:
            message = "the edit removes all Gaussians"
            raise EncodeError(message)
        names = ("positions", "rotations", "log_scales", "opacities", "sh")
        splats = Splats(*(getattr(splats, name)[rows] for name in names))
        if self.similarity:
            splats = self.similarity.apply(splats)
        if self.recoloring:
            splats = self.recoloring.apply(splats)
        return GivenFrame(splats, ids[rows])

    def _find_kept(self, positions: NDArray[np.float32]) -> Bits:
        is_kept = np.ones(len(positions), dtype=np.bool_)
        for box in self.boxes:
            is_inside = (positions >= box[:3]) & (positions <= box[3:])
            is_kept &= is_inside.all(axis=1)
        for sphere in self.spheres:
            offsets = positions.astype(np.float64) - sphere[:3]
            with np.errstate(over="ignore"):  # the square of a large number is infinite
                is_kept &= np.square(offsets).sum(axis=1) > np.square(sphere[3])
        return is_kept


def edit_frames(scenes: Iterable[Scene], edit: Edit) -> Iterator[GivenFrame]:
    """Yield edited frames; ids after a keyframe differ from all ids before it.

    Args:
        scenes: Decoded frames of a stream, in order.
        edit: The edit to apply to every frame.

    Raises:
        EncodeError: The edit removes all Gaussians of a frame, or moves one too far away.
    """
    keyframe_index = -1
    for scene in scenes:
        keyframe_index += scene.phase == 0 or keyframe_index < 0
        with name_frame_in_errors(scene.frame):
            frame = edit.apply(dequantize(scene), scene.ids + (keyframe_index << 32))
        yield frame


def _matrix_to_quaternion(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Convert a rotation matrix `[3, 3]` to a quaternion wxyz `[4]`."""
    m = matrix
    trace = np.trace(m)
    diagonal_terms = np.array([trace, m[0, 0], m[1, 1], m[2, 2]])
    largest = int(diagonal_terms.argmax())
    if largest == 0:
        q = [1 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]]
    else:
        i = largest - 1
        j, k = (i + 1) % 3, (i + 2) % 3
        q = [0.0] * 4
        q[0] = m[k, j] - m[j, k]
        q[1 + i] = 1 + m[i, i] - m[j, j] - m[k, k]
        q[1 + j] = m[j, i] + m[i, j]
        q[1 + k] = m[k, i] + m[i, k]
    unit_quaternion: NDArray[np.float64] = np.array(q) / np.linalg.norm(q)
    return unit_quaternion
