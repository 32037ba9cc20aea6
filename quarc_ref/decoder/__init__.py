"""The reference decoder: bytes of a stream to integer scenes, and to floats.

    for scene in decode(data):
        splats = dequantize(scene)

Neither this package nor `quarc_ref.format` under it imports torch, OpenCV or
matplotlib.
"""

from quarc_ref.decoder.decode_stream import StreamDecoder, decode
from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.scene import Scene

__all__ = ["Scene", "Splats", "StreamDecoder", "compute_digest", "decode", "dequantize"]
