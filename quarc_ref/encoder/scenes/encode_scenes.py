"""Encodes Gaussians that another method has trained; all errors are bounded.

frame 0 ──> canonical frame
frame t ──> match with t - 1 ──> deaths ──> fit_motion ──> fit_updates ──> fit_births ──> verify

Frame 0 and every `keyframe_interval`-th frame are canonical frames. Another frame becomes one if
more than half of its Gaussians are new, or more than the conformance level allows, or if one is
too far from all others. The level is chosen from the first frames, and raised if a later frame
needs a higher one.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain, count, islice, pairwise
from typing import BinaryIO, cast

import numpy as np

from quarc_ref import __version__
from quarc_ref.decoder.dequantize import Splats
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.frame_errors import name_frame_in_errors
from quarc_ref.encoder.progress import NullProgress, Progress
from quarc_ref.encoder.scenes.bounds import Bounds
from quarc_ref.encoder.scenes.fit_births import fit_births
from quarc_ref.encoder.scenes.fit_motion import Tolerances, fit_motion
from quarc_ref.encoder.scenes.fit_updates import (
    CodeErrorBounds,
    convert_code_bounds,
    find_faint_deaths,
    find_recolored,
    fit_updates,
)
from quarc_ref.encoder.scenes.level_sink import UNLIMITED_LEVEL, LevelSink, find_level
from quarc_ref.encoder.scenes.matching import match_frames
from quarc_ref.encoder.scenes.steps import choose_steps
from quarc_ref.encoder.scenes.targets import Target, make_target, require_encodable
from quarc_ref.encoder.scenes.verify import Errors, measure_errors, require_bounds
from quarc_ref.format.arrays import Int64
from quarc_ref.format.cameras import Camera
from quarc_ref.format.coding.gaussian_planes import order_canonical
from quarc_ref.format.errors import EncodeError, StateError
from quarc_ref.format.frame_rate import to_clock
from quarc_ref.format.records import StreamHeader
from quarc_ref.format.updates import Updates


@dataclass(frozen=True, slots=True, eq=False)
class GivenFrame:
    """A frame of Gaussians to encode.

    Attributes:
        splats: Gaussians as 3DGS stores them, with SH degree 0 to 3. The stream stores SH only
            up to the degree of the first frame, and at most up to degree 1.
        ids: `[N]` unique ids of the Gaussians in all frames; None: match Gaussians by order.
        cameras: Cameras of the stream from this frame on; None: those of the frame before.
        metadata: Metadata of the stream from this frame on; None: that of the frame before.
    """

    splats: Splats
    ids: Int64 | None = None
    cameras: tuple[Camera, ...] | None = None
    metadata: dict[str, str] | None = None


@dataclass(frozen=True, slots=True)
class SceneOptions:
    """Options of `encode_scenes`.

    Attributes:
        bounds: Allowed errors.
        frames_per_second: Frame rate of the stream.
        keyframe_interval: Interval between canonical frames, in frames; 0: as few canonical
            frames as possible.
        cameras: Cameras to store in the stream; encoding does not use them.
        metadata: Metadata of the stream, to which `encoder` and `bounds` are added.
        header: Header with the axes, scale, seed and anchor fields; the encoder sets the other
            fields.
        progress: Called after every frame.
        frame_count: Total number of frames, for progress reports; 0 if unknown.
        first_frame: Ordinal of the first frame.
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
    first_frame: int = 0


@dataclass(frozen=True, slots=True)
class SceneReport:
    """Result of `encode_scenes`.

    Attributes:
        frames: Number of frames in the stream.
        bounds: Allowed errors.
        errors: Largest errors over all decoded frames.
        dropped_sh_degree: Highest SH degree of the input that was dropped; 0 if none.
        unplanned_keyframes: Number of canonical frames that the options did not ask for, because
            too many Gaussians were new.
    """

    frames: int
    bounds: Bounds
    errors: Errors
    dropped_sh_degree: int
    unplanned_keyframes: int = 0


def encode_scenes(
    scenes: Iterable[Splats | GivenFrame], sink: BinaryIO, options: SceneOptions | None = None
) -> SceneReport:
    """Encode the Gaussians of several frames into a stream of format 1.1.

    Every frame is decoded and compared with the input, so the report contains the errors of
    the decoder's output.

    Args:
        scenes: Frames in order. The first three are read together, later frames one by one.
        sink: Binary file to which the stream is appended. It must be seekable if the number of
            Gaussians more than doubles: HEAD may then be written again, with a higher level.
        options: Error bounds and properties of the stream; None for the defaults.

    Raises:
        EncodeError: An array has the wrong shape, ids are repeated, the bounds cannot be met, or a
            frame needs a higher level, but the sink is not seekable.
        ValueError: The frame rate, the keyframe interval or the first frame is out of range.
    """
    options = options or SceneOptions()
    if options.keyframe_interval < 0 or not 0 <= options.first_frame < 1 << 32:
        message = (
            f"the keyframe interval ({options.keyframe_interval}) must be at least 0, and the "
            f"first frame ({options.first_frame}) from 0 to 2^32 - 1"
        )
        raise ValueError(message)
    frames = map(_to_checked_frame, scenes, count(options.first_frame))
    first_frames = list(islice(frames, _LOOKAHEAD_FRAMES))
    if not first_frames:
        message = "there are no frames to encode"
        raise EncodeError(message)
    encoding = _Encoding(sink, options, first_frames)
    for frame in chain(first_frames, frames):
        encoding.add(frame)
    return encoding.finish()


def _to_checked_frame(scene: Splats | GivenFrame, ordinal: int) -> GivenFrame:
    frame = GivenFrame(scene) if isinstance(scene, Splats) else scene
    with name_frame_in_errors(ordinal):
        require_encodable(frame.splats, frame.ids)
    return frame


class _Encoding:
    """An encode in progress, which receives the frames one by one.

    Args:
        sink: Binary file to which the stream is appended.
        options: Options of `encode_scenes`.
        first_frames: The first frames, which determine the quantization steps.
    """

    def __init__(
        self, sink: BinaryIO, options: SceneOptions, first_frames: list[GivenFrame]
    ) -> None:
        self._options = options
        self._bounds = bounds = options.bounds.resolved(first_frames[0].splats)
        self._header = _make_header(options, bounds, first_frames)
        self._encoder_metadata = {"encoder": f"quarc-ref {__version__}", "bounds": str(bounds)}
        self._cameras = options.cameras
        self._metadata = {**options.metadata, **self._encoder_metadata}
        self._sink = LevelSink(sink, self._header)
        self._loop = ClosedLoop(
            cast("BinaryIO", self._sink),  # the loop only writes and flushes
            replace(self._header, level=UNLIMITED_LEVEL),
            self._cameras,
            self._metadata,
        )
        self._errors = Errors()
        self._frame_count = 0
        self._last_frame = first_frames[0]
        # `[N]` row of the last input frame for each Gaussian of the decoder's state
        self._target_rows = np.zeros(0, dtype=np.int64)
        self._dropped_sh_degree = 0
        self._canonical_count = 0
        step_size = self._header.translation_step * 2.0**-self._header.lattice_exponent
        steps_per_radian = self._header.rotation_unity * self._header.level_count / 2
        self._tolerances = Tolerances(
            bounds.position / step_size, bounds.rotation * steps_per_radian
        )

    def add(self, frame: GivenFrame) -> None:
        """Encode and write a frame, and check its errors."""
        ordinal = self._options.first_frame + self._frame_count
        self._frame_count += 1
        with name_frame_in_errors(ordinal):
            target = make_target(frame.splats, self._header, self._bounds)
            self._sink.require_gaussians(target.count)
            self._write_side_data(frame)
            self._write_with_chosen_type(ordinal, frame, target)
        self._last_frame = frame
        sh_degree = round(frame.splats.sh.shape[1] ** 0.5) - 1
        if sh_degree > self._header.sh_degree:
            self._dropped_sh_degree = max(self._dropped_sh_degree, sh_degree)
        errors = measure_errors(self._loop.state.scene, target, self._target_rows)
        require_bounds(errors, self._bounds, ordinal)
        self._errors = self._errors.maximum(errors)
        self._options.progress.advance("frames", self._frame_count, self._options.frame_count)

    def finish(self) -> SceneReport:
        """Write the index and the TAIL chunk; return the report."""
        self._loop.finish()
        interval = self._options.keyframe_interval or self._frame_count
        planned_count = len(range(0, self._frame_count, interval))
        counts = self._dropped_sh_degree, self._canonical_count - planned_count
        return SceneReport(self._frame_count, self._bounds, self._errors, *counts)

    def _write_side_data(self, frame: GivenFrame) -> None:
        """Write the cameras and the metadata of a frame if they differ from the last ones."""
        if frame.cameras is not None and frame.cameras != self._cameras:
            self._cameras = frame.cameras
            self._loop.write_cameras(frame.cameras)
        if frame.metadata is not None:
            metadata = {**frame.metadata, **self._encoder_metadata}
            if metadata != self._metadata:
                self._metadata = metadata
                self._loop.write_metadata(metadata)

    def _write_with_chosen_type(self, ordinal: int, frame: GivenFrame, target: Target) -> None:
        index, interval = ordinal - self._options.first_frame, self._options.keyframe_interval
        if index == 0 or (interval and index % interval == 0):
            self._write_canonical(ordinal, target)
            return
        match = match_frames(self._last_frame, frame)
        successors = np.full(len(self._last_frame.splats.positions), -1, dtype=np.int64)
        successors[match.first_rows] = match.second_rows
        rows = successors[self._target_rows]
        rows[find_recolored(self._loop.state, target, rows, self._code_bounds)] = -1
        new_count = target.count - np.count_nonzero(rows >= 0)
        if new_count > min(target.count // 2, self._sink.limits.births):
            self._write_canonical(ordinal, target)
        else:
            self._write_frame(ordinal, target, rows)

    @property
    def _code_bounds(self) -> CodeErrorBounds:
        return convert_code_bounds(self._bounds, self._header)

    def _write_canonical(self, frame: int, target: Target) -> None:
        self._canonical_count += 1
        gaussians = target.quantized(np.arange(target.count))
        self._target_rows = order_canonical(gaussians.positions)
        try:
            self._loop.commit_canonical(gaussians, frame)
        except StateError as error:
            raise EncodeError(str(error)) from error

    def _write_frame(self, ordinal: int, target: Target, rows: Int64) -> None:
        faint_deaths = find_faint_deaths(self._loop.state, rows < 0)
        start = self._loop.start_frame(faint_deaths.size)
        rows = np.delete(rows, faint_deaths)
        symbols = fit_motion(start.state, target, rows, self._tolerances)
        is_deleted = np.zeros(0, dtype=np.bool_)

        def fit_after_motion(state: FrameState) -> Updates | None:
            nonlocal is_deleted
            updates, is_deleted = fit_updates(state, target, rows, self._bounds)
            return None if is_deleted.all() else updates  # a frame keeps at least one Gaussian

        moved_frame = self._loop.move_frame(start, symbols, fit_after_motion)
        rows = rows[~is_deleted]
        is_new = np.ones(target.count, dtype=np.bool_)
        is_new[rows] = False
        new_rows = np.flatnonzero(is_new)
        # updates deleted Gaussians to replace them by births
        if is_deleted.all() or new_rows.size > self._sink.limits.births:
            self._write_canonical(ordinal, target)
            return
        try:
            births, birth_rows = fit_births(moved_frame.state, target, new_rows)
        except EncodeError:  # a new Gaussian is too far from all others
            self._write_canonical(ordinal, target)
            return
        self._loop.commit_frame(moved_frame, births)
        self._target_rows = np.concatenate([rows, birth_rows])


def _make_header(
    options: SceneOptions, bounds: Bounds, first_frames: list[GivenFrame]
) -> StreamHeader:
    timescale, frame_ticks = to_clock(options.frames_per_second)
    max_gaussians = _MAX_GROWTH_FACTOR * max(len(frame.splats.positions) for frame in first_frames)
    header = replace(
        options.header,
        level=find_level(max_gaussians),
        timescale=timescale,
        frame_ticks=frame_ticks,
        updates=True,
    )
    matches = [match_frames(previous, current) for previous, current in pairwise(first_frames)]
    splats = [frame.splats for frame in first_frames]
    return choose_steps(header, bounds, splats, matches, options.first_frame)


_LOOKAHEAD_FRAMES = 3
# Number of Gaussians that the first level allows, relative to that of the first frames: most
# streams then need no higher level.
_MAX_GROWTH_FACTOR = 2
