"""Fuzz targets: each passes bytes to a reader and suppresses the errors that the reader documents.

Any other exception is a bug. Targets are called by atheris from `fuzz.__main__`, and by the tests
in `tests/hostile`; that folder also contains the seeds.
"""

import io
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path

from quarc_ref.datasets.capture_notes import NOTES_NAME
from quarc_ref.datasets.errors import CaptureError
from quarc_ref.datasets.layouts import colmap, easymocap, n3dv, panoptic, transforms_json
from quarc_ref.datasets.layouts.transforms_entries import read_transforms
from quarc_ref.datasets.named_files import NamedFileResolver
from quarc_ref.datasets.notes_file import read_capture_notes
from quarc_ref.datasets.opencv_yaml import parse_yaml
from quarc_ref.datasets.points_ply import read_points_ply
from quarc_ref.datasets.still_header import read_still_header
from quarc_ref.encoder.resume.array_file import ArrayFileError, Layout, read_arrays
from quarc_ref.export.fourdgs_file import read_4dgs
from quarc_ref.export.gaussian_ply import parse_ply
from quarc_ref.export.sidecar import parse_sidecar
from quarc_ref.export.spz import check_header
from quarc_ref.files import MARKER_NAME, OutputPathError, growing_folder
from quarc_ref.files.marker import read_marker
from quarc_ref.format import wire
from quarc_ref.format.cameras import Camera
from quarc_ref.format.errors import BitstreamError, EditError, LimitError, SourceError
from quarc_ref.streams import Source, decode, recover
from quarc_ref.streams.chunk_reader import split_chunks
from quarc_ref.streams.cut import cut
from quarc_ref.streams.source import BytesSource
from quarc_ref.streams.sources import PipeSource
from quarc_ref.viewing.paths.keyframes import parse_keyframes
from quarc_ref.viewing.paths.pose import PathError, WorldAxes

SEEDS = Path(__file__).parents[1] / "tests" / "hostile" / "seeds"
_DOCUMENTED_ERRORS = (BitstreamError, LimitError, SourceError, EditError)
_MODEL_FILES = ("cameras", "images", "points3D", "rigs", "frames")
_PARSERS = {
    "HEAD": wire.parse_stream_header,
    "CANO": wire.parse_canonical,
    "FRAM": wire.parse_frame,
    "SNAP": wire.parse_snapshot,
    "came": wire.parse_cameras,
    "meta": wire.parse_metadata,
    "INDX": wire.parse_index,
    "TAIL": wire.parse_tail,
}


def fuzz_container(data: bytes) -> None:
    """Split a stream into chunks."""
    with suppress(BitstreamError):
        list(split_chunks(data))


def fuzz_payloads(data: bytes) -> None:
    """Parse bytes as the payload of each type of chunk."""
    for parse in _PARSERS.values():
        with suppress(BitstreamError):
            parse(data)


def fuzz_streams(data: bytes) -> None:
    """Decode a stream from its start, from frame 1, with recovery and from a pipe; also cut it."""
    operations: tuple[Callable[[Source], object], ...] = (
        lambda source: list(decode(source)),
        lambda source: list(decode(source, 1)),
        lambda source: list(recover(source)),
        lambda source: cut(source, None, None, io.BytesIO()),
    )
    for operation in operations:
        with suppress(*_DOCUMENTED_ERRORS):
            operation(BytesSource(data))
    with suppress(*_DOCUMENTED_ERRORS):
        list(recover(PipeSource(io.BytesIO(data))))


def fuzz_poses(data: bytes) -> None:
    """Read `poses_bounds.npy` and convert it to cameras."""
    with _write_temporary_file("poses_bounds.npy", data) as path, suppress(CaptureError):
        for row in n3dv._read_rows(path):
            with suppress(CaptureError):
                n3dv._make_camera("cam00", (48, 32), 0, row, path)


@contextmanager
def _write_temporary_file(name: str, data: bytes) -> Iterator[Path]:
    """Write a file to a temporary folder, and yield its path."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        yield path


def fuzz_ply(data: bytes) -> None:
    """Read a PLY file of points."""
    with _write_temporary_file("points.ply", data) as path, suppress(CaptureError):
        read_points_ply(path)


def fuzz_gaussians(data: bytes) -> None:
    """Read a PLY file of Gaussians."""
    with suppress(ValueError):
        parse_ply(data)


def fuzz_spz(data: bytes) -> None:
    """Check the header of an SPZ file, which is the only part that this process parses."""
    with suppress(ValueError):
        check_header(data)


def fuzz_fourdgs(data: bytes) -> None:
    """Read a `.4dgs` file and its first frames."""
    with suppress(ValueError, ImportError):
        list(islice(read_4dgs(data).read(), 2))


def fuzz_sidecar(data: bytes) -> None:
    """Read a `sequence.json` file."""
    with suppress(ValueError):
        parse_sidecar(data)


def fuzz_keyframes(data: bytes) -> None:
    """Read a camera path, and compute its poses."""
    with suppress(PathError):
        path = parse_keyframes(data, [_KEYFRAME_CAMERA], _KEYFRAME_CAMERA, WorldAxes())
        if path.count_pictures(2.0) < _MAX_PICTURES:
            path.interpolate(2.0)
            path.list_times(2.0, 0, 9)


_KEYFRAME_CAMERA = Camera(
    "cam00", 8, 6, 5.0, 5.0, 4.0, 3.0, (1, 0, 0, 0, 0, -1, 0, 1, 0), (0, 0, 2), 0.1, False
)
_MAX_PICTURES = 1000


def fuzz_transforms(data: bytes) -> None:
    """Read `transforms.json`, convert it to a rig, and find the files that it names."""
    with _write_temporary_file("transforms.json", data) as path, suppress(CaptureError):
        entries = read_transforms(path).entries
        transforms_json._build_rig(entries, path)
        for entry in entries:
            with suppress(CaptureError):
                NamedFileResolver(path).find(entry.path)


def fuzz_notes(data: bytes) -> None:
    """Read the notes of a capture, and apply them to its cameras."""
    with _write_temporary_file(NOTES_NAME, data) as path, suppress(CaptureError):
        read_capture_notes(path.parent).first_frames(["cam00", "cam01"])


def fuzz_opencv_yaml(data: bytes) -> None:
    """Read an EasyMocap calibration and convert it to cameras."""
    with suppress(ValueError):
        nodes = parse_yaml(data)
        for name in ("00", "01"):
            with suppress(ValueError):
                easymocap._make_camera(name, (48, 32), nodes, nodes)


def fuzz_panoptic_json(data: bytes) -> None:
    """Read a calibration file of the Panoptic Studio dataset."""
    with _write_temporary_file("calibration_a.json", data) as path, suppress(CaptureError):
        panoptic.read_cameras(path)


def fuzz_stills(data: bytes) -> None:
    """Read the header of a picture file."""
    with suppress(ValueError):
        read_still_header(data)


def fuzz_colmap(data: bytes) -> None:
    """Read a COLMAP model; the first byte selects the file that contains the remaining bytes."""
    selector = data[0] if data else 0
    file_format, name = (
        ("binary", "text")[selector // len(_MODEL_FILES) % 2],
        _MODEL_FILES[selector % 5],
    )
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder)
        shutil.copytree(SEEDS / "colmap" / file_format, model, dirs_exist_ok=True)
        (model / f"{name}{'.bin' if file_format == 'binary' else '.txt'}").write_bytes(data[1:])
        with suppress(CaptureError):
            colmap._read_model(model)


def fuzz_training(data: bytes) -> None:
    """Read an array file of a checkpoint."""
    layout = Layout({"step": ("<i8", ()), "means": ("<f4", ("rows", 3))}, {"rows": range(1, 9)})
    with (
        _write_temporary_file("a.training", data) as path,
        path.open("rb") as file,
        suppress(ArrayFileError),
    ):
        read_arrays(file, "seed", layout)


def fuzz_marker(data: bytes) -> None:
    """Read the marker of an output folder, and write a file into the folder."""
    with _write_temporary_file(MARKER_NAME, data) as path:
        with suppress(OutputPathError):
            read_marker(path.parent)
        with (
            suppress(OutputPathError),
            growing_folder(path.parent, replace=True, keep=True) as output,
        ):
            output.write("a.ply", data)


def list_seeds(target: str) -> list[bytes]:
    """Return the seeds of a target."""
    if target != "colmap":
        folder = "streams" if target == "container" else target
        return [path.read_bytes() for path in sorted((SEEDS / folder).iterdir())]
    return [
        bytes([len(_MODEL_FILES) * format_number + number])
        + (SEEDS / "colmap" / file_format / f"{name}{suffix}").read_bytes()
        for format_number, (file_format, suffix) in enumerate(
            (("binary", ".bin"), ("text", ".txt"))
        )
        for number, name in enumerate(_MODEL_FILES)
    ]


TARGETS: dict[str, Callable[[bytes], None]] = {
    "container": fuzz_container,
    "payloads": fuzz_payloads,
    "streams": fuzz_streams,
    "poses": fuzz_poses,
    "ply": fuzz_ply,
    "gaussians": fuzz_gaussians,
    "spz": fuzz_spz,
    "fourdgs": fuzz_fourdgs,
    "sidecar": fuzz_sidecar,
    "keyframes": fuzz_keyframes,
    "transforms": fuzz_transforms,
    "notes": fuzz_notes,
    "opencv_yaml": fuzz_opencv_yaml,
    "panoptic_json": fuzz_panoptic_json,
    "stills": fuzz_stills,
    "colmap": fuzz_colmap,
    "training": fuzz_training,
    "marker": fuzz_marker,
}
