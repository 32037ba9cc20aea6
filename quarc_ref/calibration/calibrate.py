"""Runs all steps of calibration, from recordings without poses to a calibrated rig."""

import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.features import Features, Mask
from quarc_ref.calibration.first_frame import read_first_frame
from quarc_ref.calibration.lenses import LensOptions
from quarc_ref.calibration.match_graph import build_match_graph
from quarc_ref.calibration.offsets import Offsets, SyncMethod, find_offsets, refine_offsets
from quarc_ref.calibration.recordings import MIN_CAMERAS, Recordings
from quarc_ref.calibration.signals import Motion
from quarc_ref.calibration.solving import Solution, solve
from quarc_ref.calibration.world import BY_LEVEL, Distance, World, define_world
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.colmap_cameras import silence_colmap
from quarc_ref.datasets.pictures import SynchronizedPictures

# each one halves a gap between the previous ones
_FRACTIONS = (0, 4 / 8, 2 / 8, 6 / 8, 1 / 8, 5 / 8, 3 / 8, 7 / 8)
_BEGIN_WITH = 2  # moments
_ENOUGH = 40  # supported points per camera after which no further moments are needed
_TRUSTED = 100  # supported points of a camera whose pose is not checked again
_HALF = 0.5  # frames: smaller offsets are rounded to 0

Report = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class CalibrateOptions:
    """Options of a calibration.

    Attributes:
        lenses: Assumptions about the lenses.
        moments: Number of moments searched for features; None for as many as needed.
        masks: Masks by camera name, `[H, W]`, True where features may be used.
        sync: Method for time offsets.
        up: How to find the up axis; see `world.define_world`.
        distance: Distance between two cameras, if known.
        report: Called with each stage, its number of finished steps, and their total.
    """

    lenses: LensOptions = field(default_factory=LensOptions)
    moments: int | None = None
    masks: Mapping[str, Mask] = field(default_factory=dict)
    sync: SyncMethod = SyncMethod.AUTO
    up: str = BY_LEVEL
    distance: Distance | None = None
    report: Report = lambda _stage, _done, _total: None


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A calibrated rig.

    Attributes:
        recordings: Recordings of all cameras, including those without a pose.
        offsets: Offsets of all cameras.
        solution: Poses and lenses, and their errors.
        world: The calibrated cameras in an upright world.
        points: Scene points at frame 0, in the same world.
        moments: Number of moments searched for features.
    """

    recordings: Recordings
    offsets: Offsets
    solution: Solution
    world: World
    points: Points
    moments: int

    @property
    def unreliable(self) -> tuple[str, ...]:
        """Cameras whose poses depend on so few points that they may be inaccurate."""
        fits = self.solution.fits
        return tuple(name for name, fit in fits.items() if fit.support < _ENOUGH)

    @property
    def notes(self) -> CaptureNotes:
        """Capture notes, which are written beside the poses."""
        frames = {each.name: self.offsets.frames[each.name] for each in self.world.cameras}
        differ = any(round(offset) for offset in frames.values())
        rounded = {name: round(offset, 2) for name, offset in frames.items()}
        return CaptureNotes(rounded if differ else {}, self.world.up, self.world.meters_per_unit)


def calibrate(recordings: Recordings, options: CalibrateOptions) -> Calibration:
    """Calibrate the cameras of a set of recordings.

    Args:
        recordings: Recordings from `find_recordings`.
        options: Options of the calibration.

    Raises:
        CalibrationError: No poses can be found.
        CaptureError: A recording cannot be read.
    """
    for name in options.masks:
        recordings.index(name)
    offsets, motions = find_offsets(
        recordings, options.sync, lambda *done: options.report("sync", *done)
    )
    solution, moments = _solve(recordings, offsets, options)
    if motions:
        refined = _refine(offsets, solution, motions)
        is_same = _compare(offsets, refined) < _HALF
        offsets = refined
        if not is_same:
            solution, moments = _solve(recordings, offsets, options)
    solution, world, points = _build_scene(recordings, offsets, solution, options)
    return Calibration(recordings, offsets, solution, world, points, moments)


def _refine(offsets: Offsets, solution: Solution, motions: Mapping[str, Motion]) -> Offsets:
    """Refine the offsets of cameras that have poses."""
    found = refine_offsets(solution.cameras, motions)
    return replace(
        found,
        frames=dict.fromkeys(offsets.frames, 0.0) | found.frames,
        confidence=offsets.confidence | found.confidence,
    )


def _compare(first: Offsets, second: Offsets) -> float:
    return max(abs(first.frames[name] - second.frames[name]) for name in first.frames)


def _solve(
    recordings: Recordings, offsets: Offsets, options: CalibrateOptions
) -> tuple[Solution, int]:
    """Return poses from as many moments as needed, and the number of moments."""
    names, pictures = recordings.names, recordings.pictures
    firsts = CaptureNotes(offsets.frames).first_frames(names)
    later = SynchronizedPictures(pictures, [firsts[name] for name in names])
    chosen = _choose_moments(later.frame_count, options.moments)
    best: Solution | None = None
    with tempfile.TemporaryDirectory() as folder, silence_colmap():
        features = Features(Path(folder), [options.masks.get(name) for name in names])
        for done, moment in enumerate(chosen, start=1):
            read = [later.read(camera, moment) for camera in range(len(names))]
            features.add_moment(moment, read, lambda *steps: options.report("features", *steps))
            is_last = done == len(chosen)
            if not is_last and (options.moments or done < _BEGIN_WITH or done & (done - 1)):
                continue
            options.report("poses", 0, 1)
            graph = build_match_graph(features, names, pictures.sizes, options.lenses)
            with suppress(*(() if is_last and best is None else (CalibrationError,))):
                found = solve(graph, options.lenses)
                if best is None or len(found.cameras) >= len(best.cameras):
                    best = found
            options.report("poses", 1, 1)
            if best is not None and _is_enough(best):
                break
    if best is None:
        message = "no camera could be calibrated"
        raise CalibrationError(message)
    return best, len(features.moments)


def _is_enough(solution: Solution) -> bool:
    least = min(fit.support for fit in solution.fits.values())
    return not solution.left_out and least >= _ENOUGH


def _choose_moments(frame_count: int, count: int | None) -> list[int]:
    """Return frames in an order in which every prefix is spread evenly."""
    if frame_count < 1:
        message = (
            "after synchronization, no frame is common to all cameras; --sync none turns "
            "synchronization off"
        )
        raise CalibrationError(message)
    fractions = _FRACTIONS if count is None else np.arange(count) / count
    return list(dict.fromkeys(int(fraction * frame_count) for fraction in fractions))


def _build_scene(
    recordings: Recordings, offsets: Offsets, solution: Solution, options: CalibrateOptions
) -> tuple[Solution, World, Points]:
    """Return the solution, the upright rig, and points of the scene at frame 0.

    A few matches can agree on a wrong pose. A camera with few supported points is
    therefore left out if its picture does not match the scene's points projected by its
    pose.
    """
    world = define_world(solution.cameras, solution.points, options.up, options.distance)
    frame = read_first_frame(world.cameras, recordings, offsets.frames)
    points = frame.find_points()
    few = {name for name, fit in solution.fits.items() if fit.support < _TRUSTED}
    wrong = few.intersection(frame.find_mismatches(points)) if few else set()
    if not wrong or len(world.cameras) - len(wrong) < MIN_CAMERAS:
        return solution, world, points
    reasons = {name: _describe_mismatch(solution.fits[name].support) for name in wrong}
    return _build_scene(recordings, offsets, solution.without(reasons), options)


def _describe_mismatch(support: int) -> str:
    return (
        f"{support} of its points are also seen by two other cameras, but the scene rendered "
        "with the estimated pose does not match its picture: use more pictures (--moments "
        "16), a camera between it and the others, or more texture"
    )
