"""Table of the export formats; each format is written by one module.

A module has either `build(frame, clip)`, which returns the file of a frame, or a class
`SequenceExporter`, which collects all frames in one file. Modules and libraries are imported on
first use, so the command line can list the formats quickly.
"""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from quarc_ref.export.clip import Clip, Frame


class FrameSequence(Protocol):
    """Interface of exporters that collect all frames in one file."""

    def add(self, frame: "Frame") -> None:
        """Append a frame; frames must be added in the order of the stream."""
        ...

    def finish(self) -> bytes:
        """Build the file; at least one frame must have been added."""
        ...


@dataclass(frozen=True, slots=True)
class ExportFormat:
    """A file format for decoded frames.

    Attributes:
        suffix: File suffix without the dot, which is also the name of the format.
        title: Human-readable name.
        module: Name of the module that writes the format.
        is_sequence: Whether one file contains all frames; otherwise, each frame has its own file.
        package: Import name of the library that the module needs; None if it needs none.
        extra: Name of the quarc-ref extra that installs the library; None if no library is needed.
    """

    suffix: str
    title: str
    module: str
    is_sequence: bool = False
    package: str | None = None
    extra: str | None = None

    def require_library(self) -> None:
        """Import the library, so that a missing library is reported before frames are decoded.

        Raises:
            ImportError: The library is not installed; the extra `extra` of quarc-ref installs it.
        """
        if self.package is not None:
            import_module(self.package)

    def load_builder(self) -> "Callable[[Frame, Clip], bytes]":
        """Return the function that builds the file of a frame; not supported by sequence formats.

        Raises:
            ImportError: The library is not installed.
        """
        self.require_library()
        build: Callable[[Frame, Clip], bytes] = self._load().build
        return build

    def begin(self, clip: "Clip") -> FrameSequence:
        """Start a file that contains all frames; only sequence formats support this.

        Args:
            clip: Properties of the stream.

        Raises:
            ImportError: The library is not installed.
        """
        self.require_library()
        sequence: FrameSequence = self._load().SequenceExporter(clip)
        return sequence

    def _load(self) -> "_Module":
        module: _Module = import_module(f"quarc_ref.export.{self.module}")
        return module


class _Module(Protocol):
    build: "Callable[[Frame, Clip], bytes]"
    SequenceExporter: "Callable[[Clip], FrameSequence]"


_FORMATS = (
    ExportFormat("ply", "3DGS PLY", "gaussian_ply"),
    ExportFormat("npz", "NumPy arrays, including the integer state", "arrays_npz"),
    ExportFormat("spz", "SPZ 3 of Niantic", "spz", package="gaussforge", extra="export"),
    ExportFormat("sog", "SOG 2 of PlayCanvas", "sog", package="gaussforge", extra="export"),
    ExportFormat(
        "glb", "glTF, KHR_gaussian_splatting", "gltf_binary", package="pygltflib", extra="export"
    ),
    ExportFormat("usdc", "OpenUSD, time samples", "open_usd", True, package="pxr", extra="export"),
    ExportFormat("4dgs", "4dgs keyframes and deltas", "fourdgs_file", True, "fourdgs", "export"),
    ExportFormat("rrd", "rerun recording", "rerun_recording", True, "rerun", "rerun"),
)
EXPORT_FORMATS = {row.suffix: row for row in _FORMATS}
