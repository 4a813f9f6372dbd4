"""Environment maps from files: light from all around, as much of it as a sky can have."""

from dataclasses import dataclass
from os import fspath

import numpy as np
import numpy.typing as npt

from plycloth._check import RADIOMETRIC
from plycloth.image_file import ImageError, PathOrStr
from plycloth.image_read import read_image

Pixels = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class EnvironmentMap:
    """The radiance of a map.

    Parameters
    ----------
    pixels : ndarray, (height, width, 3)
        Linear RGB, each in [0, 1e15].
    replaced : str, optional
        Which values of the file are no radiance, how many, how extreme, and what stands in their
        place; None if there are none.
    """

    pixels: Pixels
    replaced: str | None = None


def read_environment_map(path: PathOrStr) -> EnvironmentMap:
    """Read a map, with values that are no radiance replaced.

    Lossy compression leaves negative values, half floats turn bright suns into infinities, and
    some programs write NaN where nothing was seen. Negative values and NaN become 0, those that are
    infinite or above 1e15 the brightest value of the others.

    Raises
    ------
    OSError
        If the file cannot be opened.
    ImageError
        If it holds no picture, or no value that is a radiance.
    """
    pixels = read_image(path).pixels
    valid = RADIOMETRIC.holds(pixels)
    if valid.all():
        return EnvironmentMap(pixels)
    if not valid.any():
        raise ImageError(f"{fspath(path)}: holds no radiance: no value is in [0, 1e15]")
    brightest = pixels[valid].max()
    negative, bright, missing = pixels < 0, pixels > RADIOMETRIC.high, np.isnan(pixels)
    faults = []
    if negative.any():
        faults.append(f"{negative.sum()} negative, down to {pixels[negative].min():g} (now 0)")
    if bright.any():
        highest = pixels[bright].max()
        faults.append(f"{bright.sum()} above 1e15, up to {highest:g} (now {brightest:g})")
    if missing.any():
        faults.append(f"{missing.sum()} NaN (now 0)")
    replaced = (
        f"{fspath(path)}: {pixels.size - valid.sum()} of {pixels.size} values are no radiance: "
        + ", ".join(faults)
    )
    mended = np.where(valid, pixels, np.where(bright, brightest, np.float32(0)))
    return EnvironmentMap(mended, replaced)
