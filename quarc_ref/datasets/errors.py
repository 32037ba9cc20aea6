"""Errors of captures, by name; each message says what to fix.

    CaptureError
    ├── UnknownLayoutError      the folder has no capture in a known layout
    ├── MissingFileError        a file that the layout needs is missing
    ├── OutsideFileError        a description names a file outside of its folder
    ├── MissingCameraError      poses and pictures do not name the same cameras
    │   └── HeldOutError        cameras to hold out are missing, or are all cameras
    ├── CountMismatchError      cameras differ in frames, or poses in cameras
    │   └── FrameRateError      videos differ in frame rate, or one varies in it
    ├── TooFewFramesError       more frames are asked for than every camera has
    │   └── StartError          the first frame asked for is after the last
    ├── TruncatedVideoError     a video ends before it should
    ├── UnreadableVideoError    a video or picture cannot be decoded
    ├── MaskError               masks do not fit the pictures
    │   ├── MaskNameError       masks are named after no camera
    │   ├── MaskSizeError       a mask has another size than the pictures of its camera
    │   └── MaskCountError      a camera has several masks, but not one for each frame
    ├── UnreadablePoseError     a pose file is malformed, or holds no valid pose
    ├── UnreadableNotesError    quarc-capture.json is malformed
    ├── UnsupportedCameraError  a camera model that cannot be made a pinhole
    └── UnreadablePointsError   initial points are malformed, or cannot be found

None of them is an error of the program: catch `CaptureError` and show its message.
"""


class CaptureError(Exception):
    """A capture that cannot be used without changes."""


class UnknownLayoutError(CaptureError):
    """The folder does not contain a capture in a known layout."""


class MissingFileError(CaptureError):
    """A file that the layout needs is not there."""


class OutsideFileError(CaptureError):
    """A description names a file outside of the folder that it is in."""


class MissingCameraError(CaptureError):
    """Poses and pictures do not name the same cameras."""


class HeldOutError(MissingCameraError):
    """Cameras to hold out do not exist, or no others are left."""


class CountMismatchError(CaptureError):
    """Cameras differ in their number of frames, or poses in their number of cameras."""


class FrameRateError(CountMismatchError):
    """Videos differ in frame rate, or the frame rate of one is variable."""


class TooFewFramesError(CaptureError):
    """More frames are asked for than every camera has."""


class StartError(TooFewFramesError):
    """The first frame asked for is after the last that every camera has."""


class TruncatedVideoError(CaptureError):
    """A video ends before its header says, or before the frame asked for."""


class UnreadableVideoError(CaptureError):
    """A video or a picture cannot be decoded."""


class MaskError(CaptureError):
    """Masks do not fit the pictures."""


class MaskNameError(MaskError):
    """Masks are named after no camera."""


class MaskSizeError(MaskError):
    """A mask has another size than the pictures of its camera."""


class MaskCountError(MaskError):
    """A camera has several masks, but not one for each frame."""


class UnreadablePoseError(CaptureError):
    """A pose file is malformed, or its numbers do not form a pose."""


class UnreadableNotesError(CaptureError):
    """The notes of a capture, `quarc-capture.json`, are malformed."""


class UnsupportedCameraError(CaptureError):
    """A camera model that cannot be turned into a pinhole."""


class UnreadablePointsError(CaptureError):
    """Initial points are malformed, or none could be triangulated."""
