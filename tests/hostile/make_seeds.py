"""Makes the seeds of fuzzing: tiny streams and files of every layout.

    python -m tests.hostile.make_seeds

This command writes the seeds to the folder of the committed seeds; a test compares both.
Seeds are as small as possible, so most mutations have an effect, and mutants decode quickly.
"""

import io
import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from quarc_ref.decoder import Splats
from quarc_ref.decoder.engine import REFERENCE
from quarc_ref.decoder.engines import use_engine
from quarc_ref.decoder.frames import decode_motion
from quarc_ref.decoder.reconstruct import begin_frame
from quarc_ref.encoder.closed_loop import ClosedLoop
from quarc_ref.encoder.resume.array_file import write_arrays
from quarc_ref.export.clip import Clip, Frame
from quarc_ref.export.fourdgs_file import SequenceExporter
from quarc_ref.export.gaussian_ply import build_ply
from quarc_ref.export.sidecar import build_sidecar
from quarc_ref.files.marker import append_line, begin_marker
from quarc_ref.format import container, wire
from quarc_ref.format.coding.gaussian_planes import write_births
from quarc_ref.format.records import SH_DC, Births, StreamHeader
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.decode_stream import decode_states
from tests.datasets import forgeries, scenes
from tests.small_streams import (
    CAMERA,
    make_births,
    make_gaussians,
    make_symbols,
    make_updates,
    rebuild_stream,
)

_SPZ_HEADER = b"NGSP" + bytes([4, 0, 0, 0, 2, 0, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0])

FOLDER = Path(__file__).parent / "seeds"

_TINY_HEADER = StreamHeader(sh_degree=0, level_count=1, gaussians_per_anchor=2, rotation_bits=4)
_FULL_HEADER = StreamHeader(rotation_components=4, gaussians_per_anchor=1, full_crc_interval=2)


def _make_stream(
    header: StreamHeader,
    count: int,
    frames: int,
    *,
    births: int = 0,
    canonical_every: int = 99,
    snapshot_every: int = 99,
) -> bytes:
    sink = io.BytesIO()
    loop = ClosedLoop(sink, header, (CAMERA,), {"title": "seed"})
    loop.commit_canonical(make_gaussians(header, count), frame=0)
    for frame in range(1, frames):
        start = loop.start_frame(min(1, loop.state.scene.count - 1))
        updates = make_updates(start.state, frame, share=0.8) if header.updates else None
        moved = loop.move_frame(start, make_symbols(start.state, frame, share=0.8), updates)
        newborn = make_births(moved.state, births, frame) if births else None
        if frame % canonical_every == 0:
            loop.commit_as_canonical(moved, newborn)
        elif frame % snapshot_every == 0:
            loop.commit_as_snapshot(moved, newborn)
        else:
            loop.commit_frame(moved, newborn)
    loop.finish()
    return sink.getvalue()


def _make_fourdgs(clip: Clip) -> bytes:
    sequence = SequenceExporter(clip)
    for state in decode_states(_make_stream(_TINY_HEADER, 4, 3, births=1)):
        sequence.add(Frame.from_scene(state.scene))
    return sequence.finish()


_CAMERA_PATH = b'{"schema": "quarc-ref/camera-path/1", "keyframes": [%s, %s]}'
_CAMERA_KEYFRAME = b'{"time": %d, "camera": "cam00", "frame": 1}'
_POSE_KEYFRAME = (
    b'{"time": 1.5, "position": [1, -2, 0.5], "target": [0, 0, 0], "up": [0, 0, 1], "fov": 40}'
)


def _make_splats(coefficients: int) -> Splats:
    """Return two Gaussians with a given number of SH coefficients."""
    rows = np.arange(6, dtype=np.float32).reshape(2, 3)
    rotations = np.array([[1, 0, 0, 0], [0, 0.6, 0.8, 0]], dtype=np.float32)
    sh = np.arange(6 * coefficients, dtype=np.float32).reshape(2, coefficients, 3) / 8
    return Splats(rows, rotations, -rows, rows[:, 0], sh)


def _strip_stream(stream: bytes) -> bytes:
    """Reduce a stream to HEAD, CANO, FRAM and a TAIL without an index."""
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(stream)]
    kept_chunks = [entry for entry in chunks if entry[0] in (b"HEAD", b"CANO", b"FRAM")]
    canonical = sum(kind == container.CANO for kind, _ in kept_chunks)
    totals = (len(kept_chunks) - 1, canonical, 0)
    tail = b"".join(
        value.to_bytes(size, "little") for value, size in zip(totals, (4, 4, 8), strict=True)
    )
    return rebuild_stream([*kept_chunks, (container.TAIL, tail)])


def _add_unknown_chunks(stream: bytes) -> bytes:
    """Add an ancillary chunk of an unknown type after HEAD and before TAIL."""
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(stream)]
    head, frames = chunks[0], [entry for entry in chunks[1:] if entry[0] in (b"CANO", b"FRAM")]
    tail = len(frames).to_bytes(4, "little") + (1).to_bytes(4, "little") + bytes(8)
    unknown_chunk = (b"nOte", b"seed")
    return rebuild_stream([head, unknown_chunk, *frames, unknown_chunk, (container.TAIL, tail)])


def iterate_streams() -> Iterator[tuple[str, bytes]]:
    """Yield name and bytes of every stream."""
    yield (
        "empty",
        rebuild_stream([(b"HEAD", _make_head_payload(_TINY_HEADER)), (b"TAIL", bytes(16))]),
    )
    yield "still", _strip_stream(_make_stream(_TINY_HEADER, 1, 1))
    yield "moved", _strip_stream(_make_stream(_TINY_HEADER, 2, 2))
    yield "deaths", _strip_stream(_make_stream(replace(_TINY_HEADER, level_count=2), 4, 2))
    yield (
        "births",
        _strip_stream(_make_stream(replace(_TINY_HEADER, resample_interval=1), 2, 3, births=1)),
    )
    yield "full", _strip_stream(_make_stream(_FULL_HEADER, 5, 3, births=2))
    yield "cut_in_two", _make_stream(_TINY_HEADER, 2, 3, canonical_every=2)
    update_head, snapshot_head = (
        replace(_TINY_HEADER, updates=True),
        replace(_TINY_HEADER, snapshots=True),
    )
    yield "updated", _strip_stream(_make_stream(update_head, 3, 3))
    yield (
        "updated_full",
        _strip_stream(_make_stream(replace(_FULL_HEADER, updates=True), 6, 3, births=2)),
    )
    yield "snapshot", _make_stream(snapshot_head, 3, 4, snapshot_every=2)
    full_header = replace(_FULL_HEADER, updates=True, snapshots=True)
    yield "snapshot_full", _make_stream(full_header, 5, 4, births=1, snapshot_every=2)
    yield "unknown", _add_unknown_chunks(_make_stream(_TINY_HEADER, 1, 2))
    for name, change in _RANGE_VIOLATIONS.items():
        yield (
            f"beyond_{name}",
            _make_invalid_births(_strip_stream(_make_stream(_TINY_HEADER, 1, 2)), change),
        )


def _make_invalid_births(stream: bytes, change: Callable[[Births], object]) -> bytes:
    """Add two births to the last frame; their coding is valid, but `change` makes one invalid."""
    with use_engine(REFERENCE):
        first, *_, state = decode_states(stream)
    births = make_births(state, 2)
    change(births)
    chunks = [(chunk.kind, chunk.payload) for chunk in split_chunks(stream)]
    frame = wire.parse_frame(chunks[-2][1])
    frame_start = begin_frame(first, frame.death_count)
    moved = decode_motion(frame_start, frame.motion, use_previous=frame.previous_contexts)
    frame = replace(frame, birth_count=2, births=write_births(births, moved.birth_counts))
    chunks[-2] = (chunks[-2][0], wire.build_frame(frame))
    return rebuild_stream(chunks)


def _set_rows(rows: np.ndarray, values: object) -> None:
    rows[:] = values


_RANGE_VIOLATIONS: dict[str, Callable[[Births], object]] = {
    "parent": lambda births: _set_rows(births.parents[1:], 1),
    "rotation": lambda births: _set_rows(births.newborn.rotations[1:], 16),
    "code": lambda births: _set_rows(births.newborn.codes[SH_DC], [[32768], [32767], [32767]]),
}


def _make_head_payload(header: StreamHeader) -> bytes:
    return next(iter(split_chunks(_make_stream(header, 1, 1)))).payload


def iterate_files() -> Iterator[tuple[str, bytes]]:
    """Yield relative path and bytes of every seed, except the COLMAP models."""
    yield from ((f"streams/{name}.quarc", data) for name, data in iterate_streams())
    snapshot_head = replace(_TINY_HEADER, snapshots=True)
    for chunk in split_chunks(
        _make_stream(snapshot_head, 2, 4, canonical_every=3, snapshot_every=2)
    ):
        if chunk.kind == container.SNAP:
            yield "payloads/SNAP.bin", chunk.payload
    for chunk in split_chunks(_make_stream(_TINY_HEADER, 2, 3, canonical_every=2)):
        yield f"payloads/{chunk.kind.decode()}.bin", chunk.payload
    shots = scenes.make_shots(2)
    poses = io.BytesIO()
    np.save(poses, np.array([scenes.make_poses_row(shot) for shot in shots]))
    yield "poses/two.npy", poses.getvalue()
    yield "ply/ascii.ply", _ASCII_PLY
    yield "gaussians/degree-0.ply", build_ply(_make_splats(1))
    yield "gaussians/degree-1.ply", build_ply(_make_splats(4))
    yield "spz/v4.spz", _SPZ_HEADER + bytes(48)
    clip = Clip(StreamHeader(sh_degree=0, up_axis=3), (CAMERA,), {"title": "seed"})
    yield "sidecar/all.json", build_sidecar(clip, "frame_{frame:04}.ply", 0)
    yield "fourdgs/three.4dgs", _make_fourdgs(clip)
    yield "keyframes/cameras.json", _CAMERA_PATH % (_CAMERA_KEYFRAME % 0, _CAMERA_KEYFRAME % 2)
    yield "keyframes/places.json", _CAMERA_PATH % (_CAMERA_KEYFRAME % 0, _POSE_KEYFRAME)
    yield "ply/binary.ply", _BINARY_PLY + bytes(range(15)) + bytes(15)
    yield "transforms/videos.json", json.dumps(scenes.make_video_document(shots, fps=30)).encode()
    pictures = scenes.make_picture_document(shots, frame_count=1)
    yield "transforms/pictures.json", json.dumps(pictures).encode()
    yield "notes/all.json", _NOTES
    yield "opencv_yaml/both.yml", _EASYMOCAP
    yield "panoptic_json/one.json", _PANOPTIC
    exif = forgeries.forge_exif(6)
    yield "stills/turned.png", forgeries.forge_png(8, 4, exif)
    yield "stills/turned.jpg", forgeries.add_exif(_JPEG_HEADER, exif)
    training_file = io.BytesIO()
    write_arrays(training_file, "seed", {"step": np.array(3), "means": np.ones((2, 3), np.float32)})
    yield "training/two.training", training_file.getvalue()
    marker = io.BytesIO()
    begin_marker(marker)
    for line in ("inner/", "frame_0000.ply", "a-b_c.png"):
        append_line(marker, line)
    yield "marker/three.txt", marker.getvalue()


_NOTES = b"""{"offsets": {"cam00": 4, "cam01": 1.5}, "up": [0, -1, 0.1], "meters_per_unit": 1}"""
_MATRIX = b"!!opencv-matrix\n   rows: %d\n   cols: %d\n   dt: d\n   data: [ %s ]\n"
_EASYMOCAP = b'%YAML:1.0\n---\nnames:\n   - "00"\n' + b"".join(
    name + b": " + _MATRIX % each
    for name, each in {
        b"K_00": (3, 3, b"40., 0., 23.5, 0., 40., 15.5, 0., 0., 1."),
        b"dist_00": (1, 5, b"0.1, 0., 0., 0., 0."),
        b"R_00": (3, 1, b"0., 0.5, 0."),
        b"T_00": (3, 1, b"0., 0., 4."),
    }.items()
)
_PANOPTIC = (
    b'{"cameras": [{"name": "00_00", "type": "hd", "resolution": [48, 32], '
    b'"K": [[40, 0, 24], [0, 40, 16], [0, 0, 1]], "distCoef": [0.1, 0, 0, 0, 0], '
    b'"R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "t": [[0], [0], [4]]}]}'
)
_JPEG_HEADER = bytes.fromhex("ffd8 ffe00004abcd ffc0000b08000400080101 1100 ffda0002 ffd9")
_PROPERTIES = b"".join(
    [*(b"property float %c\n" % axis for axis in b"xyz")]
    + [b"property uchar " + color + b"\n" for color in (b"red", b"green", b"blue")]
)
_ASCII_PLY = (
    b"ply\nformat ascii 1.0\ncomment seed\nelement vertex 2\n"
    + _PROPERTIES
    + b"end_header\n0 1 2 3 4 5\n-1e3 0.5 7 255 0 9\n"
)
_BINARY_PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 2\n" + _PROPERTIES + b"end_header\n"
)


def write_models(folder: Path) -> None:
    """Write the COLMAP models with pycolmap."""
    shots = scenes.make_shots(2)
    for file_format in ("binary", "text"):
        scenes.write_model(
            folder / file_format, shots, scenes.make_plane_points(3), text=file_format == "text"
        )


def write_all() -> None:
    """Write all seeds into the repository."""
    for name, data in iterate_files():
        (FOLDER / name).parent.mkdir(parents=True, exist_ok=True)
        (FOLDER / name).write_bytes(data)
    write_models(FOLDER / "colmap")


if __name__ == "__main__":
    write_all()
