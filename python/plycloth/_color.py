"""Linear light to display-encoded colours, and back."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth._check import POSITIVE, number

ROWS_AT_ONCE = 64

_gamma = number(POSITIVE)


def encode(linear: ArrayLike, gamma: float | None = None) -> NDArray[np.float64]:
    """Linear light to display values in [0, 1]: the sRGB curve (IEC 61966-2-1), or a pure gamma."""
    light = np.clip(np.asarray(linear, dtype=np.float64), 0, 1)
    if gamma is not None:
        return light ** (1 / float(_gamma("gamma", gamma)))
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * light ** (1 / 2.4) - 0.055)


def decode(display: ArrayLike, gamma: float | None = None) -> NDArray[np.float64]:
    """Display values in [0, 1] to linear light, as the inverse of `encode`."""
    codes = np.asarray(display, dtype=np.float64)
    if gamma is not None:
        return codes ** float(_gamma("gamma", gamma))
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def to_codes(linear: NDArray[np.floating], gamma: float | None = None) -> NDArray[np.uint8]:
    """Encode a picture (H x W x 3) as whole numbers from 0 to 255.

    Some rows at a time: in double precision a large picture would take several times its memory.
    """
    codes = np.empty(linear.shape, np.uint8)
    for first in range(0, len(linear), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        codes[rows] = np.round(encode(linear[rows], gamma) * 255)
    return codes
