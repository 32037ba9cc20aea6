"""The reference decoder: bytes of a stream to integer scenes, and to floats.

    for scene in decode(data):
        splats = dequantize(scene)

A stream is bytes, or a `Source` that reads at an offset: `open_source` opens
a file, an HTTP URL or standard input. `recover` decodes past damage, `Player`
decodes ahead.

Neither this package nor `quarc_ref.format` under it imports torch, OpenCV or
matplotlib.
"""

from quarc_ref.decoder.decode_stream import decode
from quarc_ref.decoder.dequantize import Splats, dequantize
from quarc_ref.decoder.digest import compute_digest
from quarc_ref.decoder.follow import Follow
from quarc_ref.decoder.frame_maker import Frame
from quarc_ref.decoder.player import Player
from quarc_ref.decoder.recover import Gap, recover
from quarc_ref.decoder.scene import Scene
from quarc_ref.decoder.sources import FileSource, PipeSource, open_source
from quarc_ref.decoder.stream_decoder import StreamDecoder
from quarc_ref.format.source import BytesSource, Source

__all__ = [
    "BytesSource",
    "FileSource",
    "Follow",
    "Frame",
    "Gap",
    "PipeSource",
    "Player",
    "Scene",
    "Source",
    "Splats",
    "StreamDecoder",
    "compute_digest",
    "decode",
    "dequantize",
    "open_source",
    "recover",
]
