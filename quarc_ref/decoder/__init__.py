"""The reference decoder's state: what SPEC 6, 7, 9 and 10 make of a stream's chunks.

`StreamDecoder` takes chunks and returns the state of every frame, which an engine computes.
`dequantize` turns their integers into floats. Bytes, files and URLs are read in
`quarc_ref.streams`.

Neither this package nor `quarc_ref.format` under it imports torch, OpenCV or
matplotlib.
"""

from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.stream_decoder import StreamDecoder

__all__ = ["Scene", "Splats", "StreamDecoder", "compute_digest", "dequantize"]
