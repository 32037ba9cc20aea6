"""What is encoded: captures on disk and traced ones, and which of their cameras are held out."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from quarc_ref.synth import SynthOptions, write_synthetic_capture
from quarc_ref.synth.variants import VARIANTS
from studies import note

TRACED = (*VARIANTS, "playroom-4", "playroom-8", "playroom-30", "playroom-640x480")
_FILM_FRAMES = 40  # also where frame 0 alone is encoded: they tell what moves
_HELD_OUT_SETS = 4
_LEAST_CAMERAS = 4  # three to hold out and one to train with
_TRACED_NAME = re.compile(
    rf"(?P<variant>{'|'.join(VARIANTS)})(-(?P<cameras>\d+))?(-(?P<width>\d+)x(?P<height>\d+))?"
)

HeldOut = tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Subject:
    """A capture of the study.

    Attributes:
        name: Tells it from the others.
        folder: Where it is.
        held_out_sets: Names of the cameras that are held out together, a tuple to each set.
    """

    name: str
    folder: Path
    held_out_sets: tuple[HeldOut, ...]


def rotate_held_out(cameras: Sequence[str]) -> tuple[HeldOut, ...]:
    """Return four sets of three cameras that are a third of the rig apart.

    Args:
        cameras: Their names.

    Raises:
        ValueError: There are too few cameras to train with.
    """
    names, count = sorted(cameras), len(cameras)
    if count < _LEAST_CAMERAS:
        message = (
            f"{count} cameras are too few to hold three out; at least {_LEAST_CAMERAS} are needed"
        )
        raise ValueError(message)
    return tuple(
        tuple(names[(2 * k + 1 + j * (count // 3)) % count] for j in range(3))
        for k in range(_HELD_OUT_SETS)
    )


def parse_traced(name: str) -> SynthOptions:
    """Return the options of a traced capture.

    Args:
        name: `VARIANT`, `VARIANT-CAMERAS` or `VARIANT-WIDTHxHEIGHT`, or both after each
            other; the held-out camera is counted as well.

    Raises:
        ValueError: There is no such variant, or it cannot be traced so.
    """
    match = _TRACED_NAME.fullmatch(name)
    if match is None:
        message = (
            f"{name!r} is not a traced capture: it takes VARIANT[-CAMERAS][-WIDTHxHEIGHT], "
            f"where VARIANT is one of {', '.join(VARIANTS)}"
        )
        raise ValueError(message)
    sizes = {key: int(text) for key, text in match.groupdict().items() if text and text.isdigit()}
    if "cameras" in sizes:
        sizes["cameras"] -= 1  # the held-out one
    return SynthOptions(variant=match["variant"], frames=_FILM_FRAMES, **sizes)


def provide_traced(name: str, folder: Path) -> Subject:
    """Return a traced capture, traced into a folder unless it is there.

    Args:
        name: As for `parse_traced`.
        folder: Of all traced captures.

    Raises:
        ValueError: There is no such variant, or it cannot be traced so.
    """
    options, target = parse_traced(name), folder / name
    if not target.is_dir():
        note(f"tracing {name}")
        write_synthetic_capture(target, options)
    return Subject(name, target, (("cam00",),))
