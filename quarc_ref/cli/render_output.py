"""Writes the output of `render`: a video, pictures, or depth files with a description."""

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.targets import open_output_file, open_output_frame, written_folder

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Image
    from quarc_ref.datasets.video_writer import VideoFormat
    from quarc_ref.rendering.pipeline_data import Float32
    from quarc_ref.viewing.paths.pose import PlannedPicture

OutputKind = Literal["mp4", "webm", "png", "npz"]
VideoContainer = Literal["mp4", "webm"]
_VIDEO_SUFFIXES: dict[str, VideoContainer] = {".mp4": "mp4", ".webm": "webm"}
_PICTURE_SUFFIX = ".png"
_KIND_BY_SUFFIX: dict[str, OutputKind] = {**_VIDEO_SUFFIXES, _PICTURE_SUFFIX: "png"}
_SIDECAR_NAME = "depth.json"
_SIDECAR_SCHEMA = "depth/1"


def choose_output_kind(output: Path, to: OutputKind | None, *, depth: bool) -> OutputKind:
    """Return the type of output that `--to` or the suffix of the output path selects.

    Raises:
        UsageError: The suffix does not determine a type, or is that of another type than `--to`.
    """
    suffix = output.suffix.lower()
    if to is not None:
        if _KIND_BY_SUFFIX.get(suffix, to) != to:
            message = f"the suffix of {output} conflicts with --to {to}: change one of them"
            raise UsageError(message)
        return to
    video_container = _VIDEO_SUFFIXES.get(suffix)
    if video_container and not depth:
        return video_container
    if depth and suffix:
        message = (
            f"{output} must be a folder for --depth, but its name has the suffix of a file: choose "
            f"a name without {suffix}"
        )
        raise UsageError(message)
    if suffix not in ("", _PICTURE_SUFFIX):
        message = (
            f"the output type is not clear from the name {output}: use the suffix .mp4 or "
            ".webm for a video, .png for one frame, or no suffix for a folder of files; or "
            "choose the type with --to"
        )
        raise UsageError(message)
    return "png"


def write_video(
    pictures: "Iterator[tuple[int, Image]]",
    output: Path,
    video_format: "VideoFormat",
    *,
    force: bool,
) -> dict[str, object]:
    """Write pictures as a video, and return the values that `--json` prints."""
    from quarc_ref.datasets.video_writer import write_video_file

    with open_output_file(output, force=force) as sink:
        count = write_video_file(sink, (picture for _, picture in pictures), video_format)
    return {"file": str(output), "frames": count, "bytes": output.stat().st_size}


def write_pictures(
    pictures: "Iterator[tuple[int, Image]]", output: Path, *, force: bool
) -> dict[str, object]:
    """Write pictures as PNG files, and return the values that `--json` prints."""
    from quarc_ref.datasets.video_writer import build_png

    is_single_file = output.suffix.lower() == _PICTURE_SUFFIX
    with (open_output_frame if is_single_file else written_folder)(output, force=force) as target:
        names = [
            target.write(f"frame_{number:04}.png", build_png(picture)).name
            for number, picture in pictures
        ]
    folder = output.parent if is_single_file else output
    return {"folder": str(folder), "frames": len(names), "files": names}


def write_depths(
    rendered_pictures: "Iterator[tuple[PlannedPicture, tuple[Float32, Float32]]]",
    output: Path,
    kind: OutputKind,
    *,
    force: bool,
) -> dict[str, object]:
    """Write depths as 16-bit PNG files or NumPy archives, and a `depth.json` that describes them.

    Args:
        rendered_pictures: Planned pictures in order, each with its depth `[H, W]` in world units
            and its opacity `[H, W]`.
        output: Path of the folder.
        kind: `png` or `npz`.
        force: Whether to replace a folder that quarc-ref created.
    """
    from quarc_ref.datasets.video_writer import build_depth_png
    from quarc_ref.viewing.depth_levels import quantize_depth

    files: list[dict[str, object]] = []
    with written_folder(output, force=force) as target:
        for number, (planned, (depth, opacity)) in enumerate(rendered_pictures):
            name = f"depth_{number:04}.{kind}"
            scale_entry: dict[str, object] = {}
            if kind == "npz":
                data = _build_archive(depth, opacity)
            else:
                levels, scale_entry["scale"] = quantize_depth(depth, opacity)
                data = build_depth_png(levels)
            target.write(name, data)
            files.append(
                {
                    "file": name,
                    "frame": planned.frame,
                    **scale_entry,
                    "camera": _describe_camera(planned),
                }
            )
        sidecar = {"schema": f"quarc-ref/{_SIDECAR_SCHEMA}", "files": files}
        target.write(_SIDECAR_NAME, (json.dumps(sidecar, indent=2) + "\n").encode())
    names = [*(str(entry["file"]) for entry in files), _SIDECAR_NAME]
    return {"folder": str(output), "frames": len(files), "files": names}


def _build_archive(depth: "Float32", opacity: "Float32") -> bytes:
    import numpy as np

    buffer = io.BytesIO()
    np.savez_compressed(buffer, depth=depth, opacity=opacity)
    return buffer.getvalue()


def _describe_camera(planned: "PlannedPicture") -> dict[str, Any]:
    camera = planned.camera
    return {
        "name": camera.name,
        "width": camera.width,
        "height": camera.height,
        "fx": camera.fx,
        "fy": camera.fy,
        "cx": camera.cx,
        "cy": camera.cy,
        "rotation": list(camera.rotation),
        "translation": list(camera.translation),
    }
