"""What a camera's lens does to a picture: exposure, falloff towards the corners, blur."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from plycloth._check import NON_NEGATIVE, POSITIVE, number
from plycloth._value import Description
from plycloth.image import Image

FloatArray = NDArray[np.float64]
Exposure = Annotated[float, number(POSITIVE)]
NonNegative = Annotated[float, number(NON_NEGATIVE)]

# The falloff is averaged over so many points a side of each cell.
FINE = 8

# Blur is looked for up to this standard deviation in pixels, to this precision.
LARGEST_BLUR = 4.0
BLUR_STEP = 0.05
# Contrast is that within squares of so many pixels.
PATCH = 16


@dataclass(frozen=True, eq=False, repr=False)
class Lens(Description):
    """A camera's exposure and lens.

    Parameters
    ----------
    exposure
        A factor on the brightness of the whole picture, greater than 0.
    falloff
        Of a factor exp(-falloff d^2), d being the distance from the picture's middle, 1 in its
        corners; at least 0.
    blur
        Standard deviation of a Gaussian, in pixels, at least 0.

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not a number.
    """

    exposure: Exposure = 1.0
    falloff: NonNegative = 0.0
    blur: NonNegative = 0.0

    def develop(self, image: Image) -> Image:
        """Return a rendered picture as the camera takes it; with its variance if nothing blurs."""
        d2 = distance2(image.height, image.width)
        gain = (self.exposure * np.exp(-self.falloff * d2)[..., None]).astype(np.float32)
        if self.blur > 0.0:
            sharp = (image.pixels * gain).astype(np.float64)
            return Image(blurred(sharp, self.blur).astype(np.float32))
        variance = None if image.variance is None else image.variance * gain**2
        return Image(image.pixels * gain, variance)

    def gain(self, shape: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """Return the factor on cell averages, rows x columns x 1, and its derivative by falloff."""
        d2 = distance2(shape[0] * FINE, shape[1] * FINE)
        factor = self.exposure * np.exp(-self.falloff * d2)

        def averages(values: FloatArray) -> FloatArray:
            blocks = values.reshape(shape[0], FINE, shape[1], FINE)
            return np.asarray(blocks.mean((1, 3))[..., None])

        return averages(factor), averages(-d2 * factor)

    def __str__(self) -> str:
        text = f"exposure {self.exposure:.4g}, falloff {self.falloff:.4g}"
        return text if self.blur == 0.0 else f"{text}, blur {self.blur:.2g} pixels"


def distance2(height: int, width: int) -> FloatArray:
    """Return each pixel's squared distance from the picture's middle, 1 in its corners."""
    y, x = (2.0 * (np.arange(n) + 0.5) / n - 1.0 for n in (height, width))
    return np.asarray(0.5 * (y[:, None] ** 2 + x[None, :] ** 2))


def blurred(pixels: FloatArray, sigma: float) -> FloatArray:
    """Blur H x W x 3 pixels by a Gaussian of standard deviation `sigma` in pixels.

    Beyond its edges the picture goes on as its outermost pixels.
    """
    weights = _gaussian(sigma)
    reach = len(weights) // 2
    for axis in (0, 1):
        size = pixels.shape[axis]
        padding = [(reach, reach) if a == axis else (0, 0) for a in range(3)]
        padded = np.pad(pixels, padding, mode="edge")
        shifted = (np.take(padded, np.arange(k, k + size), axis) for k in range(len(weights)))
        pixels = np.sum([w * part for w, part in zip(weights, shifted, strict=True)], axis=0)
    return pixels


def contrast(pixels: FloatArray, noise: float = 0.0) -> float:
    """Return how much neighbouring pixels differ: the median relative deviation in small squares.

    That of the brightness of H x W x 3 pixels in linear light, in squares of 16 pixels a side, less
    what noise of the given relative deviation per pixel adds.
    """
    brightness = pixels.mean(axis=2)
    rows, columns = (n // PATCH for n in brightness.shape)
    patches = brightness[: rows * PATCH, : columns * PATCH].reshape(rows, PATCH, columns, PATCH)
    patches = patches.swapaxes(1, 2).reshape(rows * columns, PATCH * PATCH)
    means = patches.mean(axis=1)
    lit = means > 0.0
    relative = np.median(patches[lit].var(axis=1) / means[lit] ** 2) if lit.any() else 0.0
    return float(np.sqrt(max(relative - noise**2, 0.0)))


def matching_blur(rendered: Sequence[Image], photographs: Sequence[FloatArray]) -> float:
    """Return the blur that makes rendered pictures as smooth as the photographs of them.

    A rendered picture is sharp: yarns of a pixel or two stand out as no lens would show them. What
    the render's noise adds is left out, as far as its variance tells.

    Parameters
    ----------
    rendered
        Renders with their variance.
    photographs
        In linear light, each H x W x 3, of the same sizes.

    Returns
    -------
    float
        The standard deviation of a Gaussian, in pixels, at most 4.
    """
    wanted = np.mean([contrast(photograph) for photograph in photographs])

    def excess(sigma: float) -> float:
        reached = [_blurred_contrast(image, sigma) for image in rendered]
        return float(np.mean(reached) - wanted)

    return _falling_root(excess, LARGEST_BLUR)


def _blurred_contrast(image: Image, sigma: float) -> float:
    assert image.variance is not None
    pixels = image.pixels.astype(np.float64)
    # The channels of a sample go up and down together.
    deviation = np.sqrt(image.variance).mean(axis=2)
    noise = float(np.median(deviation / np.maximum(pixels.mean(axis=2), 1e-9)))
    return contrast(blurred(pixels, sigma), noise * float((_gaussian(sigma) ** 2).sum()))


def _gaussian(sigma: float) -> FloatArray:
    """Return weights that sum up to 1; a single 1 for no blur."""
    reach = int(np.ceil(4.0 * sigma))
    offsets = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 * (offsets / max(sigma, 1e-9)) ** 2)
    return np.asarray(weights / weights.sum())


def _falling_root(function: Callable[[float], float], high: float) -> float:
    """Return where a falling function crosses 0 within [0, `high`], by bisection."""
    low = 0.0
    if function(low) <= 0.0:
        return low
    while high - low > BLUR_STEP:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if function(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)
