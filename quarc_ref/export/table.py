"""The file formats that decoded frames are exported to: a row each, and a module each.

A module has either `build(frame, clip)`, which returns the bytes of a file per
frame, or a class `Sequence`, which collects frames for one file. The table is
light, so that the command can list the formats: a module is imported when it
is used, and the library that writes its format with it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from quarc_ref.export.clip import Clip, Frame


class FrameSequence(Protocol):
    """Frames that are collected into one file."""

    def add(self, frame: "Frame") -> None:
        """Append a frame, in the order of the stream."""
        ...

    def finish(self) -> bytes:
        """Return the bytes of the file; at least one frame must have been added."""
        ...


@dataclass(frozen=True, slots=True)
class Export:
    """A file format for decoded frames.

    Attributes:
        suffix: Suffix of its files, without the dot; also its name.
        title: Human-readable name.
        module: Name of the module of this package that writes it.
        is_sequence: Whether one file holds all frames, instead of one file per frame.
        package: The library that writes it, as it is imported; None for none.
        extra: Extra of quarc-ref that installs the library; None for none.
    """

    suffix: str
    title: str
    module: str
    is_sequence: bool = False
    package: str | None = None
    extra: str | None = None

    def require(self) -> None:
        """Import the library, so that a missing one is known before any frame is decoded.

        Raises:
            ImportError: It is not installed; `extra` names what installs it.
        """
        if self.package is not None:
            import_module(self.package)

    def builder(self) -> "Callable[[Frame, Clip], bytes]":
        """Return the function that makes the file of a frame; not for sequences.

        Raises:
            ImportError: The library is not installed.
        """
        self.require()
        build: Callable[[Frame, Clip], bytes] = self._load().build
        return build

    def begin(self, clip: "Clip") -> FrameSequence:
        """Begin the one file of a sequence.

        Args:
            clip: Properties of all frames.

        Raises:
            ImportError: The library is not installed.
        """
        self.require()
        sequence: FrameSequence = self._load().Sequence(clip)
        return sequence

    def _load(self) -> "_Module":
        module: _Module = import_module(f"quarc_ref.export.{self.module}")
        return module


class _Module(Protocol):
    build: "Callable[[Frame, Clip], bytes]"
    Sequence: "Callable[[Clip], FrameSequence]"


_ROWS = (
    Export("ply", "3DGS PLY", "gaussian_ply"),
    Export("npz", "NumPy arrays, including the integer state", "arrays_npz"),
    Export("spz", "SPZ 3 of Niantic", "spz", package="gaussforge", extra="export"),
    Export("sog", "SOG 2 of PlayCanvas", "sog", package="gaussforge", extra="export"),
    Export(
        "glb", "glTF, KHR_gaussian_splatting", "gltf_binary", package="pygltflib", extra="export"
    ),
    Export("usdc", "OpenUSD, time samples", "open_usd", True, package="pxr", extra="export"),
    Export("4dgs", "4dgs keyframes and deltas", "fourdgs_file", True, "fourdgs", "export"),
    Export("rrd", "rerun recording", "rerun_recording", True, "rerun", "rerun"),
)
EXPORTS = {row.suffix: row for row in _ROWS}
