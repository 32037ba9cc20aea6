"""Estimates time offsets between the recordings of a rig from sound or motion.

Before poses are known, the amount of motion gives rough offsets. When the cameras have poses,
the positions of motion in the pictures give more accurate offsets (`epipolar_motion`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

from quarc_ref.calibration.alignment import Shift, align_signals, correlate_signals
from quarc_ref.calibration.epipolar_motion import align_by_epipolar_motion
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.recordings import Recordings
from quarc_ref.calibration.signals import (
    Motion,
    make_motion_signal,
    measure_loudness,
    measure_motion,
)
from quarc_ref.datasets.arrangements import is_video
from quarc_ref.datasets.calibration import CalibratedCamera
from quarc_ref.datasets.errors import UnreadableVideoError
from quarc_ref.datasets.sound import Sound, read_sound
from quarc_ref.datasets.video import VideoReader

MIN_CONFIDENCE = 2.0
MIN_MOTION_FRAMES = 24  # minimum number of frames for synchronization by motion
_MAX_MOTION_FRAMES = 300  # maximum number of frames whose motion is compared
_MAX_RELATIVE_OFFSET = 0.4  # largest offset relative to the shortest recording
_MAX_OFFSET = 300  # frames
_PEAK_WIDTH = 2  # frames: closer shifts count as the same shift
_MAX_SOUND_SECONDS = 60.0  # maximum duration of the compared sounds
_SOUND_SAMPLES_PER_SECOND = 16000
_LOUDNESS_SAMPLES_PER_FRAME = 8

StepCallback = Callable[[int, int], None]


class SyncMethod(StrEnum):
    """Method of estimating time offsets."""

    AUTO = "auto"
    SOUND = "sound"
    MOTION = "motion"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Offsets:
    """Time offsets of the recordings of a rig.

    Attributes:
        method: Method by which the offsets were estimated; `NONE` if they were not estimated.
        frame_offsets: Offsets by camera name: frame `t` of the rig is frame `t + offset` of the
            camera's recording. Offsets are relative to their median; unreliable ones are 0.
        confidence: Confidence of each offset by camera name, as in `alignment.Shift`; empty if
            `method` is `NONE`.
        sound_problem: Why the sound could not be decoded; empty if it could, or was not needed.
    """

    method: SyncMethod
    frame_offsets: dict[str, float]
    confidence: dict[str, float]
    sound_problem: str = ""

    @property
    def written_offsets(self) -> dict[str, float]:
        """Offsets by camera name as `quarc-capture.json` contains them, rounded to 1/100 frame."""
        # Adding 0 turns -0.0 into 0.0.
        return {name: round(offset, 2) + 0.0 for name, offset in self.frame_offsets.items()}

    @property
    def unreliable_cameras(self) -> list[str]:
        """Names of the cameras whose offsets are unreliable."""
        return [name for name, confidence in self.confidence.items() if confidence < MIN_CONFIDENCE]


def find_offsets(
    recordings: Recordings, method: SyncMethod, report_progress: StepCallback
) -> tuple[Offsets, dict[str, Motion]]:
    """Estimate the time offsets of recordings.

    Args:
        recordings: Recordings of one rig, all with the same frame rate.
        method: Method to use; `AUTO` uses sound if all recordings have sound that can be decoded,
            and motion otherwise.
        report_progress: Function to call with the number of recordings read so far and the total
            number.

    Returns:
        The offsets, and the motion of each recording by camera name. The motion is empty if the
        offsets were not estimated from motion.

    Raises:
        CalibrationError: Sound is requested, but a recording has no sound.
        CaptureError: A recording cannot be read.
    """
    sound_problem = ""
    if method in (SyncMethod.AUTO, SyncMethod.SOUND):
        try:
            return _find_offsets_from_sound(recordings, report_progress), {}
        except (CalibrationError, UnreadableVideoError) as error:
            if method is SyncMethod.SOUND:
                raise
            sound_problem = str(error) if isinstance(error, UnreadableVideoError) else ""
    if method is SyncMethod.NONE or min(recordings.pictures.lengths) < MIN_MOTION_FRAMES:
        zeros = dict.fromkeys(recordings.names, 0.0)
        return Offsets(SyncMethod.NONE, zeros, {}, sound_problem), {}
    motions = _measure_motions(recordings, report_progress)
    max_offset = _find_max_offset(motions.values())
    signals = [make_motion_signal(motion) for motion in motions.values()]
    shifts = align_signals(
        len(signals),
        lambda first, second: correlate_signals(signals[first], signals[second], max_offset),
        _PEAK_WIDTH,
    )
    offsets = _make_offsets(recordings.names, SyncMethod.MOTION, shifts)
    return replace(offsets, sound_problem=sound_problem), motions


def estimate_offsets_from_poses(
    cameras: Sequence[CalibratedCamera], motions: Mapping[str, Motion]
) -> Offsets:
    """Estimate offsets from motion and camera poses; earlier offsets are not used.

    Args:
        cameras: Cameras with poses.
        motions: Motion of each recording, by camera name.
    """
    names = [camera.name for camera in cameras]
    camera_motions = [motions[name] for name in names]
    shifts = align_by_epipolar_motion(
        cameras, camera_motions, _find_max_offset(camera_motions), _PEAK_WIDTH
    )
    return _make_offsets(names, SyncMethod.MOTION, shifts)


def _make_offsets(names: Sequence[str], method: SyncMethod, shifts: Sequence[Shift]) -> Offsets:
    shift_by_name = dict(zip(names, shifts, strict=True))
    return Offsets(
        method,
        {
            name: shift.samples if shift.confidence >= MIN_CONFIDENCE else 0.0
            for name, shift in shift_by_name.items()
        },
        {name: shift.confidence for name, shift in shift_by_name.items()},
    )


def _find_offsets_from_sound(recordings: Recordings, report_progress: StepCallback) -> Offsets:
    """Estimate the offsets from sound.

    Raises:
        CalibrationError: A recording has no sound.
        UnreadableVideoError: The sound of a recording cannot be decoded.
    """
    sounds = _read_sounds(recordings, report_progress)
    silent_cameras = [
        name for name, sound in zip(recordings.names, sounds, strict=True) if sound is None
    ]
    if silent_cameras:
        message = (
            "cannot synchronize by sound: there is no sound in the recordings of cameras "
            f"{', '.join(silent_cameras)}; use --sync motion"
        )
        raise CalibrationError(message)
    return _make_offsets(recordings.names, SyncMethod.SOUND, _align_sounds(recordings, sounds))


def _read_sounds(recordings: Recordings, report_progress: StepCallback) -> list[Sound | None]:
    sounds: list[Sound | None] = []
    for path, *_ in recordings.pictures.paths:
        if not is_video(path):
            return [None] * len(recordings.names)
        sounds.append(read_sound(path, _SOUND_SAMPLES_PER_SECOND, _MAX_SOUND_SECONDS))
        report_progress(len(sounds), len(recordings.names))
    return sounds


def _align_sounds(recordings: Recordings, sounds: Sequence[Sound | None]) -> list[Shift]:
    # Sound has the time of the videos, so a frame rate that the user states does not apply to it.
    loudness_rate = recordings.pictures.frames_per_second * _LOUDNESS_SAMPLES_PER_FRAME
    signals = [
        measure_loudness(sound, float(VideoReader(path).frame_times[0]), loudness_rate)
        for sound, (path, *_) in zip(sounds, recordings.pictures.paths, strict=True)
        if sound is not None
    ]
    min_frame_count = min(map(len, signals)) / _LOUDNESS_SAMPLES_PER_FRAME
    max_shift = int(
        min(_MAX_OFFSET, _MAX_RELATIVE_OFFSET * min_frame_count) * _LOUDNESS_SAMPLES_PER_FRAME
    )
    shifts = align_signals(
        len(signals),
        lambda first, second: correlate_signals(signals[first], signals[second], max(1, max_shift)),
        _PEAK_WIDTH * _LOUDNESS_SAMPLES_PER_FRAME,
    )
    return [
        Shift(shift.samples / _LOUDNESS_SAMPLES_PER_FRAME, shift.confidence) for shift in shifts
    ]


def _measure_motions(recordings: Recordings, report_progress: StepCallback) -> dict[str, Motion]:
    motions = {}
    for camera, (name, length) in enumerate(
        zip(recordings.names, recordings.pictures.lengths, strict=True)
    ):
        motions[name] = measure_motion(recordings.pictures, camera, min(length, _MAX_MOTION_FRAMES))
        report_progress(camera + 1, len(recordings.names))
    return motions


def _find_max_offset(motions: Iterable[Motion]) -> int:
    """Return the largest offset, in frames, that can be estimated from the motion."""
    return max(1, min(_MAX_OFFSET, int(_MAX_RELATIVE_OFFSET * min(map(len, motions)))))
