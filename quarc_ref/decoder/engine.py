"""The interface of decoder engines, which compute the state of each frame.

SPEC defines the state. The reference engine computes it in plain NumPy, in `frames` and
the modules that `frames` calls. The fast engine computes the same integers in a different
way; the conformance suite and tests compare it with the reference engine. `engines`
chooses the engine; the choice affects only speed.
"""

from collections.abc import Callable
from typing import Final, Protocol, TypeVar

from quarc_ref.decoder.anchors import Anchors
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.scene import Scene
from quarc_ref.format.arrays import Int16, Int64
from quarc_ref.format.records import (
    Births,
    CanonicalChunk,
    FrameChunk,
    Gaussians,
    Section,
    SnapshotChunk,
    StreamHeader,
)
from quarc_ref.format.updates import Updates

REFERENCE: Final = "reference"
FAST: Final = "fast"


class FrameState(Protocol):
    """The state of a frame, as every engine provides it; see `state.State`."""

    @property
    def frame(self) -> int:
        """Ordinal of the frame in the stream."""
        ...

    @property
    def scene(self) -> Scene:
        """The frame's scene."""
        ...

    @property
    def motion(self) -> Int16:
        """`[c, N]` motion of each Gaussian in the frame: the sum of all levels' symbols."""
        ...

    @property
    def symbols(self) -> tuple[Int64, ...]:
        """`[c, a]` symbols of each level's anchors, level 1 first; empty in a canonical frame."""
        ...

    @property
    def births(self) -> Births | None:
        """The new Gaussians of the frame, as coded; None in a canonical frame."""
        ...

    @property
    def updates(self) -> Updates | None:
        """The updates of the frame, as coded; None if the frame has no section for them."""
        ...

    @property
    def next_id(self) -> int:
        """The id of the next new Gaussian."""
        ...

    @property
    def anchors(self) -> Anchors | None:
        """The anchors of the last sampling; None before the first sampling."""
        ...

    @property
    def required_anchors(self) -> Anchors:
        """The anchors of the last sampling; not available before `begin_frame`."""
        ...


StateT = TypeVar("StateT", bound=FrameState)


class Engine(Protocol[StateT]):
    """Decodes chunks and sections to states, and encodes sections.

    A state can be used only with the engine that created it. Every method raises the same
    errors as the reference function of the same name.
    """

    name: str

    def decode_canonical(
        self, header: StreamHeader, chunk: CanonicalChunk
    ) -> tuple[StateT, Gaussians]:
        """See `frames.decode_canonical`."""
        ...

    def decode_snapshot(
        self, header: StreamHeader, chunk: SnapshotChunk, canonical: Gaussians
    ) -> tuple[StateT, Int64]:
        """See `frames.decode_snapshot`."""
        ...

    def decode_frame(self, state: StateT, chunk: FrameChunk) -> StateT:
        """See `frames.decode_frame`."""
        ...

    def begin_canonical(self, header: StreamHeader, frame: int, gaussians: Gaussians) -> StateT:
        """See `canonical.begin_canonical`."""
        ...

    def begin_frame(self, state: StateT, death_count: int) -> StateT:
        """See `reconstruct.begin_frame`."""
        ...

    def decode_motion(self, state: StateT, section: Section, *, use_previous: bool) -> StateT:
        """See `frames.decode_motion`."""
        ...

    def decode_updates(self, state: StateT, section: Section) -> StateT:
        """See `frames.decode_updates`."""
        ...

    def decode_births(self, state: StateT, section: Section, count: int) -> StateT:
        """See `frames.decode_births`."""
        ...

    def write_canonical(
        self, gaussians: Gaussians, origin: tuple[int, int, int]
    ) -> tuple[Section, ...]:
        """See `gaussian_planes.write_canonical`."""
        ...

    def write_motion(self, state: StateT, symbols: list[Int64], *, use_previous: bool) -> Section:
        """Encode the motion of a frame after `begin_frame`; see `motion_planes.write_motion`."""
        ...

    def write_updates(self, state: StateT, updates: Updates) -> Section:
        """Encode the updates of a frame after its motion; see `update_planes.write_updates`."""
        ...

    def write_births(self, state: StateT, births: Births) -> Section:
        """Encode the births of a frame after its updates; see `gaussian_planes.write_births`."""
        ...

    def state_crc(self, state: StateT) -> int:
        """Return the CRC of a state's scene; see `digest.state_crc`."""
        ...

    def make_dequantizer(self) -> Callable[[StateT], Splats]:
        """Return a function that dequantizes states; see `dequantize.dequantize`."""
        ...
