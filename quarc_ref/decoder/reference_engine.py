"""The reference engine, which follows the text of SPEC 6 to 10."""

from collections.abc import Callable
from typing import ClassVar

from quarc_ref.decoder import frames, reconstruct
from quarc_ref.decoder.canonical import begin_canonical
from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.digest import state_crc
from quarc_ref.decoder.engine import REFERENCE
from quarc_ref.decoder.state import State
from quarc_ref.decoder.updates import update_context
from quarc_ref.format.arrays import Int64
from quarc_ref.format.coding.gaussian_planes import write_births, write_canonical
from quarc_ref.format.coding.motion_planes import write_motion
from quarc_ref.format.coding.update_planes import write_updates
from quarc_ref.format.records import Births, CanonicalChunk, Gaussians, Section, StreamHeader
from quarc_ref.format.updates import Updates


class ReferenceEngine:
    """The engine made of the functions in `frames` and `reconstruct`; see `engine.Engine`.

    Attributes:
        largest_gaussian_count: Number of Gaussians in the largest canonical frame that this process
            has decoded.
    """

    name = REFERENCE
    largest_gaussian_count: ClassVar[int] = 0
    decode_snapshot = staticmethod(frames.decode_snapshot)
    decode_frame = staticmethod(frames.decode_frame)
    begin_canonical = staticmethod(begin_canonical)
    begin_frame = staticmethod(reconstruct.begin_frame)
    decode_motion = staticmethod(frames.decode_motion)
    decode_updates = staticmethod(frames.decode_updates)
    decode_births = staticmethod(frames.decode_births)
    write_canonical = staticmethod(write_canonical)

    def decode_canonical(
        self, header: StreamHeader, chunk: CanonicalChunk
    ) -> tuple[State, Gaussians]:
        """See `Engine.decode_canonical`."""
        ReferenceEngine.largest_gaussian_count = max(
            ReferenceEngine.largest_gaussian_count, chunk.gaussian_count
        )
        return frames.decode_canonical(header, chunk)

    def write_motion(self, state: State, symbols: list[Int64], *, use_previous: bool) -> Section:
        """See `Engine.write_motion`."""
        contexts = reconstruct.motion_contexts(state, use_previous=use_previous)
        return write_motion(contexts, symbols, state.motion_counts)

    def write_updates(self, state: State, updates: Updates) -> Section:
        """See `Engine.write_updates`."""
        return write_updates(update_context(state), updates, state.update_counts)

    def write_births(self, state: State, births: Births) -> Section:
        """See `Engine.write_births`."""
        return write_births(births, state.birth_counts)

    def state_crc(self, state: State) -> int:
        """See `Engine.state_crc`."""
        return state_crc(state.scene)

    def make_dequantizer(self) -> Callable[[State], Splats]:
        """See `Engine.make_dequantizer`."""
        return lambda state: dequantize(state.scene)
