"""The QuARC trainer: from a capture to a `.quarc` stream.

    with open("out.quarc", "wb") as sink:
        encode(open_capture("flame_steak"), sink, EncodeOptions(choose_preset("main")))

torch is loaded with the names below and not before: what writes a stream from
given records (`closed_loop`) does without it.
"""

import os
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quarc_ref.encoder.encode_options import EncodeOptions
    from quarc_ref.encoder.encode_stream import encode
    from quarc_ref.encoder.settings.presets import change_setting, choose_preset

__all__ = ["EncodeOptions", "change_setting", "choose_preset", "encode"]

# Threads that wait without spinning: on few cores, spinning starves the other pool.
# Must be set before torch loads its OpenMP.
if (os.cpu_count() or 1) <= 4:
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")


def __getattr__(name: str) -> Any:  # noqa: ANN401
    if name not in __all__:
        message = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(message)
    from quarc_ref.encoder import encode_stream
    from quarc_ref.encoder.settings import presets

    return getattr(encode_stream if hasattr(encode_stream, name) else presets, name)
