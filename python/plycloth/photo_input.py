"""The photographs that a fit is given, read and checked."""

from collections.abc import Mapping
from dataclasses import dataclass
from os import PathLike, fspath

import numpy as np
from numpy.typing import NDArray

from plycloth._check import ParameterError
from plycloth.image import Image
from plycloth.image_read import read_photograph

FloatArray = NDArray[np.float64]
Photograph = str | PathLike[str] | Image

# Codes of 8 bits that count as white, as black, and as the same.
WHITE, BLACK, SAME = 251, 4, 1
# So large a part of the pixels may be otherwise: dust, and dead pixels.
EXCEPTIONS = 0.005


@dataclass(frozen=True, eq=False)
class Lit:
    """A photograph by the side that it is lit from.

    Parameters
    ----------
    name
        The file, or the argument that it came as.
    pixels
        In linear light, height x width x 3.
    """

    name: str
    pixels: FloatArray


def read_photographs(given: Mapping[str, Photograph | None], gamma: float) -> dict[str, Lit]:
    """Read the photographs by side ("front", "back"), and see that they tell something.

    Raises
    ------
    ParameterError
        If there is none, they differ in size, or one is white, black or of one colour all over;
        the message names the file.
    """
    photographs = {
        side: Lit(_name(side, photograph), _linear(photograph, gamma))
        for side, photograph in given.items()
        if photograph is not None
    }
    if not photographs:
        raise ParameterError("front and back must not both be None")
    _check_sizes(list(photographs.values()))
    for photograph in photographs.values():
        check_content(photograph.name, photograph.pixels, gamma)
    return photographs


def check_content(name: str, pixels: FloatArray, gamma: float) -> None:
    """See that a photograph shows more than white, black or one colour.

    Raises
    ------
    ParameterError
        If it does not.
    """
    if not np.isfinite(pixels).all() or (pixels < 0.0).any():
        raise ParameterError(f"{name}: holds light that is negative, infinite or NaN")
    codes = 255.0 * np.clip(pixels, 0.0, 1.0) ** (1.0 / gamma)
    low, high = np.quantile(codes, [EXCEPTIONS, 1.0 - EXCEPTIONS], axis=(0, 1))
    if low.min() >= WHITE:
        raise ParameterError(
            f"{name}: is white all over, and so tells nothing about the cloth; expose it less"
        )
    if high.max() <= BLACK:
        raise ParameterError(
            f"{name}: is black all over, and so tells nothing about the cloth; expose it more"
        )
    if (high - low).max() <= SAME:
        raise ParameterError(f"{name}: shows one colour all over, no cloth in the light of a lamp")


def _check_sizes(photographs: list[Lit]) -> None:
    first, *others = photographs
    for other in others:
        if other.pixels.shape != first.pixels.shape:
            raise ParameterError(
                f"front and back must have the same size, but {first.name} has {_size(first)}"
                f" and {other.name} {_size(other)} pixels"
            )


def _size(photograph: Lit) -> str:
    return "{1} x {0}".format(*photograph.pixels.shape)


def _name(side: str, photograph: Photograph) -> str:
    return side if isinstance(photograph, Image) else fspath(photograph)


def _linear(photograph: Photograph, gamma: float) -> FloatArray:
    image = photograph if isinstance(photograph, Image) else read_photograph(photograph, gamma)
    return image.pixels.astype(np.float64)
