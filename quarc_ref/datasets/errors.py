"""Errors of captures, whose messages say what to fix.

    CaptureError
    ├── UnknownLayoutError      the folder has no capture in a known layout
    ├── MissingFileError        a file that the layout needs is missing
    ├── OutsideFileError        a description file names a file outside its folder
    ├── MissingCameraError      poses and pictures do not have the same camera names
    │   └── HeldOutError        cameras to hold out do not exist, or none are left to train
    ├── CountMismatchError      numbers of frames differ, or numbers of poses and cameras
    │   └── FrameRateError      frame rates differ, or one is variable or out of range
    ├── TooFewFramesError       more frames are requested than the capture has
    │   └── StartError          the first requested frame is after the last frame
    ├── TruncatedVideoError     a video ends too early
    ├── UnreadableVideoError    a video or picture cannot be decoded
    ├── NoSoundError            a video has no sound
    ├── MaskError               masks do not fit the pictures
    │   ├── MaskNameError       masks are not named after cameras
    │   ├── MaskSizeError       a mask and the pictures of its camera differ in size
    │   ├── MaskCountError      a camera has several masks, but not one for each frame
    │   └── MissingAlphaError   the background is transparent, but a picture has no alpha
    ├── UnreadablePoseError     a pose file is malformed, or has an invalid pose
    ├── UnreadableNotesError    quarc-capture.json is malformed
    ├── UnsupportedCameraError  pictures of a camera cannot be undistorted
    └── UnreadablePointsError   initial points are malformed, or cannot be triangulated

All of these errors report problems with the input: catch `CaptureError` and show its message.
"""

from typing import Self


class CaptureError(Exception):
    """A capture cannot be used until the user fixes it."""


class UnknownLayoutError(CaptureError):
    """The folder does not contain a capture in a known layout."""


class MissingFileError(CaptureError):
    """A file that the layout needs is missing, or cannot be read."""

    @classmethod
    def of(cls, path: object, error: OSError) -> Self:
        """Return the error for a path that could not be read, which is named only once."""
        return cls(f"{path} cannot be read: {error.strerror or error}")


class OutsideFileError(CaptureError):
    """A description file, such as `transforms.json`, names a file outside its folder."""


class MissingCameraError(CaptureError):
    """Poses and pictures do not have the same camera names."""


class HeldOutError(MissingCameraError):
    """Cameras to hold out do not exist, or no training cameras are left."""


class CountMismatchError(CaptureError):
    """The cameras' numbers of frames differ, or the numbers of poses and cameras differ."""


class FrameRateError(CountMismatchError):
    """Videos differ in frame rate, or a frame rate is variable or out of range."""


class TooFewFramesError(CaptureError):
    """More frames are requested than the capture has."""


class StartError(TooFewFramesError):
    """The first requested frame is after the last frame of the capture."""


class TruncatedVideoError(CaptureError):
    """A video has fewer frames than its header states, or no frame table, or ends too early."""


class UnreadableVideoError(CaptureError):
    """A video or a picture cannot be decoded."""


class NoSoundError(CaptureError):
    """A video has no sound."""


class MaskError(CaptureError):
    """Masks do not fit the pictures."""


class MaskNameError(MaskError):
    """Masks are not named after cameras."""


class MaskSizeError(MaskError):
    """A mask and the pictures of its camera differ in size."""


class MaskCountError(MaskError):
    """A camera has several masks, but not one for each frame."""


class MissingAlphaError(MaskError):
    """The background is transparent, but a picture has neither a mask nor an alpha channel."""


class UnreadablePoseError(CaptureError):
    """A pose file is malformed, or its numbers do not form a pose."""


class UnreadableNotesError(CaptureError):
    """The notes of a capture, `quarc-capture.json`, are malformed."""


class UnsupportedCameraError(CaptureError):
    """The pictures of a camera cannot be undistorted, because of its model or field of view."""


class UnreadablePointsError(CaptureError):
    """Initial points are malformed, or too few could be triangulated."""
