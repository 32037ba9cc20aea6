"""Estimates time offsets between the recordings of a rig from sound or motion.

The amount of motion gives rough offsets before poses are known. Once cameras have poses, the
positions of motion refine them (`epipolar_motion`).
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum

from quarc_ref.calibration.alignment import Shift, align, correlate_signals
from quarc_ref.calibration.epipolar_motion import align_by_epipolar_motion
from quarc_ref.calibration.errors import CalibrationError
from quarc_ref.calibration.recordings import Recordings
from quarc_ref.calibration.signals import Motion, measure_loudness, measure_motion, sum_motion
from quarc_ref.datasets.arrangements import is_video
from quarc_ref.datasets.calibration import CalibratedCamera
from quarc_ref.datasets.sound import Sound, read_sound
from quarc_ref.datasets.video import VideoReader

MIN_CLARITY = 2.0
_MIN_FRAMES = 24  # minimum number of frames for synchronization by motion
_MAX_FRAMES = 300  # maximum number of frames compared by motion
_LONGEST_OFFSET = 0.4  # largest offset, relative to the shortest recording
_MAX_OFFSET = 300  # frames
_SAME = 2  # frames: closer shifts count as the same shift
_MAX_SECONDS = 60.0  # seconds of sound that are compared
_SAMPLES_PER_SECOND = 16000
_LEVELS_PER_FRAME = 8  # of loudness

Report = Callable[[int, int], None]


class SyncMethod(StrEnum):
    """Method to estimate time offsets."""

    AUTO = "auto"
    SOUND = "sound"
    MOTION = "motion"
    NONE = "none"


@dataclass(frozen=True, slots=True)
class Offsets:
    """Start times of the recordings of a rig.

    Attributes:
        method: Method that was used; `NONE` if offsets were not estimated.
        frames: Offsets by camera name: frame `t` of the rig is frame `t + offset` of the
            camera's recording. Unreliable offsets are set to the median, 0.
        confidence: Clearness of each offset, as in `alignment.Shift`; empty without a method.
    """

    method: SyncMethod
    frames: dict[str, float]
    confidence: dict[str, float]

    @property
    def unreliable(self) -> list[str]:
        """Names of the cameras whose offsets are unreliable."""
        return [name for name, found in self.confidence.items() if found < MIN_CLARITY]


def find_offsets(
    recordings: Recordings, method: SyncMethod, report: Report
) -> tuple[Offsets, dict[str, Motion]]:
    """Estimate the time offsets of recordings.

    Args:
        recordings: Recordings of one rig, at one frame rate.
        method: Method; `AUTO` uses sound if all recordings have it, else motion.
        report: Called with the number of recordings read so far, and the total.

    Returns:
        The offsets, and the motion of each recording by camera name if they were
        estimated from motion.

    Raises:
        CalibrationError: Sound is requested, but a recording has none.
        CaptureError: A recording cannot be read.
    """
    if method in (SyncMethod.AUTO, SyncMethod.SOUND):
        sounds = _read_sounds(recordings, report)
        silent = [n for n, sound in zip(recordings.names, sounds, strict=True) if sound is None]
        if not silent:
            shifts = _align_sounds(recordings, sounds)
            return _judge(recordings.names, SyncMethod.SOUND, shifts), {}
        if method is SyncMethod.SOUND:
            message = (
                f"cannot synchronize by sound: {', '.join(silent)} have none; --sync motion needs "
                "no sound"
            )
            raise CalibrationError(message)
    if method is SyncMethod.NONE or min(recordings.pictures.lengths) < _MIN_FRAMES:
        return Offsets(SyncMethod.NONE, dict.fromkeys(recordings.names, 0.0), {}), {}
    motions = _measure_motions(recordings, report)
    most = _find_max_offset(motions.values())
    sums = [sum_motion(motion) for motion in motions.values()]
    shifts = align(
        len(sums), lambda first, second: correlate_signals(sums[first], sums[second], most), _SAME
    )
    return _judge(recordings.names, SyncMethod.MOTION, shifts), motions


def refine_offsets(cameras: Sequence[CalibratedCamera], motions: Mapping[str, Motion]) -> Offsets:
    """Estimate the offsets of cameras that have poses.

    Args:
        cameras: Cameras with poses.
        motions: Motion of each recording, by camera name.
    """
    names = [camera.name for camera in cameras]
    watched = [motions[name] for name in names]
    shifts = align_by_epipolar_motion(cameras, watched, _find_max_offset(watched), _SAME)
    return _judge(names, SyncMethod.MOTION, shifts)


def _judge(names: Sequence[str], method: SyncMethod, shifts: Sequence[Shift]) -> Offsets:
    named = dict(zip(names, shifts, strict=True))
    return Offsets(
        method,
        {
            name: shift.samples if shift.confidence >= MIN_CLARITY else 0.0
            for name, shift in named.items()
        },
        {name: shift.confidence for name, shift in named.items()},
    )


def _read_sounds(recordings: Recordings, report: Report) -> list[Sound | None]:
    sounds: list[Sound | None] = []
    for path, *_ in recordings.pictures.paths:
        if not is_video(path):
            return [None] * len(recordings.names)
        sounds.append(read_sound(path, _SAMPLES_PER_SECOND, _MAX_SECONDS))
        report(len(sounds), len(recordings.names))
    return sounds


def _align_sounds(recordings: Recordings, sounds: Sequence[Sound | None]) -> list[Shift]:
    per_second = recordings.pictures.frames_per_second * _LEVELS_PER_FRAME
    signals = [
        measure_loudness(sound, float(VideoReader(path).frame_times[0]), per_second)
        for sound, (path, *_) in zip(sounds, recordings.pictures.paths, strict=True)
        if sound is not None
    ]
    shortest = min(map(len, signals)) / _LEVELS_PER_FRAME
    most = int(min(_MAX_OFFSET, _LONGEST_OFFSET * shortest) * _LEVELS_PER_FRAME)
    shifts = align(
        len(signals),
        lambda first, second: correlate_signals(signals[first], signals[second], max(1, most)),
        _SAME * _LEVELS_PER_FRAME,
    )
    return [Shift(shift.samples / _LEVELS_PER_FRAME, shift.confidence) for shift in shifts]


def _measure_motions(recordings: Recordings, report: Report) -> dict[str, Motion]:
    motions = {}
    for camera, (name, length) in enumerate(
        zip(recordings.names, recordings.pictures.lengths, strict=True)
    ):
        motions[name] = measure_motion(recordings.pictures, camera, min(length, _MAX_FRAMES))
        report(camera + 1, len(recordings.names))
    return motions


def _find_max_offset(motions: Iterable[Motion]) -> int:
    """Return the largest offset, in frames, that motion can detect."""
    return max(1, min(_MAX_OFFSET, int(_LONGEST_OFFSET * min(map(len, motions)))))
