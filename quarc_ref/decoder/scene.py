"""The Gaussians of a frame as integers: the part of the state that is serialized (SPEC 9.1).

Arrays are stored by plane, for example `[3, N]` instead of `[N, 3]`, because the state is
serialized, hashed and coded in this order.
"""

from dataclasses import dataclass

import numpy as np

from quarc_ref.format.arrays import Int16, Int32, Int64
from quarc_ref.format.records import StreamHeader


@dataclass(frozen=True, slots=True, eq=False)
class Scene:
    """The decoded Gaussians of a frame, ordered by id.

    The arrays are read-only, because the next frame is decoded from them.

    Attributes:
        header: Header of the stream.
        frame: Ordinal of the frame in the stream.
        phase: Number of frames since the last canonical frame, whose phase is 0.
        ids: `[N]` ascending ids: 0 to N - 1 in a canonical frame; new Gaussians get the next ids.
        positions: `[3, N]` positions xyz in lattice units, magnitudes below 2^23.
        rotations: `[4, N]` unit quaternions wxyz, Q22.
        codes: `[code_planes, N]` codes of log-scale (3), opacity logit (1), SH DC (3) and, at
            SH degree 1, SH rest (9).
    """

    header: StreamHeader
    frame: int
    phase: int
    ids: Int64
    positions: Int32
    rotations: Int32
    codes: Int16

    def __post_init__(self) -> None:
        planes = (
            ("positions", 3, np.int32),
            ("rotations", 4, np.int32),
            ("codes", self.header.code_planes, np.int16),
        )
        for name, rows, dtype in planes:
            array, shape = getattr(self, name), (rows, self.count)
            if array.shape != shape or array.dtype != dtype:
                message = f"{name} is {array.dtype}{array.shape}, not {dtype.__name__}{shape}"
                raise ValueError(message)
        for name in ("ids", "positions", "rotations", "codes"):
            view = getattr(self, name).view()
            view.flags.writeable = False
            object.__setattr__(self, name, view)

    @property
    def count(self) -> int:
        """Number of Gaussians, N."""
        return int(self.ids.size)

    def without(self, deleted_indices: Int64) -> "Scene":
        """Return the scene without the Gaussians at indices `[g]`; the others keep their order."""
        return Scene(
            self.header,
            self.frame,
            self.phase,
            np.delete(self.ids, deleted_indices),
            np.delete(self.positions, deleted_indices, axis=1),
            np.delete(self.rotations, deleted_indices, axis=1),
            np.delete(self.codes, deleted_indices, axis=1),
        )
