"""Writes the output of `render`: a video, pictures, or depth files with a description."""

import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from quarc_ref.cli.errors import UsageError
from quarc_ref.cli.targets import written_file, written_folder, written_frame

if TYPE_CHECKING:
    from quarc_ref.datasets.capture import Image
    from quarc_ref.datasets.video_writer import VideoFormat
    from quarc_ref.rendering.pipeline_data import Float32
    from quarc_ref.viewing.paths.pose import Shot

Kind = Literal["mp4", "webm", "png", "npz"]
Video = Literal["mp4", "webm"]
_VIDEO_SUFFIXES: dict[str, Video] = {".mp4": "mp4", ".webm": "webm"}
_ONE_PICTURE = ".png"
_SIDECAR = "depth.json"
_SCHEMA = "depth/1"


def choose_kind(output: Path, *, depth: bool) -> Kind:
    """Choose the type of output by the suffix of the output path.

    Raises:
        UsageError: The suffix does not determine a type.
    """
    suffix = output.suffix.lower()
    video = _VIDEO_SUFFIXES.get(suffix)
    if video and not depth:
        return video
    if suffix not in ("", _ONE_PICTURE) or (depth and suffix):
        message = (
            f"the output type is not clear from the name {output}: use the suffix .mp4 or "
            ".webm for a video, .png for one frame, no suffix for a folder of files (the "
            "only choice with --depth), or choose the type with --to"
        )
        raise UsageError(message)
    return "png"


def write_video(
    drawn: "Iterator[tuple[int, Image]]", output: Path, form: "VideoFormat", *, force: bool
) -> dict[str, object]:
    """Write pictures as a video, and return the values that `--json` prints."""
    from quarc_ref.datasets.video_writer import write_video_file

    with written_file(output, force=force) as sink:
        count = write_video_file(sink, (picture for _, picture in drawn), form)
    return {"file": str(output), "frames": count, "bytes": output.stat().st_size}


def write_pictures(
    drawn: "Iterator[tuple[int, Image]]", output: Path, *, force: bool
) -> dict[str, object]:
    """Write pictures as PNG files, and return the values that `--json` prints."""
    from quarc_ref.datasets.video_writer import build_png

    one = output.suffix.lower() == _ONE_PICTURE
    with (written_frame if one else written_folder)(output, force=force) as target:
        names = [
            target.write(f"frame_{number:04}.png", build_png(picture)).name
            for number, picture in drawn
        ]
    folder = output.parent if one else output
    return {"folder": str(folder), "frames": len(names), "files": names}


def write_depths(
    drawn: "Iterator[tuple[Shot, tuple[Float32, Float32]]]",
    output: Path,
    kind: Kind,
    *,
    force: bool,
) -> dict[str, object]:
    """Write depth as 16-bit PNG files or NumPy archives, and `depth.json`, which describes them.

    Args:
        drawn: Shots in order, each with `[H, W]` depth in world units and `[H, W]` opacity.
        output: Path of the folder.
        kind: `png` or `npz`.
        force: Whether to replace a folder that quarc-ref created.
    """
    from quarc_ref.datasets.video_writer import build_depth_png
    from quarc_ref.viewing.depth_levels import quantize_depth

    files: list[dict[str, object]] = []
    with written_folder(output, force=force) as target:
        for number, (shot, (depth, opacity)) in enumerate(drawn):
            name = f"depth_{number:04}.{kind}"
            found: dict[str, object] = {}
            if kind == "npz":
                data = _build_archive(depth, opacity)
            else:
                levels, found["scale"] = quantize_depth(depth, opacity)
                data = build_depth_png(levels)
            target.write(name, data)
            files.append({"file": name, "frame": shot.frame, **found, "camera": _describe(shot)})
        sidecar = {"schema": f"quarc-ref/{_SCHEMA}", "files": files}
        target.write(_SIDECAR, (json.dumps(sidecar, indent=2) + "\n").encode())
    names = [*(str(each["file"]) for each in files), _SIDECAR]
    return {"folder": str(output), "frames": len(files), "files": names}


def _build_archive(depth: "Float32", opacity: "Float32") -> bytes:
    import numpy as np

    buffer = io.BytesIO()
    np.savez_compressed(buffer, depth=depth, opacity=opacity)
    return buffer.getvalue()


def _describe(shot: "Shot") -> dict[str, Any]:
    camera = shot.camera
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
