"""Sets the up direction and scale of a stream from the notes of a capture.

HEAD (SPEC 5.3) can store an up direction only if it is a coordinate axis. Other
up directions are stored as metadata (SPEC I.4).
"""

from dataclasses import replace

import numpy as np

from quarc_ref.datasets.capture_notes import CaptureNotes
from quarc_ref.export.up_direction import UP_KEY, format_up_direction
from quarc_ref.format.records import StreamHeader

_MIN_AXIS_COSINE = 0.9998  # cosine of one degree


def find_up_axis(notes: CaptureNotes) -> int:
    """Return `up_axis` for the header: 1 to 6 for +x, -x, +y, -y, +z, -z, else 0."""
    for axis, component in enumerate(notes.up or ()):
        if abs(component) >= _MIN_AXIS_COSINE:
            return 2 * axis + (1 if component > 0 else 2)
    return 0


def set_world_frame(header: StreamHeader, notes: CaptureNotes) -> StreamHeader:
    """Return a header with the up axis and scale of a capture, if the notes contain them."""
    meters_per_unit = float(np.float32(notes.meters_per_unit or 0.0))  # as stored in the file
    return replace(
        header,
        up_axis=find_up_axis(notes) or header.up_axis,
        meters_per_unit=meters_per_unit or header.meters_per_unit,
    )


def describe_up(notes: CaptureNotes) -> dict[str, str]:
    """Return the metadata for an up direction that the header cannot store."""
    if notes.up is None or find_up_axis(notes):
        return {}
    return {UP_KEY: format_up_direction(notes.up)}
