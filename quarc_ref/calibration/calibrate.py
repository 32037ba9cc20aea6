"""Runs all steps of calibration: turns recordings without poses into a calibrated rig."""

import tempfile
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from quarc_ref.calibration.copies import require_distinct_recordings
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.features import Features, Mask
from quarc_ref.calibration.first_frame import read_first_frame
from quarc_ref.calibration.lenses import LensOptions
from quarc_ref.calibration.match_graph import build_match_graph
from quarc_ref.calibration.offsets import (
    Offsets,
    SyncMethod,
    estimate_offsets_from_poses,
    find_offsets,
)
from quarc_ref.calibration.recordings import MIN_CAMERAS, Recordings
from quarc_ref.calibration.signals import Motion
from quarc_ref.calibration.solving import Solution, solve_match_graph
from quarc_ref.calibration.world import UP_FROM_LEVEL_CAMERAS, Distance, World, define_world
from quarc_ref.datasets.capture import Points
from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.colmap_cameras import silence_colmap
from quarc_ref.datasets.pictures import SynchronizedPictures

# each fraction halves a gap between earlier fractions
_MOMENT_FRACTIONS = (0, 4 / 8, 2 / 8, 6 / 8, 1 / 8, 5 / 8, 3 / 8, 7 / 8)
_MIN_MOMENTS = 2
_SUFFICIENT_SUPPORT = 40  # supported points per camera at which no further moments are added
_TRUSTED_SUPPORT = 100  # poses with at least this many supported points are not checked again
_MIN_OFFSET_CHANGE = 0.5  # frames: poses are estimated again after a larger change

ProgressCallback = Callable[[str, int, int], None]


@dataclass(frozen=True, slots=True)
class CalibrateOptions:
    """Options of a calibration.

    Attributes:
        lenses: Assumptions about the lenses.
        moment_count: Number of moments whose pictures are searched for features; None to choose it
            automatically.
        masks: Masks by camera name, `[H, W]`, True where features may be used.
        sync: Method of estimating time offsets.
        up: Source of the up axis; see `world.define_world`.
        distance: Known distance between two cameras; None if unknown.
        report_progress: Function to call with the name of the stage, the number of finished
            steps and the total number of steps.
    """

    lenses: LensOptions = field(default_factory=LensOptions)
    moment_count: int | None = None
    masks: Mapping[str, Mask] = field(default_factory=dict)
    sync: SyncMethod = SyncMethod.AUTO
    up: str = UP_FROM_LEVEL_CAMERAS
    distance: Distance | None = None
    report_progress: ProgressCallback = lambda _stage, _done, _total: None


@dataclass(frozen=True, slots=True, eq=False)
class Calibration:
    """A calibrated rig.

    Attributes:
        recordings: Recordings of all cameras, including those without a pose.
        offsets: Offsets of all cameras.
        solution: Poses, lenses and errors in the solver's world coordinates.
        world: The calibrated cameras in the final world coordinates.
        points: Scene points at frame 0, in the final world coordinates.
        moment_count: Number of moments whose pictures were searched for features.
    """

    recordings: Recordings
    offsets: Offsets
    solution: Solution
    world: World
    points: Points
    moment_count: int

    @property
    def left_out(self) -> dict[str, str]:
        """Why a camera was not calibrated, by its name; its recording may not have been usable."""
        return {**self.recordings.left_out, **self.solution.left_out}

    @property
    def camera_count(self) -> int:
        """Number of all cameras, including those that were left out."""
        return len(self.recordings.names) + len(self.recordings.left_out)

    @property
    def unreliable_cameras(self) -> tuple[str, ...]:
        """Names of the cameras whose poses may be inaccurate, because they have few points."""
        fits = self.solution.fits
        return tuple(name for name, fit in fits.items() if fit.support < _SUFFICIENT_SUPPORT)

    @property
    def notes(self) -> CaptureNotes:
        """Notes to write with the capture: time offsets, up axis, scale and stated rate."""
        written_offsets = self.offsets.written_offsets
        offsets = {camera.name: written_offsets[camera.name] for camera in self.world.cameras}
        has_offsets = any(CaptureNotes(offsets).first_frames(offsets).values())
        return CaptureNotes(
            offsets if has_offsets else {},
            self.world.up,
            self.world.meters_per_unit,
            self.recordings.stated_frame_rate,
        )


def calibrate(recordings: Recordings, options: CalibrateOptions) -> Calibration:
    """Calibrate the cameras of a set of recordings.

    Args:
        recordings: Recordings from `find_recordings`.
        options: Options of the calibration.

    Raises:
        CalibrationError: No poses can be found, or two recordings begin with the same picture.
        CaptureError: A recording cannot be read.
    """
    for name in options.masks:
        recordings.index(name)
    require_distinct_recordings(recordings)
    offsets, motions = find_offsets(
        recordings, options.sync, lambda *progress: options.report_progress("sync", *progress)
    )
    solution, moment_count = _estimate_poses(recordings, offsets, options)
    if motions:
        new_offsets = _update_offsets(offsets, solution, motions)
        max_change = _find_max_offset_difference(offsets, new_offsets)
        offsets = new_offsets
        if max_change >= _MIN_OFFSET_CHANGE:
            solution, moment_count = _estimate_poses(recordings, offsets, options)
    solution, world, points = _build_scene(recordings, offsets, solution, options)
    return Calibration(recordings, offsets, solution, world, points, moment_count)


def _update_offsets(offsets: Offsets, solution: Solution, motions: Mapping[str, Motion]) -> Offsets:
    """Estimate the offsets of cameras with poses again; set the offsets of other cameras to 0."""
    new_offsets = estimate_offsets_from_poses(solution.cameras, motions)
    return replace(
        new_offsets,
        frame_offsets=dict.fromkeys(offsets.frame_offsets, 0.0) | new_offsets.frame_offsets,
        confidence=offsets.confidence | new_offsets.confidence,
        sound_problem=offsets.sound_problem,
    )


def _find_max_offset_difference(first: Offsets, second: Offsets) -> float:
    return max(
        abs(first.frame_offsets[name] - second.frame_offsets[name]) for name in first.frame_offsets
    )


def _estimate_poses(
    recordings: Recordings, offsets: Offsets, options: CalibrateOptions
) -> tuple[Solution, int]:
    """Add moments until the poses are well supported; return poses and moment count."""
    names, pictures = recordings.names, recordings.pictures
    first_frames = CaptureNotes(offsets.written_offsets).first_frames(names)
    synchronized_pictures = SynchronizedPictures(pictures, [first_frames[name] for name in names])
    chosen_moments = _choose_moments(synchronized_pictures.frame_count, options.moment_count)
    best_solution: Solution | None = None
    with tempfile.TemporaryDirectory() as folder, silence_colmap():
        features = Features(Path(folder), [options.masks.get(name) for name in names])
        for moment_count, moment in enumerate(chosen_moments, start=1):
            moment_pictures = [
                synchronized_pictures.read(camera, moment) for camera in range(len(names))
            ]
            features.add_moment(
                moment, moment_pictures, lambda *steps: options.report_progress("features", *steps)
            )
            is_last = moment_count == len(chosen_moments)
            if not is_last and (
                options.moment_count
                or moment_count < _MIN_MOMENTS
                or moment_count & (moment_count - 1)
            ):
                continue
            options.report_progress("poses", 0, 1)
            graph = build_match_graph(features, names, pictures.sizes, options.lenses)
            with suppress(*(() if is_last and best_solution is None else (CalibrationError,))):
                solution = solve_match_graph(graph, options.lenses)
                if best_solution is None or len(solution.cameras) >= len(best_solution.cameras):
                    best_solution = solution
            options.report_progress("poses", 1, 1)
            if best_solution is not None and _has_sufficient_support(best_solution):
                break
    if best_solution is None:
        message = "no camera could be calibrated"
        raise CalibrationError(message)
    return best_solution, len(features.moments)


def _has_sufficient_support(solution: Solution) -> bool:
    min_support = min(fit.support for fit in solution.fits.values())
    return not solution.left_out and min_support >= _SUFFICIENT_SUPPORT


def _choose_moments(frame_count: int, count: int | None) -> list[int]:
    """Return the frames to use; by default, they are ordered so that early ones are far apart."""
    if frame_count < 1:
        message = (
            "after synchronization, no frame is common to all cameras; use --sync none to "
            "disable synchronization"
        )
        raise CalibrationError(message)
    fractions = _MOMENT_FRACTIONS if count is None else np.arange(count) / count
    return list(dict.fromkeys(int(fraction * frame_count) for fraction in fractions))


def _build_scene(
    recordings: Recordings, offsets: Offsets, solution: Solution, options: CalibrateOptions
) -> tuple[Solution, World, Points]:
    """Return the solution, the cameras in final world coordinates, and points at frame 0.

    A few wrong matches can be consistent with a wrong pose, so a camera with few supported
    points is left out if its picture does not match the projected scene points.
    """
    world = define_world(solution.cameras, solution.points, options.up, options.distance)
    first_frame = read_first_frame(world.cameras, recordings, offsets.written_offsets)
    points = first_frame.triangulate_points()
    weak_cameras = {name for name, fit in solution.fits.items() if fit.support < _TRUSTED_SUPPORT}
    mismatched = set[str]()
    if weak_cameras:
        mismatched = weak_cameras.intersection(first_frame.find_mismatched_cameras(points))
    if not mismatched or len(world.cameras) - len(mismatched) < MIN_CAMERAS:
        return solution, world, points
    reasons = {name: _describe_mismatch(solution.fits[name].support) for name in mismatched}
    return _build_scene(recordings, offsets, solution.without_cameras(reasons), options)


def _describe_mismatch(support: int) -> str:
    return (
        f"at least two other cameras see {support} of its points, but its picture does not match "
        "the scene as seen from its estimated pose: use more pictures (--moments 16), add a "
        "camera between this camera and the others, or add texture to the scene"
    )
