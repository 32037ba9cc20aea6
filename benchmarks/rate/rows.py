"""Makes the rows of the rate table: the size of a stream in this format and in other formats."""

from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from quarc_ref.decoder import dequantize
from quarc_ref.inspection.stream_summary import KINDS
from quarc_ref.streams import decode
from rate import keyframe_deltas
from rate.converters import UnavailableError, convert_and_restore
from rate.measure import MeasuredStream, measure_first_frame_psnr
from rate.planes import COMPRESSORS, read_symbols, sum_compressed_bytes, sum_float_bytes

FILE, ESTIMATE, FLOATS, FOURDGS = "the file", "zero-order estimate", "float32", "fourdgs"
STILL_FORMATS = {"spz": "SPZ", "sog": "SOG"}


@dataclass(frozen=True, slots=True)
class Row:
    """Sizes and quality of a stream in one format; unknown numbers are None.

    Attributes:
        capture: Name of the capture.
        preset: Preset of the stream.
        coder: Name of the format or compressor.
        canonical: Bytes of the canonical frames, or of a file with only the first frame.
        motion: Bytes of the anchors' residuals.
        snapshots: Bytes of snapshots.
        updates: Bytes of updates.
        births: Bytes of births.
        rest: Bytes of headers, index, cameras and metadata.
        total: Total bytes.
        psnr_first: PSNR of frame 0 on held-out cameras, in dB.
        psnr_mean: Mean PSNR of all frames on held-out cameras, in dB.
        remark: Reason for a missing number, or settings of the format.
    """

    capture: str
    preset: str
    coder: str
    canonical: float | None = None
    motion: float | None = None
    snapshots: float | None = None
    updates: float | None = None
    births: float | None = None
    rest: float | None = None
    total: float | None = None
    psnr_first: float | None = None
    psnr_mean: float | None = None
    remark: str = ""


def list_stream_rows(stream: MeasuredStream) -> list[Row]:
    """Return the row of the stream itself, and that of the zero-order estimate for its symbols."""
    blank_row = _make_blank_row(stream)
    coded_bytes, psnr = stream.summary.coded_bytes(), stream.psnr
    estimate_bytes: dict[str, Any] = {
        kind: sum(frame.estimate_bytes[kind] for frame in stream.summary.frames) for kind in KINDS
    }
    remark = (
        f"encoded with different values of {', '.join(stream.differences)}"
        if stream.differences
        else ""
    )
    file_bytes: dict[str, Any] = {kind: coded_bytes[kind] for kind in KINDS}
    file_row = replace(blank_row, coder=FILE, **file_bytes, remark=remark)
    file_row = replace(file_row, rest=coded_bytes["overhead"], total=coded_bytes["total"])
    file_row = replace(file_row, psnr_first=psnr[0], psnr_mean=fmean(psnr))
    return [file_row, _add_total(replace(blank_row, coder=ESTIMATE, **estimate_bytes))]


def list_compressor_rows(stream: MeasuredStream) -> list[Row]:
    """Return the rows of the same symbols in general-purpose compressors and as raw floats."""
    frames, blank_row = list(read_symbols(stream.data)), _make_blank_row(stream)
    rows = []
    for name, compress in COMPRESSORS.items():
        try:
            sizes: dict[str, Any] = sum_compressed_bytes(frames, compress)
        except ImportError as error:
            rows.append(replace(blank_row, coder=name, remark=_describe_error(error)))
        else:
            rows.append(_add_total(replace(blank_row, coder=name, **sizes)))
    float_bytes: dict[str, Any] = sum_float_bytes(frames)
    return [*rows, _add_total(replace(blank_row, coder=FLOATS, **float_bytes))]


def make_still_row(stream: MeasuredStream, format_name: str, folder: Path) -> Row:
    """Return the row of frame 0 converted to another format."""
    blank_row = replace(_make_blank_row(stream), coder=STILL_FORMATS[format_name])
    splats = dequantize(next(decode(stream.data)))
    try:
        round_trip_scene = convert_and_restore(splats, format_name, folder)
    except UnavailableError as error:
        return replace(blank_row, remark=_describe_error(error))
    psnr = measure_first_frame_psnr(round_trip_scene.splats, stream)
    return replace(
        blank_row,
        coder=round_trip_scene.label,
        canonical=round_trip_scene.byte_count,
        psnr_first=psnr,
    )


def list_fourdgs_rows(stream: MeasuredStream) -> list[Row]:
    """Return the rows of `4dgs` files of the decoded frames, smallest first."""
    blank_row = replace(_make_blank_row(stream), coder=FOURDGS)
    try:
        sizes = keyframe_deltas.measure_file_sizes(decode(stream.data))
    except ImportError as error:
        return [replace(blank_row, remark=_describe_error(error))]
    return [
        replace(
            blank_row,
            coder=name,
            canonical=file_sizes.first,
            total=file_sizes.total,
            remark=file_sizes.settings,
        )
        for name, file_sizes in zip(
            (FOURDGS, f"{FOURDGS} with default settings"), sizes, strict=True
        )
    ]


def _make_blank_row(stream: MeasuredStream) -> Row:
    return Row(stream.job.capture.resolve().name, stream.job.preset, "")


def _add_total(row: Row) -> Row:
    return replace(row, total=sum(getattr(row, kind) or 0 for kind in KINDS))


def _describe_error(error: Exception) -> str:
    return f"unavailable: {error}"
