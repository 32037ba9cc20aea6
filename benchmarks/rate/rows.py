"""The rows of the rate table: one stream in this format and in others."""

from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from quarc_ref.decoder import dequantize
from quarc_ref.inspection.stream_summary import KINDS
from quarc_ref.streams import decode
from rate import keyframe_deltas
from rate.converters import UnavailableError, convert_scene
from rate.measure import Measured, measure_first_frame
from rate.planes import COMPRESSORS, read_symbols, sum_compressed, sum_floats

FILE, ESTIMATE, FLOATS, FOURDGS = "the file", "zero-order estimate", "float32", "fourdgs"
STILL_FORMATS = {"spz": "SPZ", "sog": "SOG"}


@dataclass(frozen=True, slots=True)
class Row:
    """A stream in one coding, with bytes of the whole stream; None if unknown.

    Attributes:
        capture: Name of the capture.
        preset: Of the stream.
        coder: What codes it.
        canonical: Bytes of canonical frames; of a file of the first frame in formats without them.
        motion: Bytes of the anchors' residuals.
        snapshots: Bytes of canonical frames that are coded against others.
        updates: Bytes of changes of single Gaussians.
        births: Bytes of births.
        rest: Bytes of headers, index, cameras and metadata.
        total: Bytes of all.
        psnr_first: PSNR of held-out cameras in frame 0, dB.
        psnr_mean: PSNR of held-out cameras, mean of the frames, dB.
        remark: Why a number is missing, or the settings of the format.
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


def list_own_rows(measured: Measured) -> list[Row]:
    """Return the row of the file, and that of the estimate of its symbols."""
    blank = _blank(measured)
    coded, psnr = measured.summary.coded_bytes(), measured.psnr
    estimate: dict[str, Any] = {
        kind: sum(frame.estimate_bytes[kind] for frame in measured.summary.frames) for kind in KINDS
    }
    made = f"made with other {', '.join(measured.differences)}" if measured.differences else ""
    of_file: dict[str, Any] = {kind: coded[kind] for kind in KINDS}
    file = replace(blank, coder=FILE, **of_file, remark=made)
    file = replace(file, rest=coded["overhead"], total=coded["total"])
    file = replace(file, psnr_first=psnr[0], psnr_mean=fmean(psnr))
    return [file, _sum(replace(blank, coder=ESTIMATE, **estimate))]


def list_generic_rows(measured: Measured) -> list[Row]:
    """Return the rows of general-purpose compressors and raw floats for the same symbols."""
    frames, blank = list(read_symbols(measured.data)), _blank(measured)
    rows = []
    for name, compress in COMPRESSORS.items():
        try:
            kinds: dict[str, Any] = sum_compressed(frames, compress)
        except ImportError as error:
            rows.append(replace(blank, coder=name, remark=_describe_error(error)))
        else:
            rows.append(_sum(replace(blank, coder=name, **kinds)))
    floats: dict[str, Any] = sum_floats(frames)
    return [*rows, _sum(replace(blank, coder=FLOATS, **floats))]


def make_still_row(measured: Measured, ending: str, folder: Path) -> Row:
    """Return the row of frame 0 as a file of another format."""
    blank = replace(_blank(measured), coder=STILL_FORMATS[ending])
    splats = dequantize(next(decode(measured.data)))
    try:
        converted = convert_scene(splats, ending, folder)
    except UnavailableError as error:
        return replace(blank, remark=_describe_error(error))
    psnr = measure_first_frame(converted.splats, measured)
    return replace(blank, coder=converted.label, canonical=converted.byte_count, psnr_first=psnr)


def list_fourdgs_rows(measured: Measured) -> list[Row]:
    """Return the rows of the decoded frames in `4dgs` files, the smallest first."""
    blank = replace(_blank(measured), coder=FOURDGS)
    try:
        sizes = keyframe_deltas.count_bytes(decode(measured.data))
    except ImportError as error:
        return [replace(blank, remark=_describe_error(error))]
    return [
        replace(blank, coder=name, canonical=each.first, total=each.total, remark=each.settings)
        for name, each in zip((FOURDGS, f"{FOURDGS}, its defaults"), sizes, strict=True)
    ]


def _blank(measured: Measured) -> Row:
    return Row(measured.job.capture.resolve().name, measured.job.preset, "")


def _sum(row: Row) -> Row:
    return replace(row, total=sum(getattr(row, kind) or 0 for kind in KINDS))


def _describe_error(error: Exception) -> str:
    return f"unavailable: {error}"
