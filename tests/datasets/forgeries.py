"""Forged pictures and videos, byte by byte."""

import struct
import zlib
from fractions import Fraction

import av
import numpy as np

_CONTAINER_BOXES = {b"moov", b"trak", b"mdia", b"minf", b"dinf", b"stbl"}
_FIXED_POINT_ONE = 1 << 16
_ALIAS = bytes.fromhex("616c6973")  # the kind of an alias, four letters
_IDENTITY = (1, 0, 0, 1)
ORIENTATION = 0x0112

# Display matrices by the way in which pictures are shown: a, b, c, d of FFmpeg's `display.h`.
MATRICES = {
    "as stored": _IDENTITY,
    "90 clockwise": (0, 1, -1, 0),
    "half a turn": (-1, 0, 0, -1),
    "90 counterclockwise": (0, -1, 1, 0),
    "mirrored": (-1, 0, 0, 1),
    "upside down in a mirror": (1, 0, 0, -1),
    "transposed": (0, 1, 1, 0),
    "45 clockwise": (0.5**0.5, 0.5**0.5, -(0.5**0.5), 0.5**0.5),
}


def forge_png(width, height, exif=None):
    """Return a black picture with one bit per pixel, in a small file."""
    lines = zlib.compress(bytes(1 + (width + 7) // 8) * height, 9)
    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", lines), (b"IEND", b"")]
    if exif is not None:
        chunks.insert(1, (b"eXIf", exif))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_png_chunk(*chunk) for chunk in chunks)


def _png_chunk(kind, payload):
    crc = zlib.crc32(kind + payload)
    return struct.pack(">I", len(payload)) + kind + payload + struct.pack(">I", crc)


def forge_exif(orientation, order="<"):
    """Return an EXIF block with a maker's name followed by an orientation."""
    signature = {"<": b"II*\0", ">": b"MM\0*"}[order]
    entries = struct.pack(f"{order}HHI4s", 0x010F, 2, 4, b"abc")
    entries += struct.pack(f"{order}HHIHH", ORIENTATION, 3, 1, orientation, 0)
    return signature + struct.pack(f"{order}IH", 8, 2) + entries + bytes(4)


def add_exif(jpeg, exif):
    """Return a JPEG file with an inserted EXIF block."""
    block = b"Exif\0\0" + exif
    return jpeg[:2] + b"\xff\xe1" + struct.pack(">H", len(block) + 2) + block + jpeg[2:]


def change_boxes(data, change):
    """Return an mp4 file with boxes changed by a function.

    Args:
        data: The file; its moov box is the last one.
        change: Returns the new payload for kind and payload, or None to remove the box.
    """
    made, position = b"", 0
    while position < len(data):
        length, kind = struct.unpack_from(">I4s", data, position)
        payload = data[position + 8 : position + length]
        position += length
        if kind in _CONTAINER_BOXES:
            payload = change_boxes(payload, change)
        new_payload = change(kind, payload)
        if new_payload is not None:
            made += struct.pack(">I4s", len(new_payload) + 8, kind) + new_payload
    return made


def show_video(data, display):
    """Return an mp4 file with a display matrix of `MATRICES`."""
    stored, shown = _pack_matrix(_IDENTITY), _pack_matrix(MATRICES[display])

    def change(kind, payload):
        return payload.replace(stored, shown) if kind == b"tkhd" else payload

    return change_boxes(data, change)


def _pack_matrix(numbers):
    a, b, c, d = (round(number * _FIXED_POINT_ONE) for number in numbers)
    return struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)


def reference_other_file(data, name):
    """Return an mp4 file with its frames in another file, referenced by a QuickTime alias."""
    volume, path = b"HD", f"HD:{name}".encode()
    path += b"\0" * (len(path) % 2)
    alias = bytearray(150)
    alias[10 : 11 + len(volume)] = bytes([len(volume)]) + volume
    alias[50 : 51 + len(name)] = bytes([len(name)]) + name.encode()
    alias[130:134] = struct.pack(">HH", 1, 1)  # a level up from here, a level down to it
    record = bytes(alias) + struct.pack(">HH", 2, len(path)) + path + b"\xff\xff\0\0"
    entry = struct.pack(">I4sI", len(record) + 12, _ALIAS, 0) + record

    def change(kind, payload):
        return struct.pack(">II", 0, 1) + entry if kind == b"dref" else payload

    return change_boxes(data, change)


def write_pngs_as_video(path, pngs, size):
    """Write PNG files as the frames of a mov file with a wrong stated size."""
    with av.open(str(path), "w", format="mov") as container:
        stream = container.add_stream("png", rate=30)
        stream.width, stream.height = size
        stream.pix_fmt = "gray"
        for index, data in enumerate(pngs):
            packet = av.Packet(data)
            packet.pts = packet.dts = index
            packet.time_base, packet.stream = Fraction(1, 30), stream
            packet.is_keyframe = True
            container.mux(packet)


def write_timed_video(path, milliseconds, rate=30):
    """Write a video of gray frames with given times."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=rate)
        stream.width, stream.height, stream.pix_fmt = 48, 32, "yuv420p"
        stream.codec_context.time_base = Fraction(1, 1000)
        for frame_time in milliseconds:
            picture = np.full((32, 48, 3), frame_time % 256, np.uint8)
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            frame.pts, frame.time_base = frame_time, Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
