"""Finds cameras whose poses do not fit their pictures, by means of the initial points."""

from collections.abc import Iterator, Sequence

from quarc_ref.datasets.capture import Capture
from quarc_ref.datasets.findings import Finding, format_names
from quarc_ref.datasets.subject_points import find_covered_pixels, find_transparent_points
from quarc_ref.encoder.checks.color_agreement import compare_colors
from quarc_ref.encoder.checks.projected_points import ProjectedPoints, read_first_frame

MIN_TRAINING_CAMERAS = 2
_MAX_TRANSPARENT_SHARE = 0.5


def find_wrong_poses(capture: Capture, projected: ProjectedPoints) -> Iterator[Finding]:
    """Yield findings about cameras whose pictures do not show the points where their poses say.

    Args:
        capture: The capture; its held-out cameras are not read.
        projected: The initial points.

    Raises:
        CaptureError: A picture or its alpha cannot be read.
    """
    if capture.alphas is not None:  # its points may be inside the subject, and have no color
        yield from _find_wrong_silhouettes(capture, projected)
        return
    disagreement = compare_colors(
        projected.cameras, projected.projections, projected.colors, read_first_frame(capture)
    )
    if disagreement.mixed_up_pairs:
        descriptions = [
            f"{projected.cameras[picture].name} fits the pose of {projected.cameras[pose].name}"
            for picture, pose in disagreement.mixed_up_pairs
        ]
        message = (
            "some pictures fit the pose of another camera better than their own "
            f"({format_names(descriptions)}), so pictures and poses are probably mixed up: check "
            "the order of the poses"
        )
        yield Finding(
            "poses-mixed-up",
            message,
            projected.name_cameras([i for i, _ in disagreement.mixed_up_pairs]),
        )
    wrong_cameras = [i for i in disagreement.wrong_cameras if not projected.is_blank[i]]
    if wrong_cameras:
        names = projected.name_cameras(wrong_cameras)
        message = (
            f"the pictures of {format_names(names)} do not show the initial points at the "
            "pixels that their poses predict. If other cameras are fine, these poses are wrong: "
            "calibrate again with more matches (calibrate --moments 16), or check that pose, "
            "intrinsics and picture belong to the same camera. If many cameras are listed, the "
            "points probably belong to another scene or time, or all poses have the axes of "
            f"another convention{_suggest_holding_out(capture, names)}"
        )
        yield Finding("pose-disagrees", message, names)


def _find_wrong_silhouettes(capture: Capture, projected: ProjectedPoints) -> Iterator[Finding]:
    """Yield a finding about cameras that see most points of the subject as transparent."""
    full_capture, wrong_cameras = capture.full_capture, []
    for position, index in enumerate(full_capture.training_at(0)):
        projection, alpha = projected.projections[position], full_capture.alpha(index, 0)
        view_count = int(projection.is_visible.sum())
        if alpha is not None and view_count:
            is_transparent = find_transparent_points(projection, find_covered_pixels(alpha))
            transparent_count = int(is_transparent.sum())
            if transparent_count > _MAX_TRANSPARENT_SHARE * view_count:
                wrong_cameras.append(position)
    if wrong_cameras:
        names = projected.name_cameras(wrong_cameras)
        message = (
            f"the masks or alpha channels of {format_names(names)} do not show the subject where "
            "the other cameras see it: check the poses and masks of these cameras"
            f"{_suggest_holding_out(capture, names)}"
        )
        yield Finding("pose-disagrees", message, names)


def _suggest_holding_out(capture: Capture, names: Sequence[str]) -> str:
    """Return advice to exclude training cameras; empty if too few others would be left."""
    if len(capture.training) - len(names) < MIN_TRAINING_CAMERAS:
        return ""
    held_out = [capture.cameras[index].name for index in capture.held_out]
    options = " ".join(f"--held-out {name}" for name in [*held_out, *names])
    return f". To exclude these cameras from training, use {options}"
