"""Reads the alpha of pictures, which separates a subject from a transparent background.

The alpha of a picture comes from the masks of its camera or, without masks, from the alpha channel
of its PNG file. Transparent pixels are black in the pictures of such a capture.
"""

from collections.abc import Sequence

import numpy as np

from quarc_ref.datasets.arrangements import is_video
from quarc_ref.datasets.capture import Alpha, AlphaSource, Image, PictureSource
from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.errors import MaskSizeError, MissingAlphaError
from quarc_ref.datasets.findings import Finding
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.stills import read_still_alpha
from quarc_ref.datasets.undistortion import Rectifier


class FileAlphas:
    """Alpha of the pictures on disk, synchronized like the pictures.

    Args:
        names: `[camera]` camera names for error messages.
        footage: The pictures on disk, and their masks.
        first_frames: `[camera]` frame on disk that becomes frame 0.
    """

    def __init__(
        self,
        names: Sequence[str],
        footage: Footage,
        first_frames: Sequence[int],
    ) -> None:
        self._names = tuple(names)
        self._pictures, self._masks = footage.source, footage.masks
        self._first_frames = tuple(first_frames)
        # The last alpha is kept, because it is read for the picture and then for itself.
        self._last: tuple[tuple[int, int], Alpha] | None = None

    def read(self, camera: int, frame: int) -> Alpha:
        """Read alpha, as described for `AlphaSource.read`."""
        key = camera, frame
        if self._last is None or self._last[0] != key:
            self._last = key, self._read_stored(camera, self._first_frames[camera] + frame)
        return self._last[1]

    def _read_stored(self, camera: int, frame: int) -> Alpha:
        alpha, paths = None, self._pictures.paths[camera]
        if self._masks:
            alpha = self._masks.read_alpha(camera, frame)
        if alpha is None and not is_video(paths[0]):
            alpha = read_still_alpha(paths[frame])
        if alpha is None:
            message = (
                f"camera {self._names[camera]} has no mask, and frame {frame} has no alpha channel:"
                " with a transparent background, every camera needs one of them"
            )
            raise MissingAlphaError(message)
        return alpha


def find_ignored_alpha(footage: Footage, camera: int) -> Finding | None:
    """Return a finding if pictures are transparent, but the capture does not say so.

    There is no finding if the capture has masks.

    Args:
        footage: The pictures on disk.
        camera: Index of the camera whose frame 0 is read.

    Raises:
        CaptureError: The picture cannot be read.
    """
    path = footage.source.paths[camera][0]
    alpha = None if footage.masks or is_video(path) else read_still_alpha(path)
    if alpha is None or alpha.all():
        return None
    message = (
        f"pictures such as {path.name} are transparent in places, which is ignored: to encode "
        f'only what is opaque, write {{"background": "transparent"}} into {NOTES_NAME}'
    )
    return Finding("transparency-ignored", message)


class PicturesOnBlack:
    """Pictures of another source, with a black background.

    Args:
        source: Source of the pictures on disk.
        alphas: Their alpha.
    """

    def __init__(self, source: PictureSource, alphas: AlphaSource) -> None:
        self._source = source
        self._alphas = alphas

    def read(self, camera: int, frame: int) -> Image:
        """Read a picture, as described for `PictureSource.read`."""
        picture, alpha = self._source.read(camera, frame), self._alphas.read(camera, frame)
        if picture.shape[:2] != alpha.shape:
            (height, width), (alpha_height, alpha_width) = picture.shape[:2], alpha.shape
            message = (
                f"a mask is {alpha_width}x{alpha_height}, but frame {frame} of its camera is "
                f"{width}x{height}: resize the masks to the size of the pictures on disk"
            )
            raise MaskSizeError(message)
        weighted = picture.astype(np.uint16) * alpha[..., None]
        return np.asarray((weighted + 127) // 255, dtype=np.uint8)


class RectifiedAlphas:
    """Alpha that is undistorted and downscaled like the pictures.

    Args:
        source: Alpha of the pictures on disk.
        rectifiers: `[camera]` rectifiers of the pictures.
    """

    def __init__(self, source: AlphaSource, rectifiers: Sequence[Rectifier]) -> None:
        self._source = source
        self._rectifiers = tuple(rectifiers)

    def read(self, camera: int, frame: int) -> Alpha:
        """Read alpha, as described for `AlphaSource.read`."""
        return self._rectifiers[camera].rectify(self._source.read(camera, frame))
