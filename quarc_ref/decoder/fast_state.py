"""Python view of a state of the Rust core."""

from functools import cached_property
from typing import TYPE_CHECKING

from quarc_ref.decoder.anchors import AnchorLevel, Anchors
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.arrays import Int16, Int64
from quarc_ref.format.records import Births, Gaussians, StreamHeader
from quarc_ref.format.updates import Updates

if TYPE_CHECKING:
    import quarc_core


class FastState:
    """A state of the core; see `engine.FrameState`. Arrays are created when they are accessed.

    Args:
        header: Header of the stream.
        core: The state object of the core.
    """

    def __init__(self, header: StreamHeader, core: "quarc_core.State") -> None:
        self.header = header
        self.core = core

    @property
    def frame(self) -> int:
        """Ordinal of the frame in the stream."""
        return self.core.frame

    @cached_property
    def scene(self) -> Scene:
        """The frame's scene, whose planes are read-only."""
        core = self.core
        return Scene(
            self.header,
            core.frame,
            core.phase,
            core.ids(),
            core.positions(),
            core.rotations(),
            core.codes(),
        )

    @property
    def motion(self) -> Int16:
        """`[c, N]` motion of each Gaussian in the frame."""
        return self.core.motion()

    @property
    def symbols(self) -> tuple[Int64, ...]:
        """`[c, a]` symbols of each level's anchors, level 1 first; empty in a canonical frame."""
        return tuple(self.core.symbols())

    @property
    def births(self) -> Births | None:
        """The new Gaussians of the frame, as coded; None in a canonical frame."""
        coded = self.core.births()
        return None if coded is None else Births(coded[0], Gaussians(*coded[1]))

    @property
    def updates(self) -> Updates | None:
        """The updates of the frame, as coded; None if the frame has no section for them."""
        coded = self.core.updates()
        return None if coded is None else Updates(*coded)

    @property
    def next_id(self) -> int:
        """The id of the next new Gaussian."""
        return self.core.next_id

    @property
    def anchors(self) -> Anchors | None:
        """The anchors of the last sampling; None before the first sampling."""
        levels = self.core.levels()
        if not levels:
            return None
        return Anchors(tuple(AnchorLevel(*level) for level in levels), self.core.binding())

    @property
    def required_anchors(self) -> Anchors:
        """The anchors of the last sampling; not available before `begin_frame`.

        Raises:
            ValueError: `begin_frame` has not been called.
        """
        anchors = self.anchors
        if anchors is None:
            message = "begin_frame has not been called for this state"
            raise ValueError(message)
        return anchors
