"""The state of a frame, from which the next frame is decoded: SPEC 7.1."""

from dataclasses import dataclass

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.arrays import Int16, Int64
from quarc_ref.format.coding.contexts import ContextCounts
from quarc_ref.format.records import Births, Gaussians
from quarc_ref.format.updates import Updates


@dataclass(frozen=True, slots=True, eq=False)
class State:
    """The data from which the next frame is decoded (SPEC 7.1).

    Attributes:
        scene: The frame's scene.
        motion: `[c, N]` motion of each Gaussian in the frame: the sum of all levels' symbols;
            0 for new Gaussians.
        symbols: `[c, a]` symbols of each level's anchors in the frame, level 1 first;
            empty in a canonical frame.
        anchors: Anchors of the last sampling; None before the first sampling.
        births: Births of the frame, as coded; None in a canonical frame.
        next_id: Id of the next new Gaussian.
        motion_counts: Zeros and ones counted in the motion contexts since the last canonical frame.
        birth_counts: Zeros and ones counted in the birth contexts since the last canonical frame.
        update_counts: Zeros and ones counted in the update contexts since the last canonical frame.
        recency: `[N]` number of frames since each Gaussian was updated or added, at most
            RECENCY_LIMIT; None in a stream without updates.
        updates: Updates of individual Gaussians in the frame, as coded; None in a canonical
            frame and in a stream without updates.
    """

    scene: Scene
    motion: Int16
    symbols: tuple[Int64, ...]
    anchors: Anchors | None
    births: Births | None
    next_id: int
    motion_counts: ContextCounts
    birth_counts: ContextCounts
    update_counts: ContextCounts
    recency: Int16 | None
    updates: Updates | None = None

    @property
    def frame(self) -> int:
        """Ordinal of the frame in the stream."""
        return self.scene.frame

    @property
    def required_anchors(self) -> Anchors:
        """The anchors of the last sampling; not available before `begin_frame`.

        Raises:
            ValueError: `begin_frame` has not been called.
        """
        if self.anchors is None:
            message = "begin_frame has not been called for this state"
            raise ValueError(message)
        return self.anchors

    @property
    def required_recency(self) -> Int16:
        """The recency of the Gaussians; available only in a stream with updates.

        Raises:
            ValueError: The stream has no updates.
        """
        if self.recency is None:
            message = "the stream has no updates"
            raise ValueError(message)
        return self.recency


@dataclass(frozen=True, slots=True, eq=False)
class SnapshotReference:
    """The canonical frame that snapshots are coded against (SPEC 7.9).

    Attributes:
        frame: Ordinal of the canonical frame.
        gaussians: Coded Gaussians of the frame.
    """

    frame: int
    gaussians: Gaussians
