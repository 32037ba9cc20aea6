"""Multi-view video to a stream: frame 0, then every frame from the decoded one before.

points ──> train_canonical ──> commit_canonical ──> state of frame 0
state ──> begin_frame ──> fit_motion ──> commit_motion
                                             │
          state of the next frame <── commit_births <── fit_births

In a stream with updates `fit_motion` fits them too, and `commit_motion` writes them. Every
`canonical.keyframe_interval` frames `commit_frame_as_canonical` replaces `commit_births`; every
`canonical.snapshot_interval` frames `commit_frame_as_snapshot` does.
"""

from dataclasses import asdict, replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from quarc_ref.datasets.capture import Capture
from quarc_ref.decoder.engine import FrameState
from quarc_ref.encoder.checks.first_frame_check import check_first_frame
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.description import describe_encode
from quarc_ref.encoder.encode_options import EncodeOptions
from quarc_ref.encoder.estimate import estimate_encode
from quarc_ref.encoder.frames.births import fit_births
from quarc_ref.encoder.frames.motion import fit_motion
from quarc_ref.encoder.frames.rate_control import price_bytes
from quarc_ref.encoder.monitoring.monitor import EncodePlan, FrameWritten
from quarc_ref.encoder.resume.checkpoint import Checkpoint
from quarc_ref.encoder.resume.partial_stream import PartialStream, require_frames, require_match
from quarc_ref.encoder.settings.config import EncoderConfig, make_header
from quarc_ref.encoder.settings.frames import BirthSettings
from quarc_ref.encoder.steps import propose_steps
from quarc_ref.encoder.training.canonical import train_canonical
from quarc_ref.encoder.training.context import TrainingContext
from quarc_ref.encoder.training.exposure import Exposures
from quarc_ref.encoder.training.first_frame import measure_loss, refit_exposures
from quarc_ref.encoder.training.quantize import drop_unrepresentable, quantize_gaussians
from quarc_ref.encoder.training.threads import fixed_threads
from quarc_ref.encoder.training.views import TrainingViews, measure_extent
from quarc_ref.format import container, wire
from quarc_ref.format.records import OPACITY
from quarc_ref.rendering.backends import choose_device, choose_rasterizer

_KINDS = {container.CANO: "canonical", container.SNAP: "snapshot", container.FRAM: "moved"}


def encode(
    capture: Capture,
    sink: BinaryIO,
    options: EncodeOptions | None = None,
    begun: PartialStream | None = None,
) -> None:
    """Encode a capture into a stream.

    Args:
        capture: Multi-view video; its held-out cameras are not looked at.
        sink: Is written to by appending; every frame is whole when the next begins.
        options: Settings.
        begun: What the sink holds of the stream already. What follows it is
            cut off, and the stream gone on with as if there had been no break;
            one that is finished is left as it is.

    Raises:
        CaptureError: A picture cannot be read, or the capture has not as many
            frames (`TooFewFramesError`).
        UnusableCaptureError: No picture can come of the capture, and it is checked.
        EncodeError: The scene cannot be written with these settings.
        ResumeError: What the sink holds was begun otherwise.
    """
    options = options or EncodeOptions()
    with fixed_threads():
        if begun is None:
            options.check(capture)
        encoding = _Encoding(capture, options)
        if begun is None:
            encoding.announce()
            encoding.begin(sink)
        else:
            encoding.resume_from(sink, begun)
        if begun is None or not begun.is_finished:
            if begun is not None:
                encoding.announce(begun.end)
            while encoding.next_frame < encoding.frame_count:
                encoding.add_frame()
            encoding.finish()


class _Encoding:
    """A stream in the making.

    All that changes from frame to frame is the state, which the decoder has
    too, and the sizes of the frames.

    Args:
        capture: As given to `encode`.
        options: Settings.

    Attributes:
        frame_count: How many frames the stream is to have.
        next_frame: The frame that comes next.
    """

    def __init__(self, capture: Capture, options: EncodeOptions) -> None:
        self.frame_count = capture.require_frames(options.frames)
        self.next_frame = 0
        self._capture = capture
        self._context = _make_context(capture, options)
        self._report = options.report
        self._config = adapt_steps_to_capture(options.config, capture)
        self._metadata = describe_encode(capture, options.config, options.device)
        self._checkpoint = self._open_checkpoint(options.checkpoint)
        self._sizes: list[int] = []

    def announce(self, byte_count: int = 0) -> None:
        """Tell the monitor what there is to do, after so many bytes of the stream."""
        config, capture, context = self._config, self._capture, self._context
        plan = EncodePlan(
            capture.name,
            self.frame_count,
            self.next_frame,
            byte_count,
            len(context.views.cameras),
            config.canonical.iterations,
            config.motion.iterations,
            config.births.iterations,
        )
        context.monitor.begin(plan, lambda: estimate_encode(context, capture.points, plan, config))

    def begin(self, sink: BinaryIO) -> None:
        """Train and write frame 0."""
        config, capture = self._config, self._capture
        header = make_header(config, capture.frames_per_second, config.canonical.max_gaussians)
        priced = price_bytes(config, []).canonical
        attributes = train_canonical(
            self._context, capture.points, priced, header, self._checkpoint
        )
        gaussians = quantize_gaussians(drop_unrepresentable(attributes, header), header)
        self._open(sink, gaussians.count)
        state = self._loop.commit_canonical(gaussians, frame=0)
        self._report_frame(container.CANO, 0, 0)
        self._settle(state)
        for finding in check_first_frame(self._context, state):
            self._report(finding)

    def resume_from(self, sink: BinaryIO, begun: PartialStream) -> None:
        """Take the frames that were written before."""
        first_count = wire.parse_canonical(begun.frames[0].payload).gaussian_count
        self._open(sink, first_count, begun)
        for chunk in begun.frames:
            state = self._loop.replay(chunk)
            if self.next_frame == 0:
                self._settle(state)
            elif chunk.kind == container.FRAM:
                self._sizes.append(self._loop.frame_bytes)
            self.next_frame = state.scene.frame + 1

    def add_frame(self) -> None:
        """Train and write the next frame."""
        config, frame, state = self._config, self.next_frame, self._loop.state
        self._context.progress.advance("frames", frame, self.frame_count)
        deaths = count_deaths(state, self._first_count, config.births)
        begun = self._loop.begin_frame(deaths)
        priced = price_bytes(config, self._sizes, self._reference_loss)
        motion = fit_motion(self._context, state, begun, priced.motion, priced.updates)
        moved = self._loop.commit_motion(motion.symbols, motion.updates)
        births = fit_births(
            self._context, moved, motion.statistics, priced, self._loop.count_birth_bytes
        )
        kind = config.canonical.kind_due(frame)
        if kind == container.CANO:
            self._loop.commit_frame_as_canonical(births)
        elif kind == container.SNAP:
            self._loop.commit_frame_as_snapshot(births)
        else:
            self._loop.commit_births(births)
            self._sizes.append(self._loop.frame_bytes)
        self._report_frame(kind, births.newborn.count if births else 0, deaths)
        self._context.views.drop_before(frame)
        self.next_frame = frame + 1

    def finish(self) -> None:
        """Write the end of the stream."""
        self._loop.finish()
        self._context.monitor.end()
        self._context.progress.advance("frames", self.frame_count, self.frame_count)

    def _report_frame(self, kind: bytes, births: int, deaths: int) -> None:
        scene, loop = self._loop.state.scene, self._loop
        self._context.monitor.frame(
            FrameWritten(
                scene.frame,
                _KINDS[kind],
                loop.frame_bytes,
                loop.byte_count,
                scene.count,
                births,
                deaths,
            )
        )

    def _open(self, sink: BinaryIO, first_count: int, begun: PartialStream | None = None) -> None:
        """Begin to write, or to go on, now that the Gaussians of frame 0 are counted."""
        capture, self._first_count = self._capture, first_count
        header = make_header(self._config, capture.frames_per_second, first_count)
        held, metadata = 0, self._metadata
        if begun is not None:
            require_match(begun, header, capture.cameras, self._metadata)
            require_frames(begun, self.frame_count, self._config.canonical)
            held, metadata = begun.end, begun.metadata
            if not begun.is_finished:
                sink.truncate(sink.seek(held))
        self._loop = ClosedLoop(sink, header, capture.cameras, metadata, held)

    def _settle(self, state: FrameState) -> None:
        """Go over to what every later frame starts from, of which frame 0 is the first."""
        if self._config.canonical.exposure_lr:
            refit_exposures(self._context, state)
        self._reference_loss = measure_loss(self._context, state, self._config.motion.lambda_dssim)
        self.next_frame = 1
        if self._checkpoint is not None:
            self._checkpoint.remove()

    def _open_checkpoint(self, path: Path | None) -> Checkpoint | None:
        """Return the checkpoint of what is encoded here, and of nothing else."""
        cameras = [asdict(camera) for camera in self._capture.cameras]
        return None if path is None else Checkpoint(path, [self._metadata, cameras])


def adapt_steps_to_capture(config: EncoderConfig, capture: Capture) -> EncoderConfig:
    """Return settings whose stream has the steps that suit the capture's training views.

    They are those of the whole capture, so that segments of it can be joined.

    Raises:
        CaptureError: A picture cannot be read.
        EncodeError: No training view sees an initial point.
    """
    whole = capture.whole
    views = [whole.cameras[index] for index in whole.training]
    pictures = (whole.image(index, 0) for index in whole.training)
    stream = propose_steps(config.stream, config.steps, views, whole.points, pictures)
    return replace(config, stream=stream)


def count_deaths(state: FrameState, target: int, settings: BirthSettings) -> int:
    """Return how many Gaussians a frame loses: those that are too many, and may die."""
    header = state.scene.header
    logits = state.scene.codes[OPACITY.start] * header.opacity_step
    may_die = int(np.count_nonzero(1 / (1 + np.exp(-logits)) < settings.death_opacity))
    return min(max(0, state.scene.count - target), may_die)


def _make_context(capture: Capture, options: EncodeOptions) -> TrainingContext:
    device = choose_device(options.device)
    views = TrainingViews(capture, device)
    rasterizer = choose_rasterizer(device)
    extent = measure_extent(views.cameras)
    exposures = Exposures(len(views.cameras), device)
    return TrainingContext(
        views,
        rasterizer,
        device,
        options.config.seed,
        options.progress,
        extent,
        exposures,
        options.monitor,
    )
