"""Writes malformed pictures and videos byte by byte."""

import struct
import zlib
from fractions import Fraction

import av
import numpy as np

_CONTAINER_BOXES = {b"moov", b"trak", b"mdia", b"minf", b"dinf", b"stbl"}
_FIXED_POINT_ONE = 1 << 16
_ALIAS = bytes.fromhex("616c6973")  # type of a data reference to a file: a QuickTime alias
_IDENTITY = (1, 0, 0, 1)
ORIENTATION = 0x0112

# The entries a, b, c, d of display matrices, by their effect on pictures (FFmpeg's `display.h`).
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
    """Return a PNG file of a black picture with one bit per pixel."""
    compressed_rows = zlib.compress(bytes(1 + (width + 7) // 8) * height, 9)
    header = struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0)
    chunks = [(b"IHDR", header), (b"IDAT", compressed_rows), (b"IEND", b"")]
    if exif is not None:
        chunks.insert(1, (b"eXIf", exif))
    return b"\x89PNG\r\n\x1a\n" + b"".join(_png_chunk(*chunk) for chunk in chunks)


def _png_chunk(chunk_type, payload):
    crc = zlib.crc32(chunk_type + payload)
    return struct.pack(">I", len(payload)) + chunk_type + payload + struct.pack(">I", crc)


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


def change_boxes(data, change_box):
    """Return an mp4 file whose boxes are changed by a function.

    Args:
        data: The file; its moov box is the last one.
        change_box: Function of type and payload of a box; returns the new payload, or None to
            remove the box.
    """
    new_data, position = b"", 0
    while position < len(data):
        length, box_type = struct.unpack_from(">I4s", data, position)
        payload = data[position + 8 : position + length]
        position += length
        if box_type in _CONTAINER_BOXES:
            payload = change_boxes(payload, change_box)
        new_payload = change_box(box_type, payload)
        if new_payload is not None:
            new_data += _box(box_type, new_payload)
    return new_data


def show_video(data, display):
    """Return an mp4 file whose display matrix is replaced by an entry of `MATRICES`."""
    stored_matrix, display_matrix = _pack_matrix(_IDENTITY), _pack_matrix(MATRICES[display])

    def change_box(box_type, payload):
        return payload.replace(stored_matrix, display_matrix) if box_type == b"tkhd" else payload

    return change_boxes(data, change_box)


def attach_picture(data, jpeg):
    """Return an mp4 file with a picture, such as a cover, that precedes its tracks."""
    handler = _box(b"hdlr", bytes(8) + b"mdirappl" + bytes(9))
    cover = _box(b"covr", _box(b"data", struct.pack(">II", 13, 0) + jpeg))
    attachment = _box(b"udta", _box(b"meta", bytes(4) + handler + _box(b"ilst", cover)))

    def change_box(box_type, payload):
        if box_type != b"moov":
            return payload
        header_end = payload.index(b"trak") - 4
        return payload[:header_end] + attachment + payload[header_end:]

    return change_boxes(data, change_box)


def _box(box_type, payload):
    return struct.pack(">I4s", len(payload) + 8, box_type) + payload


def _pack_matrix(numbers):
    a, b, c, d = (round(number * _FIXED_POINT_ONE) for number in numbers)
    return struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)


def reference_other_file(data, name):
    """Return an mp4 file with its frames in another file, referenced by a QuickTime alias."""
    volume_name, path = b"HD", f"HD:{name}".encode()
    path += b"\0" * (len(path) % 2)
    alias = bytearray(150)
    alias[10 : 11 + len(volume_name)] = bytes([len(volume_name)]) + volume_name
    alias[50 : 51 + len(name)] = bytes([len(name)]) + name.encode()
    alias[130:134] = struct.pack(
        ">HH", 1, 1
    )  # folder levels: one up from the mp4 file, then one down to the other file
    padded_alias = bytes(alias) + struct.pack(">HH", 2, len(path)) + path + b"\xff\xff\0\0"
    data_reference = struct.pack(">I4sI", len(padded_alias) + 12, _ALIAS, 0) + padded_alias

    def change_box(box_type, payload):
        return struct.pack(">II", 0, 1) + data_reference if box_type == b"dref" else payload

    return change_boxes(data, change_box)


def write_pngs_as_video(path, pngs, size):
    """Write PNG files as the frames of a mov file, whose header declares `size`."""
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
    """Write a video of gray frames with presentation times in milliseconds."""
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
