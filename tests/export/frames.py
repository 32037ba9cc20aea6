"""A decoded frame, the input of exporters."""

from quarc_ref.decoder import Scene, Splats, dequantize
from quarc_ref.format.records import StreamHeader
from tests.small_streams import make_stream


def make_frame(degree: int) -> tuple[Scene, Splats]:
    """Return the last frame of a small stream, which includes births."""
    _, states = make_stream(StreamHeader(seed=7, gaussians_per_anchor=4, sh_degree=degree))
    return states[-1].scene, dequantize(states[-1].scene)
