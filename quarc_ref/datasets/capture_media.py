"""Opens the pictures of a capture, with their masks or alpha, undistorted and synchronized."""

from collections.abc import Sequence
from dataclasses import dataclass

from quarc_ref.datasets.alphas import FileAlphas, PicturesOnBlack, RectifiedAlphas
from quarc_ref.datasets.capture import AlphaSource, MaskSource, PictureSource
from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.datasets.footage import Footage
from quarc_ref.datasets.masks import RectifiedMasks
from quarc_ref.datasets.pictures import RectifiedPictures, SynchronizedPictures
from quarc_ref.datasets.undistortion import Rectifier


@dataclass(frozen=True, slots=True, eq=False)
class CaptureMedia:
    """What the cameras of a capture recorded, undistorted and synchronized.

    Attributes:
        pictures: The pictures; transparent pixels are black.
        masks: Masks of the pictures; None if all pixels are used.
        alphas: Alpha of the pictures; None if they are opaque.
    """

    pictures: PictureSource
    masks: MaskSource | None = None
    alphas: AlphaSource | None = None


def open_media(
    names: Sequence[str],
    footage: Footage,
    pictures: SynchronizedPictures,
    rectifiers: Sequence[Rectifier],
    notes: CaptureNotes,
) -> CaptureMedia:
    """Open the pictures of a capture.

    Args:
        names: `[camera]` camera names for error messages.
        footage: The pictures on disk, and their masks.
        pictures: The synchronized pictures on disk.
        rectifiers: `[camera]` rectifiers of the pictures.
        notes: Notes of the capture, which state whether its background is transparent.
    """
    masks = footage.masks
    if notes.has_transparent_background:
        alphas = FileAlphas(names, footage, pictures.first_frames)
        on_black = RectifiedPictures(PicturesOnBlack(pictures, alphas), names, rectifiers)
        return CaptureMedia(on_black, alphas=RectifiedAlphas(alphas, rectifiers))
    return CaptureMedia(
        RectifiedPictures(pictures, names, rectifiers),
        masks=RectifiedMasks(masks, pictures.first_frames, rectifiers) if masks else None,
    )
