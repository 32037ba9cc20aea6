"""Wraps the reference encoder in the runner's interface: `encode_scene.py SCENE OUTPUT`.

The scene takes the place of a trained one; quantization, coding and the closed loop are those of
the package.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import torch

from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.state import State
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.training.quantize import quantize_births, quantize_gaussians
from quarc_ref.encoder.training.trainable import Attributes
from quarc_ref.format.arrays import Int64
from quarc_ref.format.records import Births, StreamHeader

# A binary32 of magnitude below 16, and one rounding of a product.
_ROUNDING = 2.0**-20


def main() -> int:
    """Write the stream of a scene, and print its declarations."""
    scene = json.loads(Path(sys.argv[1]).read_text("utf-8"))
    header = StreamHeader(**scene["header"])
    with Path(sys.argv[2]).open("wb") as sink:
        loop = ClosedLoop(sink, header, (), {})
        _print_digest(
            loop.commit_canonical(quantize_gaussians(_attributes(scene["canonical"]), header), 0)
        )
        for frame in scene["frames"]:
            start = loop.start_frame(0)
            moved = loop.move_frame(start, _shift(start.state, frame.get("shift", (0, 0, 0))))
            _print_digest(loop.commit_frame(moved, _births(moved.state, frame.get("births", []))))
        loop.finish()
    print(json.dumps({"level": header.level, "bounds": _bounds(header)}))
    return 0


def _attributes(gaussians: list[dict[str, Any]]) -> Attributes:
    def column(name: str) -> torch.Tensor:
        return torch.tensor([gaussian[name] for gaussian in gaussians], dtype=torch.float32)

    colors = (column("sh_dc")[:, None], column("sh_rest").reshape(-1, 3, 3))
    opacities = column("opacity")[:, 0]
    return Attributes(
        column("position"), column("rotation"), column("log_scales"), opacities, *colors
    )


def _shift(state: State, shift: tuple[float, float, float]) -> list[Int64]:
    """Symbols with which the anchors of the coarsest level move everything."""
    header = state.scene.header
    step = header.translation_step * 2.0**-header.lattice_exponent
    levels = state.known_anchors.levels
    symbols = [np.zeros((header.symbol_planes, level.owners.size), np.int64) for level in levels]
    symbols[-1][:3] = np.rint(np.array(shift) / step).astype(np.int64)[:, None]
    return symbols


def _births(state: State, gaussians: list[dict[str, Any]]) -> Births | None:
    if not gaussians:
        return None
    parents = np.zeros(len(gaussians), dtype=np.int64)
    return quantize_births(_attributes(gaussians), parents, state.scene)


def _bounds(header: StreamHeader) -> dict[str, float]:
    """Maximum error of a number: half a step, and rounding errors."""
    unit = 2.0**-header.lattice_exponent
    return {
        "position": header.position_step * unit / 2 + _ROUNDING,
        "rotation": 2.0**-header.rotation_bits,
        "log_scales": header.log_scale_step / 2 + _ROUNDING,
        "opacity": header.opacity_step / 2 + _ROUNDING,
        "sh_dc": header.sh_dc_step / 2 + _ROUNDING,
        "sh_rest": header.sh_rest_step / 2 + _ROUNDING,
        "shift": header.translation_step * unit / 2 + _ROUNDING,
    }


def _print_digest(state: State) -> None:
    print(json.dumps({"frame": state.scene.frame, "sha256": compute_digest(state.scene)}))


if __name__ == "__main__":
    sys.exit(main())
