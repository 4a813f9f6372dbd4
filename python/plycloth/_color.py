"""Display-encoded colours to linear light."""

import numpy as np
from numpy.typing import ArrayLike, NDArray


def decode_srgb(encoded: ArrayLike) -> NDArray[np.float64]:
    """Return the linear light of sRGB values in [0, 1] (IEC 61966-2-1), in the same shape."""
    encoded = np.asarray(encoded, np.float64)
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
