"""Reads, recovers, cuts and joins streams.

    for scene in decode(data):
        splats = dequantize(scene)

Functions take a stream as a bytes-like object or as a `Source`, which returns the bytes at an
offset. `open_source` opens a file, an HTTP URL or standard input. `recover` decodes damaged
streams.
"""

from quarc_ref.streams.decode_stream import decode
from quarc_ref.streams.follow import Follow
from quarc_ref.streams.recover import Gap, recover
from quarc_ref.streams.source import BytesSource, Source
from quarc_ref.streams.sources import FileSource, PipeSource, open_source

__all__ = [
    "BytesSource",
    "FileSource",
    "Follow",
    "Gap",
    "PipeSource",
    "Source",
    "decode",
    "open_source",
    "recover",
]
