"""Pictures as averages over a grid of cells."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def cell_averages(pixels: FloatArray, cells: int) -> FloatArray:
    """Average H x W x 3 pixels over cells x cells; a pixel counts for the cell of its middle."""
    rows, columns = ((np.arange(n) * 2 + 1) * cells // (2 * n) for n in pixels.shape[:2])
    sums = np.zeros((cells, cells, 3))
    np.add.at(sums, (rows[:, None], columns[None, :]), pixels)
    counts = np.bincount(rows, minlength=cells)[:, None] * np.bincount(columns, minlength=cells)
    return np.asarray(sums / counts[..., None])
