"""The decoder, which computes the state of every frame from the chunks of a stream.

`StreamDecoder` takes the chunks in order; an engine computes the states (SPEC 6, 7, 9).
`dequantize` converts the integers of a state to floats (SPEC 10). `quarc_ref.streams` reads
the chunks from bytes, files and URLs.

Neither this package nor `quarc_ref.format` imports torch, OpenCV or matplotlib.
"""

from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder

__all__ = ["Scene", "Splats", "StreamDecoder", "compute_digest", "dequantize"]
