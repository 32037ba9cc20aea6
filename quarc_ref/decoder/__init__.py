"""The reference decoder: from the chunks of a stream to states of frames (SPEC 6, 7, 9, 10).

`StreamDecoder` takes chunks and returns the state of every frame, which an engine
computes. `dequantize` converts the integers of a state to floats. `quarc_ref.streams`
reads bytes, files and URLs.

Neither this package nor `quarc_ref.format` imports torch, OpenCV or matplotlib.
"""

from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder

__all__ = ["Scene", "Splats", "StreamDecoder", "compute_digest", "dequantize"]
