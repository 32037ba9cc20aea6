"""Encodes the streams for the rate tables; streams that already exist are reused."""

import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.cli.output import TerminalProgress
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder import EncodeOptions
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import change_settings, choose_preset, list_settings
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.format.errors import ResumeError
from quarc_ref.synth import SynthOptions, write_synthetic_capture
from studies import write_status

BUILT_IN_CAPTURE = "synth"
_MAX_NAME_LENGTH = 180
_DIGEST_LENGTH = 12
_SETTING_PATTERN = re.compile(r"(\S+?)=(.*?)(?= \S+=|$)")


@dataclass(frozen=True, slots=True)
class Job:
    """A stream to encode, or to load if it already exists.

    Attributes:
        capture: Folder of the capture.
        preset: Name of the preset.
        changes: Settings that differ from the preset, as pairs of name and value.
        frames: Number of frames to encode, starting with the first; None for all.
        downscale: Factor by which pictures are downscaled.
        held_out: Names of held-out cameras; if empty, the first camera is held out.
    """

    capture: Path
    preset: str
    changes: tuple[tuple[str, str], ...] = ()
    frames: int | None = None
    downscale: int = 1
    held_out: tuple[str, ...] = ()

    def file_name(self) -> str:
        """Return the file name of the stream, which depends on all fields of the job.

        A long name is shortened and ends in a digest, because file systems allow at most 255 bytes.
        """
        name_parts = [self.capture.resolve().name, self.preset]
        name_parts += [f"{name}={value}" for name, value in self.changes]
        if self.frames is not None:
            name_parts.append(f"frames={self.frames}")
        if self.downscale != 1:
            name_parts.append(f"downscale={self.downscale}")
        if self.held_out:
            name_parts.append(f"without={'+'.join(self.held_out)}")
        name = ".".join(name_parts)
        if len(name) > _MAX_NAME_LENGTH:
            digest = hashlib.sha256(name.encode()).hexdigest()[:_DIGEST_LENGTH]
            name = f"{name[: _MAX_NAME_LENGTH - _DIGEST_LENGTH - 1]}-{digest}"
        return f"{name}.quarc"

    def make_config(self) -> EncoderConfig:
        """Return the settings of the encoder.

        Raises:
            SettingError: The preset or a setting does not exist, or a value is invalid or unused.
        """
        return change_settings(choose_preset(self.preset), self.changes)


def trace_capture_if_missing(name: str, folder: Path) -> Path:
    """Return the folder of a capture; ray-trace the playroom first if it is missing."""
    if name != BUILT_IN_CAPTURE or Path(name).is_dir():
        return Path(name)
    capture_folder = folder / BUILT_IN_CAPTURE
    if not capture_folder.is_dir():
        with TerminalProgress(quiet=False) as progress:
            write_synthetic_capture(
                capture_folder,
                SynthOptions(),
                lambda done, total: progress.advance("synth", done, total),
            )
    return capture_folder


def encode_if_missing(job: Job, folder: Path) -> bytes:
    """Return the bytes of a stream; encode the stream into `folder` if it does not exist.

    Raises:
        ResumeError: The partial stream of an earlier run was made from different inputs.
    """
    path = folder / job.file_name()
    if not path.is_file():
        write_status(f"encoding {path.name}")
        capture = open_capture(job.capture, CaptureOptions(job.downscale, job.held_out))
        partial_path = path.with_name(path.name + ".part")
        with TerminalProgress(quiet=False) as progress:
            options = EncodeOptions(job.make_config(), job.frames, progress=progress)
            try:
                encode_file(capture, partial_path, options)
            except ResumeError as error:
                message = f"{error}; remove {partial_path} to start from the beginning"
                raise ResumeError(message) from error
        os.replace(partial_path, path)
    return path.read_bytes()


def list_differences(job: Job, metadata: dict[str, str]) -> list[str]:
    """Return the names of the settings whose values in an existing stream differ from the job.

    Args:
        job: Requested stream.
        metadata: Metadata of the existing stream, including its settings that differ from defaults.
    """
    if "settings" not in metadata:
        return []
    stored_settings = dict(_SETTING_PATTERN.findall(metadata["settings"]))
    defaults = dict(list_settings(EncoderConfig()))
    requested_settings = {name: str(value) for name, value in list_settings(job.make_config())}
    return sorted(
        name
        for name, value in requested_settings.items()
        if stored_settings.get(name, str(defaults[name])) != value
    )
