"""Linear light to display-encoded colours, and back."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth._check import POSITIVE, number

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
