"""What `encode` was asked to encode, and the ways to do it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from quarc_ref.cli.encoder_options import open_asked, require_device
from quarc_ref.cli.stream_targets import growing_stream
from quarc_ref.cli.targets import written_stream

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Capture
    from quarc_ref.encoder import EncodeOptions
    from quarc_ref.encoder.config import EncoderConfig
    from quarc_ref.encoder.progress import Progress


@dataclass(frozen=True, slots=True)
class EncodeWork:
    """A capture and how to encode it.

    Attributes:
        folder: Of the capture.
        downscale: Times that pictures are made smaller.
        held_out: Names of the cameras to keep for evaluation; none for the first.
        config: All settings of training and stream.
        frames: How many, from the first; None for all.
        device: As `--device` has it.
        progress: Is told of every step.
    """

    folder: Path
    downscale: int
    held_out: tuple[str, ...]
    config: "EncoderConfig"
    frames: int | None
    device: str
    progress: "Progress"

    def open(self) -> "tuple[Capture, EncodeOptions]":
        """Return the capture, opened, and the options.

        Raises:
            UsageError: Something is asked for that is not there.
            CaptureError: The capture cannot be read.
        """
        from quarc_ref.encoder import EncodeOptions

        require_device(self.device)
        capture = open_asked(self.folder, self.downscale, list(self.held_out))
        return capture, EncodeOptions(self.config, self.frames, self.device, self.progress)


@dataclass(frozen=True, slots=True)
class FileWanted:
    """How a file is to be written.

    Attributes:
        force: Whether to replace one.
        live: Whether to write it in its own place.
        resume: Whether to go on with what an encode has left.
    """

    force: bool
    live: bool
    resume: bool


def encode_to_pipe(work: EncodeWork, target: Path) -> None:
    """Encode to standard output."""
    with written_stream(target, force=False) as sink:
        from quarc_ref.encoder import encode

        capture, options = work.open()
        encode(capture, sink, options)


def encode_to_file(work: EncodeWork, target: Path, wanted: FileWanted) -> None:
    """Encode into a file, or go on with one.

    Raises:
        UsageError: The file cannot be written so.
    """
    with growing_stream(target, force=wanted.force, live=wanted.live, resume=wanted.resume) as path:
        from quarc_ref.encoder.stream_file import encode_file

        capture, options = work.open()
        encode_file(capture, path, options)
