"""The streams for the rate tables, and their folder, from which a run resumes."""

import hashlib
import os
import re
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.cli.output import TerminalProgress
from quarc_ref.datasets.open_capture import CaptureOptions, open_capture
from quarc_ref.encoder import EncodeOptions
from quarc_ref.encoder.settings.config import EncoderConfig
from quarc_ref.encoder.settings.presets import change_setting, choose_preset, list_settings
from quarc_ref.encoder.stream_file import encode_file
from quarc_ref.format.errors import ResumeError
from quarc_ref.synth import SynthOptions, write_synthetic_capture
from studies import write_status

BUILT_IN = "synth"
_LONGEST_NAME = 180
_DIGEST_LENGTH = 12
_SETTING = re.compile(r"(\S+?)=(.*?)(?= \S+=|$)")


@dataclass(frozen=True, slots=True)
class Job:
    """A stream to encode or load.

    Attributes:
        capture: Folder of the capture.
        preset: Name of the settings.
        changes: Settings that differ from the preset: path and value.
        frames: Number of frames from the first; None for all.
        downscale: Factor by which pictures are downscaled.
        held_out: Names of held-out cameras; empty for the first.
    """

    capture: Path
    preset: str
    changes: tuple[tuple[str, str], ...] = ()
    frames: int | None = None
    downscale: int = 1
    held_out: tuple[str, ...] = ()

    def file_name(self) -> str:
        """Return a unique name for this stream in the folder.

        A long one ends in a digest, because file systems allow at most 255 bytes.
        """
        parts = [self.capture.resolve().name, self.preset]
        parts += [f"{name}={value}" for name, value in self.changes]
        if self.frames is not None:
            parts.append(f"frames={self.frames}")
        if self.downscale != 1:
            parts.append(f"downscale={self.downscale}")
        if self.held_out:
            parts.append(f"without={'+'.join(self.held_out)}")
        name = ".".join(parts)
        if len(name) > _LONGEST_NAME:
            digest = hashlib.sha256(name.encode()).hexdigest()[:_DIGEST_LENGTH]
            name = f"{name[: _LONGEST_NAME - _DIGEST_LENGTH - 1]}-{digest}"
        return f"{name}.quarc"

    def config(self) -> EncoderConfig:
        """Return the settings of the encode.

        Raises:
            SettingError: A preset or setting does not exist, or a value is invalid.
        """
        config = choose_preset(self.preset)
        for name, value in self.changes:
            config = change_setting(config, name, value)
        return config


def trace_capture_if_missing(name: str, folder: Path) -> Path:
    """Return the folder of a capture; the built-in one is traced into `folder` first."""
    if name != BUILT_IN or Path(name).is_dir():
        return Path(name)
    target = folder / BUILT_IN
    if not target.is_dir():
        with TerminalProgress(quiet=False) as progress:
            write_synthetic_capture(
                target, SynthOptions(), lambda done, total: progress.advance("synth", done, total)
            )
    return target


def encode_if_missing(job: Job, folder: Path) -> bytes:
    """Return a stream, encoded into `folder` if it does not exist.

    Raises:
        ResumeError: A partial stream of an earlier run has other inputs.
    """
    path = folder / job.file_name()
    if not path.is_file():
        write_status(f"encoding {path.name}")
        capture = open_capture(job.capture, CaptureOptions(job.downscale, job.held_out))
        part = path.with_name(path.name + ".part")
        with TerminalProgress(quiet=False) as progress:
            options = EncodeOptions(job.config(), job.frames, progress=progress)
            try:
                encode_file(capture, part, options)
            except ResumeError as error:
                message = f"{error}; remove {part} to begin anew"
                raise ResumeError(message) from error
        os.replace(part, path)
    return path.read_bytes()


def list_differences(job: Job, metadata: dict[str, str]) -> list[str]:
    """Return the settings in which an existing stream differs from those requested.

    Args:
        job: Requested stream.
        metadata: Metadata of the stream, which lists the settings that are not the default.
    """
    if "settings" not in metadata:
        return []
    said = dict(_SETTING.findall(metadata["settings"]))
    defaults = dict(list_settings(EncoderConfig()))
    asked = {name: str(value) for name, value in list_settings(job.config())}
    return sorted(
        name for name, value in asked.items() if said.get(name, str(defaults[name])) != value
    )
