"""The QuARC encoder, which trains Gaussians on a capture and writes a `.quarc` stream.

    with open("out.quarc", "wb") as sink:
        encode(open_capture("flame_steak"), sink, EncodeOptions(choose_preset("main")))

`encode_scenes` encodes Gaussians that another method has trained, and needs neither pictures
nor torch:

    report = encode_scenes(frames, sink, SceneOptions(frames_per_second=30))

Names are imported on first use, so that importing this package does not load torch.
`closed_loop`, which writes a stream from quantized Gaussians, does not need torch either.
"""

import os
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quarc_ref.encoder.encode_options import EncodeOptions
    from quarc_ref.encoder.encode_stream import encode
    from quarc_ref.encoder.scenes.encode_scenes import (
        GivenFrame,
        SceneOptions,
        SceneReport,
        encode_scenes,
    )
    from quarc_ref.encoder.settings.presets import change_setting, choose_preset

__all__ = [
    "EncodeOptions",
    "GivenFrame",
    "SceneOptions",
    "SceneReport",
    "change_setting",
    "choose_preset",
    "encode",
    "encode_scenes",
]
_MODULES = {
    "EncodeOptions": "encode_options",
    "GivenFrame": "scenes.encode_scenes",
    "SceneOptions": "scenes.encode_scenes",
    "SceneReport": "scenes.encode_scenes",
    "change_setting": "settings.presets",
    "choose_preset": "settings.presets",
    "encode": "encode_stream",
    "encode_scenes": "scenes.encode_scenes",
}

# On few cores, threads that spin while they wait slow down the other thread pool.
# OpenMP reads this variable when torch loads it.
if (os.cpu_count() or 1) <= 4:
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name not in __all__:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    return getattr(import_module(f"quarc_ref.encoder.{_MODULES[name]}"), name)
