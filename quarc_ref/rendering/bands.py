"""Renders pictures in bands and slices, with bounded memory.

A band consists of rows of tiles. A slice consists of Gaussians in the order of depth,
limited by the number of pairs of Gaussian and tile, which are counted before lists are
allocated. Slices are rendered front to back until all pixels of the band are opaque. The
result is bit-identical to a picture rendered at once, because each pixel blends the same
Gaussians in the same order.
"""

from collections.abc import Iterator

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.binning_kernels import TILE
from quarc_ref.rendering.pipeline import (
    blank_rows,
    composite,
    count_pairs,
    list_pairs,
    whole_band,
)
from quarc_ref.rendering.pipeline_data import Band, Int32, Picture, Projection

BAND_PIXELS = 1 << 21  # items of 16 bytes; a band has at least one row of tiles
SLICE_PAIRS = 1 << 21  # items of 16 bytes; a slice has at least one Gaussian


def draw_bands(nearest_first: Projection, camera: Camera) -> Iterator[Picture]:
    """Render the view of a camera on a black background, from top to bottom.

    Args:
        nearest_first: Gaussians projected to the picture plane, in the order of depth.
        camera: The camera.

    Yields:
        The rows of the picture, band by band.
    """
    whole = whole_band(camera)
    step = max(1, BAND_PIXELS // (TILE * TILE * whole.columns))
    for top in range(0, whole.bottom, step):
        band = whole._replace(top=top, bottom=min(top + step, whole.bottom))
        picture = blank_rows(camera, band.top * TILE, min(band.bottom * TILE, camera.height))
        _draw_band(nearest_first, band, picture)
        yield picture


def _draw_band(nearest_first: Projection, band: Band, picture: Picture) -> None:
    counts = count_pairs(nearest_first, band)
    black = np.zeros(3, dtype=np.float32)
    for chosen in _cut(counts):
        part, pairs = nearest_first.take(chosen), counts[chosen]
        tiles = list_pairs(part, np.arange(pairs.size, dtype=np.int32), band, pairs)
        composite(part, tiles, black, picture, continues=True)
        if (picture.transmittance < 0).all():
            break


def _cut(counts: Int32) -> Iterator[slice]:
    """Yield slices with at most the allowed number of pairs, or a single Gaussian.

    Args:
        counts: `[N]` number of pairs of each Gaussian.
    """
    totals = np.cumsum(counts, dtype=np.int64)
    start = done = 0
    while start < counts.size:
        stop = int(np.searchsorted(totals, done + SLICE_PAIRS, side="right"))
        stop = max(start + 1, stop)
        yield slice(start, stop)
        start, done = stop, int(totals[stop - 1])
