"""Encodes Gaussians of other methods with bounded errors, without pictures and training.

frame 0 ──> canonical frame
frame t ──> match with t - 1 ──> deaths ──> fit_motion ──> fit_updates ──> fit_births ──> verify

A frame in which more than half of the Gaussians are new becomes a canonical frame.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import chain, islice, pairwise
from typing import BinaryIO

import numpy as np

from quarc_ref import __version__
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.fit_births import fit_births
from quarc_ref.encoder.scenes.fit_motion import Tolerances, fit_motion
from quarc_ref.encoder.scenes.fit_updates import (
    CodeErrorBounds,
    bound_codes,
    find_recolored,
    fit_updates,
)
from quarc_ref.encoder.scenes.matching import Match, match_ids, match_order
from quarc_ref.encoder.scenes.steps import choose_steps
from quarc_ref.encoder.scenes.targets import Target, make_target
from quarc_ref.encoder.scenes.verify import Errors, measure_errors, require_bounds
from quarc_ref.format.arrays import Bits, Int64
from quarc_ref.format.cameras import Camera
from quarc_ref.format.coding.gaussian_planes import order_canonical
from quarc_ref.format.constants import LEVELS
from quarc_ref.format.errors import EncodeError, StateError
from quarc_ref.format.records import OPACITY, StreamHeader
from quarc_ref.format.updates import Updates


@dataclass(frozen=True, slots=True, eq=False)
class GivenFrame:
    """A frame of Gaussians from another program.

    Attributes:
        splats: Gaussians in the form of 3DGS; SH of degree 0 to 3, of which a stream
            keeps up to degree 1.
        ids: `[N]` identities of the Gaussians across frames; None to match by order.
    """

    splats: Splats
    ids: Int64 | None = None


@dataclass(frozen=True, slots=True)
class SceneOptions:
    """Options for encoding given Gaussians.

    Attributes:
        bounds: Allowed errors.
        frames_per_second: Frame rate.
        keyframe_interval: Number of frames between canonical frames; 0 for as few
            canonical frames as possible.
        cameras: Cameras to store in the stream, which are not used for encoding.
        metadata: Metadata of the stream besides `encoder` and `bounds`.
        header: Header with the values that do not depend on the Gaussians: axes, scale,
            seed, anchors.
        progress: Called after every frame.
        frame_count: Number of frames, for the progress; 0 if unknown.
    """

    bounds: Bounds = field(default_factory=Bounds)
    frames_per_second: float = 30.0
    keyframe_interval: int = 0
    cameras: tuple[Camera, ...] = ()
    metadata: dict[str, str] = field(default_factory=dict)
    header: StreamHeader = field(
        default_factory=lambda: StreamHeader(
            updates=True, gaussians_per_anchor=4, resample_interval=1
        )
    )
    progress: Progress = field(default_factory=NullProgress)
    frame_count: int = 0


@dataclass(frozen=True, slots=True)
class SceneReport:
    """Result of encoding given Gaussians.

    Attributes:
        frames: Number of frames written.
        bounds: Allowed errors.
        errors: Largest errors over all decoded frames.
        dropped_sh_degree: Highest SH degree that was dropped; 0 for none.
    """

    frames: int
    bounds: Bounds
    errors: Errors
    dropped_sh_degree: int


def encode_scenes(
    scenes: Iterable[Splats | GivenFrame], sink: BinaryIO, options: SceneOptions | None = None
) -> SceneReport:
    """Encode given Gaussians into a stream of format 1.1.

    Every frame is decoded and compared with the input, so the reported errors are those
    of the decoder's output.

    Args:
        scenes: Frames in order, which are read one by one, three in advance.
        sink: Binary file to which the stream is appended.
        options: Bounds, and properties of the stream.

    Raises:
        EncodeError: The Gaussians cannot be represented within the bounds.
    """
    options = options or SceneOptions()
    given = map(_wrap, scenes)
    ahead = list(islice(given, _AHEAD))
    if not ahead:
        message = "there are no frames"
        raise EncodeError(message)
    encoding = _Encoding(sink, options, ahead)
    for frame in chain(ahead, given):
        encoding.add(frame)
    return encoding.finish()


def _wrap(scene: Splats | GivenFrame) -> GivenFrame:
    return GivenFrame(scene) if isinstance(scene, Splats) else scene


class _Encoding:
    """A stream that is being written.

    Args:
        sink: Binary file to which the stream is appended.
        options: Options of `encode_scenes`.
        ahead: The first frames, which determine the quantization steps.
    """

    def __init__(self, sink: BinaryIO, options: SceneOptions, ahead: list[GivenFrame]) -> None:
        self._options = options
        self._bounds = bounds = options.bounds.resolved(ahead[0].splats)
        self._header = _make_header(options, bounds, ahead)
        added = {"encoder": f"quarc-ref {__version__}", "bounds": str(bounds)}
        metadata = {**options.metadata, **added}
        self._loop = ClosedLoop(sink, self._header, options.cameras, metadata)
        self._errors = Errors()
        self._count = 0
        self._last = ahead[0]
        # rows of the last frame for the Gaussians of the state
        self._rows = np.zeros(0, dtype=np.int64)
        self._dropped = 0
        scale = self._header.translation_step * 2.0**-self._header.lattice_exponent
        turn = self._header.rotation_unity * self._header.level_count / 2
        self._tolerances = Tolerances(bounds.position / scale, bounds.rotation * turn)

    def add(self, given: GivenFrame) -> None:
        """Write a frame."""
        frame, self._count = self._count, self._count + 1
        try:
            target = make_target(given.splats, self._header, self._bounds)
            self._write(frame, given, target)
        except EncodeError as error:
            message = f"frame {frame}: {error}"
            raise EncodeError(message) from error
        self._last = given
        degree = round(given.splats.sh.shape[1] ** 0.5) - 1
        self._dropped = max(self._dropped, degree if degree > 1 else 0)
        errors = measure_errors(self._loop.state.scene, target, self._rows)
        require_bounds(errors, self._bounds, frame)
        self._errors = self._errors.joined(errors)
        self._options.progress.advance("frames", self._count, self._options.frame_count)

    def finish(self) -> SceneReport:
        """Write the end of the stream."""
        self._loop.finish()
        return SceneReport(self._count, self._bounds, self._errors, self._dropped)

    def _write(self, frame: int, given: GivenFrame, target: Target) -> None:
        interval = self._options.keyframe_interval
        if frame == 0 or (interval and frame % interval == 0):
            self._write_canonical(frame, target)
            return
        match = match_frames(self._last, given)
        successors = np.full(len(self._last.splats.positions), -1, dtype=np.int64)
        successors[match.before] = match.after
        rows = successors[self._rows]
        rows[find_recolored(self._loop.state, target, rows, self._code_bounds)] = -1
        new = target.count - np.count_nonzero(rows >= 0)
        if new > min(target.count // 2, self._header.limits.births):
            self._write_canonical(frame, target)
        else:
            self._write_frame(target, rows)

    @property
    def _code_bounds(self) -> CodeErrorBounds:
        return bound_codes(self._bounds, self._header)

    def _write_canonical(self, frame: int, target: Target) -> None:
        coded = target.coded(np.arange(target.count))
        self._rows = order_canonical(coded.positions)
        try:
            self._loop.commit_canonical(coded, frame)
        except StateError as error:
            raise EncodeError(str(error)) from error

    def _write_frame(self, target: Target, rows: Int64) -> None:
        gone = _count_faint_deaths(self._loop.state, rows < 0)
        start = self._loop.start_frame(gone.size)
        rows = np.delete(rows, gone)
        symbols = fit_motion(start.state, target, rows, self._tolerances)
        leaving = np.zeros(0, dtype=np.bool_)

        def update(state: FrameState) -> Updates:
            nonlocal leaving
            updates, leaving = fit_updates(state, target, rows, self._bounds)
            return updates

        moved = self._loop.move_frame(start, symbols, update)
        rows = rows[~leaving]
        is_new = np.ones(target.count, dtype=np.bool_)
        is_new[rows] = False
        births, newborn = fit_births(moved.state, target, np.flatnonzero(is_new))
        self._loop.commit_frame(moved, births)
        self._rows = np.concatenate([rows, newborn])


def match_frames(before: GivenFrame, after: GivenFrame) -> Match:
    """Match the Gaussians of two frames, by ids if both have them."""
    if before.ids is not None and after.ids is not None:
        return match_ids(before.ids, after.ids)
    return match_order(before.splats, after.splats)


def _make_header(options: SceneOptions, bounds: Bounds, ahead: list[GivenFrame]) -> StreamHeader:
    clock = Fraction(options.frames_per_second).limit_denominator(_CLOCK_LIMIT)
    most = _ROOM * max(len(each.splats.positions) for each in ahead)
    fitting = [level for level, limits in LEVELS.items() if most <= limits.gaussians]
    header = replace(
        options.header,
        level=min(fitting, default=max(LEVELS)),
        timescale=clock.numerator,
        frame_ticks=clock.denominator,
        updates=True,
    )
    matches = [match_frames(before, after) for before, after in pairwise(ahead)]
    return choose_steps(header, bounds, [each.splats for each in ahead], matches)


def _count_faint_deaths(state: FrameState, dying: Bits) -> Int64:
    """Return the Gaussians whose deletion needs no bits, because they are the faintest ones."""
    order = np.argsort(state.scene.codes[OPACITY.start], kind="stable")
    stays = np.flatnonzero(~dying[order])
    return order[: stays[0] if stays.size else 0]


_AHEAD = 3
_ROOM = 2  # maximum growth of the number of Gaussians
_CLOCK_LIMIT = 1001
