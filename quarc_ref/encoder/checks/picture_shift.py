"""Measures how far a picture is shifted, although people move in parts of it.

Phase correlation finds shifts of whole pixels. The rest of the shift is that of the median cell,
which the gradients of the cells determine (Lucas and Kanade, "An Iterative Image Registration
Technique", 1981). Only cells with texture in all directions are used.
"""

import numpy as np
from numpy.typing import NDArray

CELL_PIXELS = 8
_MIN_GRADIENT = 3.2  # gray levels per pixel, in the direction of the smallest changes
_MIN_CELLS = 12
_MIN_CELL_SHARE = 0.08
_PEAK_COUNT = 5
# Error relative to that without a shift, above which a peak of the phase correlation is ignored.
_MAX_ERROR_RATIO = 0.9
_MIN_LEVEL = 1.0
_EPSILON = 1e-6

Floats = NDArray[np.float64]
Picture = NDArray[np.float32]


class ReferencePicture:
    """A gray picture with which others are compared.

    Args:
        levels: `[rows, columns]` gray levels, 0 to 255.

    Attributes:
        has_texture: Whether enough cells have texture; without, nothing can be measured.
    """

    def __init__(self, levels: Picture) -> None:
        y, x = (_split_cells(np.gradient(levels, axis=axis)) for axis in (0, 1))
        cells = _split_cells(levels)
        self._contrast = max(float(cells.std(axis=1).mean()), _EPSILON)
        xx, xy, yy = (x * x).sum(axis=1), (x * y).sum(axis=1), (y * y).sum(axis=1)
        smallest = (xx + yy) / 2 - np.sqrt((xx - yy) ** 2 / 4 + xy**2)
        self._is_used = smallest > (CELL_PIXELS * _MIN_GRADIENT) ** 2
        used_count = int(self._is_used.sum())
        self.has_texture = used_count >= max(_MIN_CELLS, _MIN_CELL_SHARE * len(cells))
        self._cells, self._x, self._y = (part[self._is_used] for part in (cells, x, y))
        self._xx, self._xy, self._yy = (part[self._is_used] for part in (xx, xy, yy))
        self._means = self._cells.mean(axis=1, keepdims=True)
        self._window = np.outer(*(np.hanning(size) for size in levels.shape))
        self._spectrum = self._transform(levels)

    def measure_contrast(self, levels: Picture) -> float:
        """Return the mean contrast of all cells of a picture, relative to the reference.

        Shifts hardly change it.
        """
        return float(_split_cells(levels).std(axis=1).mean()) / self._contrast

    def measure_shift(self, levels: Picture) -> tuple[float, float]:
        """Return by how many pixels a picture is shifted to the right and down."""
        x, y = self._find_whole_shift(levels)
        rest_x, rest_y = self._measure_small_shift(np.roll(levels, (-y, -x), axis=(0, 1)))
        return x + rest_x, y + rest_y

    def is_shifted(self, levels: Picture, shift: Floats) -> bool:
        """Return whether a shift by `[2]` pixels explains a picture better than no shift."""
        x, y = shift.round().astype(int)
        if x or y:
            return self._measure_error(np.roll(levels, (-y, -x), axis=(0, 1))) < (
                self._measure_error(levels)
            )
        return bool(np.dot(self._measure_small_shift(levels), shift) > np.dot(shift, shift) / 2)

    def _transform(self, levels: Picture) -> NDArray[np.complex128]:
        return np.fft.rfft2((levels - levels.mean()) * self._window)

    def _find_whole_shift(self, levels: Picture) -> tuple[int, int]:
        """Return the best shift to the right and down among the peaks of the phase correlation."""
        products = np.conj(self._spectrum) * self._transform(levels)
        products /= np.maximum(np.abs(products), _EPSILON)
        correlation = np.fft.irfft2(products, s=levels.shape)
        best_error, best_shift = _MAX_ERROR_RATIO * self._measure_error(levels), (0, 0)
        for peak in np.argsort(correlation, axis=None)[-_PEAK_COUNT:]:
            y, x = (
                (int(position) + size // 2) % size - size // 2
                for position, size in zip(
                    np.unravel_index(peak, levels.shape), levels.shape, strict=True
                )
            )
            error = self._measure_error(np.roll(levels, (-y, -x), axis=(0, 1)))
            if error < best_error:
                best_error, best_shift = error, (x, y)
        return best_shift

    def _measure_small_shift(self, levels: Picture) -> tuple[float, float]:
        """Return the shift of the median cell to the right and down, below about a pixel."""
        differences = self._subtract(levels)
        x, y = (self._x * differences).sum(axis=1), (self._y * differences).sum(axis=1)
        determinants = self._xx * self._yy - self._xy**2
        shifts_x = (self._yy * x - self._xy * y) / determinants
        shifts_y = (self._xx * y - self._xy * x) / determinants
        return float(np.median(shifts_x)), float(np.median(shifts_y))

    def _measure_error(self, levels: Picture) -> float:
        """Return the mean absolute difference of the median cell from the reference."""
        return float(np.median(np.abs(self._subtract(levels)).mean(axis=1)))

    def _subtract(self, levels: Picture) -> Floats:
        """Subtract a picture from the reference, after each cell has the mean of the reference."""
        cells = _split_cells(levels)[self._is_used]
        gains = self._means / np.maximum(cells.mean(axis=1, keepdims=True), _MIN_LEVEL)
        differences: Floats = self._cells - gains * cells
        return differences


def _split_cells(picture: NDArray[np.floating]) -> Picture:
    """Return the pixels of each cell of a picture `[rows, columns]`, `[C, pixels]`."""
    rows, columns = (size // CELL_PIXELS for size in picture.shape)
    squares = picture[: rows * CELL_PIXELS, : columns * CELL_PIXELS].reshape(
        rows, CELL_PIXELS, columns, CELL_PIXELS
    )
    return squares.swapaxes(1, 2).reshape(rows * columns, CELL_PIXELS**2)
