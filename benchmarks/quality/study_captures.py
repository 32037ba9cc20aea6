"""The captures of a study, real or ray-traced, and their held-out cameras."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from quarc_ref.synth import SynthOptions, write_synthetic_capture
from quarc_ref.synth.variants import VARIANTS
from studies import write_status

DEFAULT_TRACED_NAMES = (*VARIANTS, "playroom-4", "playroom-8", "playroom-30", "playroom-640x480")
_CAPTURE_FRAMES = 40  # needed even for frame 0 alone, to find the pixels that move
_MAX_HELD_OUT_SETS = 4
_MIN_CAMERAS = 4  # three held-out cameras and one for training
_TRACED_NAME = re.compile(
    rf"(?P<variant>{'|'.join(VARIANTS)})(-(?P<cameras>\d+))?(-(?P<width>\d+)x(?P<height>\d+))?"
)

HeldOut = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class StudyCapture:
    """A capture of the study.

    Attributes:
        name: Unique name of the capture.
        folder: Folder of the capture.
        held_out_sets: Names of the cameras of each held-out set.
    """

    name: str
    folder: Path
    held_out_sets: tuple[HeldOut, ...]


def choose_held_out_sets(cameras: Sequence[str]) -> tuple[HeldOut, ...]:
    """Return up to four different sets of three cameras, which are a third of the rig apart.

    Args:
        cameras: Names of all cameras.

    Raises:
        ValueError: Too few cameras would be left for training.
    """
    names, count = sorted(cameras), len(cameras)
    if count < _MIN_CAMERAS:
        message = (
            f"{count} cameras are too few to hold out three; at least {_MIN_CAMERAS} are needed"
        )
        raise ValueError(message)
    sets_by_members: dict[frozenset[str], HeldOut] = {}  # rigs of 6 and 9 cameras have fewer sets
    for first in (*range(1, count, 2), *range(0, count, 2)):
        held_out = tuple(names[(first + j * (count // 3)) % count] for j in range(3))
        sets_by_members.setdefault(frozenset(held_out), held_out)
    return tuple(sets_by_members.values())[:_MAX_HELD_OUT_SETS]


def parse_traced_name(name: str) -> SynthOptions:
    """Return the options for ray-tracing a capture.

    Args:
        name: Variant of the scene, optionally followed by the number of cameras (including the
            held-out one) and by the picture size: `VARIANT[-CAMERAS][-WIDTHxHEIGHT]`.

    Raises:
        ValueError: The name is malformed, the variant does not exist, or a size is invalid.
    """
    match = _TRACED_NAME.fullmatch(name)
    if match is None:
        message = (
            f"{name!r} is not a traced capture: use VARIANT[-CAMERAS][-WIDTHxHEIGHT], "
            f"where VARIANT is one of {', '.join(VARIANTS)}"
        )
        raise ValueError(message)
    sizes: dict[str, Any] = {
        key: int(text) for key, text in match.groupdict().items() if text and text.isdigit()
    }
    if "cameras" in sizes:
        sizes["cameras"] -= 1  # the held-out one
    return SynthOptions(variant=match["variant"], frames=_CAPTURE_FRAMES, **sizes)


def trace_if_missing(name: str, folder: Path) -> StudyCapture:
    """Return the ray-traced capture with this name; ray-trace it if it does not exist.

    Args:
        name: Name of the capture, in the form that `parse_traced_name` accepts.
        folder: Folder that contains all ray-traced captures.

    Raises:
        ValueError: The name is malformed, the variant does not exist, or a size is invalid.
    """
    options, target = parse_traced_name(name), folder / name
    if not target.is_dir():
        write_status(f"tracing {name}")
        write_synthetic_capture(target, options)
    return StudyCapture(name, target, (("cam00",),))
