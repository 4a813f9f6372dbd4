"""Drawdowns: pictures of a weave with one cell for each crossing."""

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

# Sides of a picture in pixels: cells grow until they fill the first, and a draft with more
# crossings than the second is averaged down, so that a notebook stays small.
COMFORTABLE_SIDE = 384
LARGEST_SIDE = 1536
LARGEST_CELL = 16

# From this cell size on, thin lines part the cells.
SMALLEST_CELL_WITH_GRID = 6
GRID_LEVEL = 128


def drawdown_png(
    warp_up: NDArray[np.bool_],
    warp_colors: NDArray[np.float64],
    weft_colors: NDArray[np.float64],
) -> bytes:
    """Draw a drawdown, the first pick at the top, and return it as a PNG file.

    Parameters
    ----------
    warp_up
        Picks x ends, True where the warp is on the face.
    warp_colors, weft_colors
        Display-encoded colours in [0, 1], ends x 3 and picks x 3, or one colour of 3 for all.
    """
    picks, ends = warp_up.shape
    warp = np.broadcast_to(_to_bytes(warp_colors), (ends, 3))
    weft = np.broadcast_to(_to_bytes(weft_colors), (picks, 3))
    crossings = np.where(warp_up[:, :, None], warp[None, :, :], weft[:, None, :])
    longest = max(picks, ends)
    if longest > LARGEST_SIDE:
        image = Image.fromarray(crossings).reduce(-(-longest // LARGEST_SIDE))
    else:
        image = Image.fromarray(_enlarge(crossings, COMFORTABLE_SIDE // longest))
    file = io.BytesIO()
    image.save(file, format="PNG")
    return file.getvalue()


def _to_bytes(colors: NDArray[np.float64]) -> NDArray[np.uint8]:
    return np.rint(np.asarray(colors) * 255).astype(np.uint8)


def _enlarge(crossings: NDArray[np.uint8], cell: int) -> NDArray[np.uint8]:
    cell = min(max(cell, 1), LARGEST_CELL)
    enlarged = crossings.repeat(cell, axis=0).repeat(cell, axis=1)
    if cell < SMALLEST_CELL_WITH_GRID:
        return enlarged
    framed = np.pad(enlarged, ((0, 1), (0, 1), (0, 0)))
    framed[::cell] = GRID_LEVEL
    framed[:, ::cell] = GRID_LEVEL
    return framed
