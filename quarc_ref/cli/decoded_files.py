"""Input and output of `decode`: reads scenes of a stream, and writes files."""

from collections.abc import Iterator
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.output import print_fields, print_json, print_message
from quarc_ref.export.table import ExportFormat
from quarc_ref.wording import format_count

if TYPE_CHECKING:
    from quarc_ref.cli.targets import SingleFrameFile
    from quarc_ref.decoder import Scene, Splats
    from quarc_ref.export.clip import Clip
    from quarc_ref.export.table import FrameSequence
    from quarc_ref.files import OutputFolder
    from quarc_ref.format.cameras import Camera
    from quarc_ref.streams import Follow, Gap, Source


class FrameDecoder:
    """Decodes frames of a stream, and reads its header, cameras and metadata.

    Args:
        source: The stream.
        follow: Options for waiting while the stream grows; None to stop at its current end.
        gaps: List to which gaps are appended while decoding continues after damage; None to stop at
            damage.
    """

    def __init__(self, source: "Source", follow: "Follow | None", gaps: "list[Gap] | None") -> None:
        from quarc_ref.decoder.stream_decoder import StreamDecoder

        self._source, self._follow, self._gaps = source, follow, gaps
        self._decoder = StreamDecoder()
        self._prologue: tuple[tuple[Camera, ...], dict[str, str]] | None = None

    @property
    def clip(self) -> "Clip":
        """The header, and the cameras and metadata that have been read so far."""
        from quarc_ref.export.clip import Clip

        decoder = self._decoder
        if self._prologue is not None:
            return Clip(decoder.header, *self._prologue)
        return Clip(decoder.header, decoder.cameras, decoder.metadata)

    def decode_scenes(self, start: int, stop: int | None) -> "Iterator[Scene]":
        """Yield the scenes of frames `start` to `stop` - 1; None means no upper limit."""
        from quarc_ref.streams import Gap, decode, recover
        from quarc_ref.streams.follow import poll
        from quarc_ref.streams.prologue import read_prologue

        if self._gaps is None:
            if start > 0 and self._source.size() is not None:  # `decode` skips the prologue
                self._prologue = poll(lambda: read_prologue(self._source), self._follow)
            yield from decode(self._source, start, stop, self._follow, self._decoder)
            return
        for item in recover(self._source, self._follow, self._decoder):
            if isinstance(item, Gap):
                self._gaps.append(item)
                _report_gap(item)
                continue
            if start <= item.frame and (stop is None or item.frame < stop):
                yield item
            if stop is not None and item.frame + 1 >= stop:
                return


class FrameWriter:
    """Writes frames to files, and records the file names and the gaps of the stream.

    Args:
        export: Format of the files.
        with_sidecar: Whether `sequence.json` is written to the folder of the frames.
        bakes_filter: Whether the scales of Gaussians get the low-pass filter of the capture.

    Attributes:
        frame_count: Number of frames so far.
        file_names: Names of the files of frames so far.
        gaps: Gaps of the stream.
    """

    def __init__(
        self, export: ExportFormat, *, with_sidecar: bool, bakes_filter: bool = False
    ) -> None:
        self.frame_count = 0
        self.file_names: list[str] = []
        self.gaps: list[Gap] = []
        self._export = export
        self._with_sidecar = with_sidecar
        self._bakes_filter = bakes_filter
        self._sidecar: str | None = None
        self._sequence: FrameSequence | None = None

    def add(self, target: "OutputFolder | SingleFrameFile", scene: "Scene", clip: "Clip") -> None:
        """Write a frame to its file, or add it to the single file of all frames.

        Raises:
            UsageError: The low-pass filter is requested, but the stream has no cameras.
        """
        from quarc_ref.export.clip import Frame

        if self._with_sidecar and self._sidecar is None:
            self._write_sidecar(target, scene.frame, clip)
        self.frame_count += 1
        frame = Frame.from_scene(scene)
        if self._bakes_filter:
            frame = replace(frame, splats=_bake_filter(frame.splats, clip))
        if self._export.is_sequence:
            self._sequence = self._sequence or self._export.begin(clip)
            self._sequence.add(frame)
        else:
            data = self._export.load_builder()(frame, clip)
            name = f"frame_{scene.frame:04}.{self._export.suffix}"
            self.file_names.append(target.write(name, data).name)

    def finish(self, target: "OutputFolder | SingleFrameFile") -> None:
        """If the format stores all frames in a single file, write that file."""
        if self._sequence is not None:
            name = f"frames.{self._export.suffix}"
            self.file_names.append(target.write(name, self._sequence.finish()).name)

    def print_result(self, output: Path | None, *, as_json: bool, recovers: bool) -> None:
        """Print the names of all written files.

        Args:
            output: Path of the output folder or file; None if nothing was written.
            as_json: Whether to print JSON.
            recovers: Whether decoding continued after damage, so that the gaps are printed.
        """
        if as_json:
            gaps = {"gaps": [asdict(gap) for gap in self.gaps]} if recovers else {}
            written_files = {"files": self.file_names, "sidecar": self._sidecar}
            folder = output if output is None or self._with_sidecar else output.parent
            print_json("decode/2", {"folder": folder and str(folder), **written_files, **gaps})
            return
        names = self.file_names
        name_range = f", {names[0]} to {names[-1]}" if len(names) > 1 else ""
        fields = {"files": f"{len(names)}{name_range or ''.join(f', {name}' for name in names)}"}
        fields |= {"gaps": f"{len(self.gaps)}"} if recovers else {}
        print_fields(str(output or "no folder"), fields)

    def _write_sidecar(
        self, target: "OutputFolder | SingleFrameFile", first_frame: int, clip: "Clip"
    ) -> None:
        from quarc_ref.export.sidecar import SIDECAR_NAME, build_sidecar

        is_single_file = self._export.is_sequence
        pattern = (
            f"frames.{self._export.suffix}"
            if is_single_file
            else f"frame_{{frame:04}}.{self._export.suffix}"
        )
        self._sidecar = target.write(SIDECAR_NAME, build_sidecar(clip, pattern, first_frame)).name


def _bake_filter(splats: "Splats", clip: "Clip") -> "Splats":
    from quarc_ref.export.bake_filter import bake_filter

    if not clip.cameras:
        message = "--bake-filter needs the cameras of the capture, but the stream has none"
        raise UsageError(message)
    return bake_filter(splats, clip.cameras)


def _report_gap(gap: "Gap") -> None:
    """Print the position and the size of a gap to standard error."""
    size = "to the end" if gap.byte_count is None else format_count(gap.byte_count, "byte")
    lost_frames = "unknown" if gap.frames_lost is None else f"{gap.frames_lost}"
    line = f"gap at byte {gap.offset}, {size}, frames lost: {lost_frames}; {gap.message}"
    print_message(line)
