"""Pictures drawn in bands and slices, in bounded memory.

A band is some rows of tiles. A slice is some Gaussians, in the order of their
depths, with as many pairs of Gaussian and tile as its lists have room for: pairs
are counted before the lists are allocated. Slices are drawn front to back until all pixels of the
band are opaque. The pixels are, bit for bit, those of a picture drawn at once: each meets the same
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

BAND_PIXELS = 1 << 21  # of 16 bytes; a band has a row of tiles at the least
SLICE_PAIRS = 1 << 21  # of 16 bytes; a slice has a Gaussian at the least


def draw_bands(nearest_first: Projection, camera: Camera) -> Iterator[Picture]:
    """Draw what a camera sees, before a black background, from the top down.

    Args:
        nearest_first: The Gaussians on its picture plane, in the order of their depths.
        camera: The camera that sees them.

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
        composite(part, tiles, black, picture, goes_on=True)
        if (picture.transmittance < 0).all():
            break


def _cut(counts: Int32) -> Iterator[slice]:
    """Yield slices that have no more pairs than a slice may have, or a single Gaussian.

    Args:
        counts: `[N]` pairs of each Gaussian.
    """
    totals = np.cumsum(counts, dtype=np.int64)
    start = done = 0
    while start < counts.size:
        stop = int(np.searchsorted(totals, done + SLICE_PAIRS, side="right"))
        stop = max(start + 1, stop)
        yield slice(start, stop)
        start, done = stop, int(totals[stop - 1])
