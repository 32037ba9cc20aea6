"""Renders pictures in bands and slices to limit the use of memory.

A band consists of rows of tiles. A slice consists of Gaussians that are consecutive in depth
order and intersect a limited number of tiles. Each Gaussian forms a pair with every tile that
it intersects; pairs are counted before lists are allocated. Slices are rendered front to back
until all pixels of the band are opaque. The result is bit-identical to rendering the whole
picture at once, because each pixel blends the same Gaussians in the same order.
"""

from collections.abc import Iterator

import numpy as np

from quarc_ref.format.cameras import Camera
from quarc_ref.rendering.binning_kernels import TILE
from quarc_ref.rendering.pipeline import (
    bin_band,
    composite,
    count_pairs,
    make_blank_rows,
    make_full_band,
)
from quarc_ref.rendering.pipeline_data import Band, Int32, Picture, Projection

MAX_BAND_PIXELS = 1 << 21  # at 16 bytes per pixel; a band has at least one row of tiles
MAX_SLICE_PAIRS = 1 << 21  # at 16 bytes per pair; a slice has at least one Gaussian


def render_band_pictures(sorted_projection: Projection, camera: Camera) -> Iterator[Picture]:
    """Render the view of a camera on a black background, from top to bottom.

    Args:
        sorted_projection: Projected Gaussians, sorted by depth.
        camera: The camera.

    Yields:
        The rows of the picture, band by band.
    """
    full_band = make_full_band(camera)
    band_row_count = max(1, MAX_BAND_PIXELS // (TILE * TILE * full_band.column_count))
    for top in range(0, full_band.bottom, band_row_count):
        band = full_band._replace(top=top, bottom=min(top + band_row_count, full_band.bottom))
        picture = make_blank_rows(camera, band.top * TILE, min(band.bottom * TILE, camera.height))
        _render_band(sorted_projection, band, picture)
        yield picture


def _render_band(sorted_projection: Projection, band: Band, picture: Picture) -> None:
    pair_counts = count_pairs(sorted_projection, band)
    black = np.zeros(3, dtype=np.float32)
    for gaussian_slice in _cut_slices(pair_counts):
        slice_projection, slice_pair_counts = (
            sorted_projection.take(gaussian_slice),
            pair_counts[gaussian_slice],
        )
        tiles = bin_band(
            slice_projection,
            np.arange(slice_pair_counts.size, dtype=np.int32),
            band,
            slice_pair_counts,
        )
        composite(slice_projection, tiles, black, picture, is_continuation=True)
        if (picture.transmittance < 0).all():
            break


def _cut_slices(pair_counts: Int32) -> Iterator[slice]:
    """Yield slices of at most `MAX_SLICE_PAIRS` pairs; a slice of a single Gaussian may have more.

    Args:
        pair_counts: `[N]` number of pairs of each Gaussian.
    """
    cumulative_pair_counts = np.cumsum(pair_counts, dtype=np.int64)
    start = listed_pair_count = 0
    while start < pair_counts.size:
        stop = int(
            np.searchsorted(
                cumulative_pair_counts, listed_pair_count + MAX_SLICE_PAIRS, side="right"
            )
        )
        stop = max(start + 1, stop)
        yield slice(start, stop)
        start, listed_pair_count = stop, int(cumulative_pair_counts[stop - 1])
