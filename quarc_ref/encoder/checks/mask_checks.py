"""Finds masks and alpha channels that hide everything in frame 0."""

from collections.abc import Iterator

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.format.errors import UnusableCaptureError

_MAX_FAINT_ALPHA = 15  # of 255


def find_black_masks(capture: Capture) -> Iterator[Finding]:
    """Yield a finding about cameras whose masks in frame 0 are black.

    Raises:
        UnusableCaptureError: The masks of all training cameras are black.
    """
    masks = {name: capture.mask(index, 0) for index, name in _name_used_cameras(capture)}
    names = tuple(name for name, mask in masks.items() if mask is not None and not mask.any())
    if len(names) == len(masks):
        message = (
            "the masks of all training cameras are completely black in frame 0, so no pixel is "
            "left to train on: check the masks, in which white pixels are used"
        )
        raise UnusableCaptureError(message)
    if names:
        message = (
            f"the masks of {format_names(names)} are completely black in frame 0, so these cameras "
            "are not used there: check the masks, in which white pixels are used"
        )
        yield Finding("mask-black", message, names)


def find_faint_alpha(capture: Capture) -> Iterator[Finding]:
    """Yield a finding about cameras whose alpha in frame 0 is tiny, as in masks of 0 and 1.

    Raises:
        UnusableCaptureError: The alpha of all training cameras is tiny.
    """
    alphas = {name: capture.alpha(index, 0) for index, name in _name_used_cameras(capture)}
    largest = {name: int(alpha.max()) for name, alpha in alphas.items() if alpha is not None}
    names = tuple(name for name, level in largest.items() if 0 < level <= _MAX_FAINT_ALPHA)
    if not names:
        return
    message = (
        f"the masks or alpha channels of {format_names(names)} are almost black in frame 0 (at "
        f"most {max(largest[name] for name in names)} of 255), so these cameras see almost nothing "
        "of the subject: 255 stands for opaque"
    )
    if max(largest.values()) <= _MAX_FAINT_ALPHA:
        raise UnusableCaptureError(message)
    yield Finding("mask-black", message, names)


def _name_used_cameras(capture: Capture) -> Iterator[tuple[int, str]]:
    """Yield index and name of each training camera whose picture of frame 0 is used."""
    return ((index, capture.cameras[index].name) for index in capture.training_at(0))
