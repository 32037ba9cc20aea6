"""What exported frames do not say of themselves: `sequence.json`, beside them."""

import json
from dataclasses import asdict
from typing import Any

from quarc_ref.export.clip import Clip

NAME = "sequence.json"


def build_sidecar(clip: Clip, pattern: str, first_frame: int) -> bytes:
    """Return the bytes of the file: rate, axes, scale, cameras and metadata of a stream.

    Args:
        clip: What holds for all frames.
        pattern: Names of the frames' files, `{frame}` standing for the ordinal.
        first_frame: Ordinal of the first frame.
    """
    header = clip.header
    told: dict[str, Any] = {
        "schema": "quarc-ref/sequence/1",
        "files": pattern,
        "first_frame": first_frame,
        "frames_per_second": header.frames_per_second,
        "timescale": header.timescale,
        "frame_ticks": header.frame_ticks,
        "up": clip.up,
        "up_is_known": clip.knows_up,
        "right_handed": bool(header.right_handed),
        "meters_per_unit": header.meters_per_unit or None,
        "sh_degree": header.sh_degree,
        "cameras": [asdict(camera) for camera in clip.cameras],
        "metadata": clip.metadata,
    }
    return (json.dumps(told, indent=2) + "\n").encode()
