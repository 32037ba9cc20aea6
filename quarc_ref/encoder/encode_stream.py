"""Encodes multi-view video: frame 0, then each later frame from the decoded previous frame.

points ──> train_canonical ──> commit_canonical ──> state of frame 0
state ──> start_frame ──> fit_motion ──> move_frame ──> fit_births ──> commit_frame ──> state

`fit_motion` also fits updates of individual Gaussians if the stream allows them.
`commit_frame` is replaced by `commit_as_canonical` every `canonical.keyframe_interval` frames,
and by `commit_as_snapshot` every `canonical.snapshot_interval` frames.
"""

import hashlib
import json
from contextlib import AbstractContextManager
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import BinaryIO

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.engine import FrameState
from quarc_ref.decoder.limits import find_max_births
from quarc_ref.encoder.adapt_steps import (
    adapt_steps_to_capture,
    adapt_steps_to_error,
    copy_translation_step,
    should_measure_error,
)
from quarc_ref.encoder.checks.first_frame_check import check_first_frame
from quarc_ref.encoder.checks.target_check import check_target
from quarc_ref.encoder.checks.view_watch import ViewWatch
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.description import describe_encode
from quarc_ref.encoder.encode_options import EncodeOptions
from quarc_ref.encoder.estimate import estimate_encode
from quarc_ref.encoder.frame_coder import MovedFrame
from quarc_ref.encoder.frame_errors import name_frame_in_errors
from quarc_ref.encoder.frames.birth_selection import ByteCost
from quarc_ref.encoder.frames.births import count_deaths, fit_births
from quarc_ref.encoder.frames.motion import fit_motion
from quarc_ref.encoder.frames.rate_control import RateDistortion, choose_rd_factor
from quarc_ref.encoder.monitoring.monitor import EncodePlan, FrameWritten
from quarc_ref.encoder.resume.checkpoint import Checkpoint
from quarc_ref.encoder.resume.continue_stream import continue_stream
from quarc_ref.encoder.resume.partial_stream import PartialStream, require_frames, require_match
from quarc_ref.encoder.settings.config import EncoderConfig, limit_gaussians, make_header
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.canonical_objective import CanonicalObjective
from quarc_ref.encoder.training.context import Observers, make_context
from quarc_ref.encoder.training.measurements import (
    follow_exposures,
    measure_error,
    measure_loss,
    refit_exposures,
)
from quarc_ref.encoder.training.quantize import drop_unrepresentable, quantize_gaussians
from quarc_ref.encoder.training.torch_settings import fixed_torch_settings
from quarc_ref.files import sync_file
from quarc_ref.format import container, wire
from quarc_ref.format.records import Births

_KIND_NAMES = {container.CANO: "canonical", container.SNAP: "snapshot", container.FRAM: "moved"}


def encode(
    capture: Capture,
    sink: BinaryIO,
    options: EncodeOptions | None = None,
    partial_stream: PartialStream | None = None,
) -> None:
    """Encode a capture into a stream.

    Args:
        capture: Multi-view video; held-out cameras are not read.
        sink: Binary file to which the stream is appended, one complete frame at a time.
        options: Options of the encode; None for the defaults.
        partial_stream: The part of the stream that the sink already contains, at least one frame;
            None for a new stream. The sink must be open for reading and writing. Bytes after the
            partial stream are replaced, and the encode continues. The finished stream is identical
            to that of an uninterrupted encode. A partial stream that is already finished is not
            changed.

    Raises:
        CaptureError: A picture cannot be read, or the capture has fewer frames than requested
            (`TooFewFramesError`).
        UnusableCaptureError: A check of the capture failed.
        EncodeError: The format cannot represent the scene with these settings.
        ResumeError: The partial stream was encoded from different inputs or settings.
    """
    options = options or EncodeOptions()
    with fixed_torch_settings():
        if partial_stream is None:
            options.check(capture)
            encoding = _Encoding(capture, options)
            encoding.announce()
            with encoding.name_next_frame_in_errors():
                encoding.add_first_frame(sink)
        else:
            encoding = _Encoding(capture, options)
            encoding.resume_from(sink, partial_stream)
            if partial_stream.is_finished:
                return
            encoding.announce(partial_stream.end)
        while encoding.next_frame < encoding.frame_count:
            with encoding.name_next_frame_in_errors():
                encoding.add_frame()
        encoding.finish()


class _Encoding:
    """An encode in progress.

    Only the decoder's state, the list of frame sizes, and the exposures and reference loss of
    frame 0 are passed from frame to frame.

    Args:
        capture: Multi-view video; held-out cameras are not read.
        options: Options of the encode.

    Attributes:
        frame_count: Number of frames that the finished stream will have.
        next_frame: Index of the next frame.
    """

    def __init__(self, capture: Capture, options: EncodeOptions) -> None:
        self.frame_count = capture.require_frames(options.frames)
        self.next_frame = 0
        self._capture = capture
        observers = Observers(options.progress, options.monitor)
        self._context = make_context(capture, options.device, options.config.seed, observers)
        self._report = options.report
        config = limit_gaussians(options.config, len(capture.training_at(0)))
        self._config = adapt_steps_to_capture(config, capture)
        self._metadata = describe_encode(capture, options.config, options.device)
        self._checkpoint = self._open_checkpoint(options.checkpoint)
        self._inter_frame_sizes: list[int] = []
        names = [camera.name for camera in self._context.views.cameras]
        self._view_watch = ViewWatch(names, capture.start)

    def announce(self, byte_count: int = 0) -> None:
        """Report the remaining work to the monitor; the stream has `byte_count` bytes so far."""
        config, capture, context = self._config, self._capture, self._context
        plan = EncodePlan(
            capture.name,
            self.frame_count,
            self.next_frame,
            byte_count,
            context.view_count,
            config.canonical.training_steps,
            config.canonical.half_resolution_steps,
            config.motion.iterations,
            config.births.iterations,
        )
        context.observers.monitor.begin(
            plan, lambda: estimate_encode(context, capture.points, plan, config)
        )

    def name_next_frame_in_errors(self) -> AbstractContextManager[None]:
        """Return a context in which the message of an EncodeError names the next frame."""
        return name_frame_in_errors(self._capture.start + self.next_frame, " of the capture")

    def add_first_frame(self, sink: BinaryIO) -> None:
        """Train and write frame 0."""
        config, capture = self._config, self._capture
        header = make_header(config, capture.frames_per_second, config.canonical.max_gaussians)
        objective = CanonicalObjective(config.canonical, header, choose_rd_factor(config, []))
        attributes = train_canonical(self._context, capture.points, objective, self._checkpoint)
        if should_measure_error(config, capture):
            fits_exposures = config.canonical.exposure_lr > 0
            error = measure_error(self._context, attributes, fits_exposures=fits_exposures)
            self._config = adapt_steps_to_error(config, capture, error)
        gaussians = quantize_gaussians(drop_unrepresentable(attributes, header), header)
        self._open(sink, gaussians.count)
        state = self._loop.commit_canonical(gaussians, frame=0)
        self._report_frame(container.CANO, 0, 0)
        self._prepare_inter_frames(state)
        for finding in check_first_frame(self._context, state, attributes.opacities.numel()):
            self._report(finding)

    def resume_from(self, sink: BinaryIO, partial_stream: PartialStream) -> None:
        """Restore the state of the encode by decoding the frames of a partial stream."""
        if should_measure_error(self._config, self._capture):
            self._config = copy_translation_step(self._config, partial_stream.header)
        first_chunk = wire.parse_canonical(partial_stream.frames[0].payload)
        self._open(sink, first_chunk.gaussian_count, partial_stream)
        for chunk in partial_stream.frames:
            if chunk is partial_stream.frames[-1] and self.next_frame > 0:
                # The next frame needs its gains; its errors are compared with those of this one.
                self._view_watch.begin(self._follow_exposures(self.next_frame))
            state = self._loop.replay(chunk)
            if self.next_frame == 0:
                self._prepare_inter_frames(state)
            elif chunk.kind == container.FRAM:
                self._inter_frame_sizes.append(self._loop.frame_bytes)
            self.next_frame = state.scene.frame + 1

    def add_frame(self) -> None:
        """Train and write the next frame."""
        config, context, frame = self._config, self._context, self.next_frame
        context.observers.progress.advance("frames", frame, self.frame_count)
        rd = RateDistortion(choose_rd_factor(config, self._inter_frame_sizes), self._reference_loss)
        death_count = count_deaths(self._loop.state, self._initial_gaussian_count, config.births)
        for finding in self._view_watch.check(self._follow_exposures(frame), frame):
            self._report(finding)
        start = self._loop.start_frame(death_count)
        motion = fit_motion(context, start, config.motion, config.updates, rd)
        moved_frame = self._loop.move_frame(start, motion.symbols, motion.updates)
        cost = ByteCost(
            rd.scale_relative(config.births.rd_lambda) / moved_frame.state.scene.count,
            partial(self._loop.count_birth_bytes, moved_frame),
        )
        config = self._limit_births(moved_frame.state)
        births = fit_births(context, moved_frame.state, motion.statistics, config, cost)
        kind = self._commit(moved_frame, births)
        all_deaths = moved_frame.previous.scene.count - moved_frame.state.scene.count
        self._report_frame(kind, births.newborn.count if births else 0, all_deaths)
        context.views.drop_frames_before(frame + 1)
        self.next_frame = frame + 1

    def _follow_exposures(self, frame: int) -> list[float]:
        """Estimate the exposures of a frame by comparing its pictures with the previous scene.

        Returns:
            The error of each view; none if the exposures are not followed.
        """
        config = self._config
        if config.canonical.exposure_lr and config.motion.follow_exposures:
            return follow_exposures(self._context, self._loop.state, frame)
        return []

    def finish(self) -> None:
        """Write the index and the TAIL chunk, and report a missed target and the end."""
        self._loop.finish()
        for finding in check_target(self._inter_frame_sizes, self._config.target_kb_per_frame):
            self._report(finding)
        self._context.observers.monitor.end()
        self._context.observers.progress.advance("frames", self.frame_count, self.frame_count)

    def _limit_births(self, moved_state: FrameState) -> EncoderConfig:
        """Return settings that allow no more births than the stream's level.

        Gaussians that are not faint stay, so their number can grow from frame to frame.
        """
        scene, births = moved_state.scene, self._config.births
        max_births = min(births.max_births, find_max_births(scene.header, scene.count))
        return replace(self._config, births=replace(births, max_births=max_births))

    def _report_frame(self, kind: bytes, birth_count: int, death_count: int) -> None:
        scene, loop = self._loop.state.scene, self._loop
        self._context.observers.monitor.frame(
            FrameWritten(
                scene.frame,
                _KIND_NAMES[kind],
                loop.frame_bytes,
                loop.byte_count,
                scene.count,
                birth_count,
                death_count,
            )
        )

    def _commit(self, moved_frame: MovedFrame, births: Births | None) -> bytes:
        """Write a frame as CANO, SNAP or FRAM, depending on its index; return the chunk type."""
        kind = self._config.canonical.frame_kind(moved_frame.state.scene.frame)
        if kind == container.CANO:
            self._loop.commit_as_canonical(moved_frame, births)
        elif kind == container.SNAP:
            self._loop.commit_as_snapshot(
                moved_frame, births, self._config.canonical.snapshot_dead_zone
            )
        else:
            self._loop.commit_frame(moved_frame, births)
            self._inter_frame_sizes.append(self._loop.frame_bytes)
        return kind

    def _open(
        self,
        sink: BinaryIO,
        initial_gaussian_count: int,
        partial_stream: PartialStream | None = None,
    ) -> None:
        """Create the closed loop, whose header depends on the number of Gaussians in frame 0."""
        capture, self._initial_gaussian_count = self._capture, initial_gaussian_count
        self._sink = sink
        header = make_header(self._config, capture.frames_per_second, initial_gaussian_count)
        existing_bytes, metadata = 0, self._metadata
        if partial_stream is not None:
            require_match(partial_stream, header, capture.cameras, metadata)
            require_frames(partial_stream, self.frame_count, self._config.canonical)
            existing_bytes, metadata = partial_stream.end, partial_stream.metadata
            if not partial_stream.is_finished:
                sink = continue_stream(sink, partial_stream)
        self._loop = ClosedLoop(sink, header, capture.cameras, metadata, existing_bytes)

    def _prepare_inter_frames(self, state: FrameState) -> None:
        """Compute the exposures and reference loss for later frames from decoded frame 0."""
        if self._config.canonical.exposure_lr:
            refit_exposures(self._context, state)
        self._reference_loss = measure_loss(self._context, state, self._config.motion.lambda_dssim)
        self.next_frame = 1
        if self._checkpoint is not None:
            sync_file(self._sink)  # otherwise, a power failure could lose both
            self._checkpoint.remove()

    def _open_checkpoint(self, path: Path | None) -> Checkpoint | None:
        """Return the checkpoint for the inputs of this encode, or None if `path` is None."""
        cameras = json.dumps([asdict(camera) for camera in self._capture.cameras])
        identity = {**self._metadata, "cameras": hashlib.sha256(cameras.encode()).hexdigest()}
        return None if path is None else Checkpoint(path, identity)
