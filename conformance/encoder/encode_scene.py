"""Makes the reference encoder testable by conformance/run.py: `encode_scene.py SCENE OUTPUT`.

The Gaussians come from the scene file instead of from training. Quantization, entropy coding and
the closed loop are those of quarc_ref.
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

# Maximum error of rounding a number whose magnitude is below 16 to binary32.
_MAX_ROUNDING_ERROR = 2.0**-20


def main() -> int:
    """Encode a scene to a stream, and print the declarations that RUNNER.md requires."""
    scene = json.loads(Path(sys.argv[1]).read_text("utf-8"))
    header = StreamHeader(**scene["header"])
    with Path(sys.argv[2]).open("wb") as sink:
        closed_loop = ClosedLoop(sink, header, (), {})
        _print_digest(
            closed_loop.commit_canonical(
                quantize_gaussians(_make_attributes(scene["canonical"]), header), 0
            )
        )
        for frame in scene["frames"]:
            frame_start = closed_loop.start_frame(0)
            moved_frame = closed_loop.move_frame(
                frame_start, _make_shift_symbols(frame_start.state, frame.get("shift", (0, 0, 0)))
            )
            _print_digest(
                closed_loop.commit_frame(
                    moved_frame, _make_births(moved_frame.state, frame.get("births", []))
                )
            )
        closed_loop.finish()
    print(json.dumps({"level": header.level, "bounds": _compute_bounds(header)}))
    return 0


def _make_attributes(gaussians: list[dict[str, Any]]) -> Attributes:
    def stack_field(name: str) -> torch.Tensor:
        return torch.tensor([gaussian[name] for gaussian in gaussians], dtype=torch.float32)

    sh_coefficients = (stack_field("sh_dc")[:, None], stack_field("sh_rest").reshape(-1, 3, 3))
    opacities = stack_field("opacity")[:, 0]
    return Attributes(
        stack_field("position"),
        stack_field("rotation"),
        stack_field("log_scales"),
        opacities,
        *sh_coefficients,
    )


def _make_shift_symbols(state: State, shift: tuple[float, float, float]) -> list[Int64]:
    """Return symbols that shift all Gaussians by moving the anchors of the coarsest level."""
    header = state.scene.header
    step = header.translation_step * 2.0**-header.lattice_exponent
    levels = state.required_anchors.levels
    symbols = [np.zeros((header.symbol_planes, level.owners.size), np.int64) for level in levels]
    symbols[-1][:3] = np.rint(np.array(shift) / step).astype(np.int64)[:, None]
    return symbols


def _make_births(state: State, gaussians: list[dict[str, Any]]) -> Births | None:
    if not gaussians:
        return None
    parents = np.zeros(len(gaussians), dtype=np.int64)
    return quantize_births(_make_attributes(gaussians), parents, state.scene)


def _compute_bounds(header: StreamHeader) -> dict[str, float]:
    """Return the maximum error of each field, including errors from rounding to binary32."""
    lattice_unit = 2.0**-header.lattice_exponent
    return {
        "position": header.position_step * lattice_unit / 2 + _MAX_ROUNDING_ERROR,
        "rotation": 2.0**-header.rotation_bits,
        "log_scales": header.log_scale_step / 2 + _MAX_ROUNDING_ERROR,
        "opacity": header.opacity_step / 2 + _MAX_ROUNDING_ERROR,
        "sh_dc": header.sh_dc_step / 2 + _MAX_ROUNDING_ERROR,
        "sh_rest": header.sh_rest_step / 2 + _MAX_ROUNDING_ERROR,
        "shift": header.translation_step * lattice_unit / 2 + _MAX_ROUNDING_ERROR,
    }


def _print_digest(state: State) -> None:
    print(json.dumps({"frame": state.scene.frame, "sha256": compute_digest(state.scene)}))


if __name__ == "__main__":
    sys.exit(main())
