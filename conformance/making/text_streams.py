"""Makes the valid streams in streams/ that contain texts (SPEC 5.6, 5.7)."""

from making.payloads import Head, pack_camera, pack_cameras, pack_metadata
from making.scenes import make_cloud
from making.streams import Stream
from making.vectors import ValidStream, make_valid_stream


def make_metadata_stream() -> ValidStream:
    """Return a stream with several `came` and `meta` chunks."""
    camera = pack_camera()
    meta = pack_metadata(("title", "Große Straße \u0000 \ufeff 日本"), ("title", "again"), ("", ""))
    stream = Stream(Head()).add_chunk(b"meta", pack_metadata())
    stream.add_chunk(b"came", pack_cameras(camera, camera)).add_canonical(0, make_cloud(3))
    stream.add_chunk(b"meta", meta).add_chunk(b"came", pack_cameras()).add_frame()
    stream.add_chunk(b"came", pack_cameras(camera)).add_chunk(b"meta", meta).finish()
    note = "several `came` and `meta` chunks in different places; U+0000 and an empty key in `meta`"
    return make_valid_stream("streams/cameras-and-metadata", note, "5-4", stream)


def make_text_stream() -> ValidStream:
    """Return a stream with texts that begin with a byte order mark."""
    mark = "\ufeff"
    entries = (("settings", mark + '{"steps": 7}'), (mark, mark), ("title", "\uffff \U0010ffff"))
    stream = Stream(Head()).add_chunk(b"came", pack_cameras(pack_camera(mark.encode() + b"left")))
    stream.add_chunk(b"meta", pack_metadata(*entries)).add_canonical(0, make_cloud(2)).finish()
    note = "texts that begin with a byte order mark; the last characters of planes of Unicode"
    return make_valid_stream("streams/byte-order-marks", note, "5-4", stream)
