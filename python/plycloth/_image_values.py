"""What a picture does as values: sums and products, pieces, and the way into other libraries."""

from collections.abc import Callable
from typing import Any, Self, cast

import numpy as np
import numpy.typing as npt

from plycloth._check import ParameterError

Pixels = npt.NDArray[np.float32]
Wide = npt.NDArray[np.float64]

# Devices are pairs of a kind and a number (DLPack specification): this is the main memory.
CPU = (1, 0)


class ImageValues:
    """Arithmetic, slices and DLPack of an `Image`.

    `+ - * /` take images of the same size, numbers, and arrays that broadcast to height x width
    x 3, such as three gains; they compute in double precision and give an Image. Numbers and
    arrays are taken as exact, and variances follow by propagation of errors to first order (which
    is exact for sums, differences and factors). Two images are taken to be independent, as renders
    with different seeds are, but an image and itself as one: `a - a` is without variance. Nothing
    tells that others share samples (`a` and `2 * a`): take `Image(a.pixels)`, which has no
    variance. Where one of two images has none, nothing is known of the result's, which has none
    either.
    """

    pixels: Pixels
    variance: Pixels | None

    # Arrays leave `array + image` to the image, though numpy's functions still take it.
    __array_priority__ = 1000.0

    def __add__(self, other: object) -> Self:
        return self._combined(other, lambda a, b: (a + b, 1.0, 1.0))

    def __sub__(self, other: object) -> Self:
        return self._combined(other, lambda a, b: (a - b, 1.0, -1.0))

    def __mul__(self, other: object) -> Self:
        return self._combined(other, lambda a, b: (a * b, b, a))

    def __truediv__(self, other: object) -> Self:
        return self._combined(other, _quotient)

    def __radd__(self, other: object) -> Self:
        return self + other

    def __rsub__(self, other: object) -> Self:
        return self._combined(other, lambda a, b: (b - a, -1.0, 1.0))

    def __rmul__(self, other: object) -> Self:
        return self * other

    def __rtruediv__(self, other: object) -> Self:
        def quotient(a: Wide, b: Wide) -> tuple[Any, Any, Any]:
            value, by_b, by_a = _quotient(b, a)
            return value, by_a, by_b

        return self._combined(other, quotient)

    def __neg__(self) -> Self:
        return self._made(-self.pixels, self.variance)

    def __pos__(self) -> Self:
        return self

    def _made(self, pixels: Any, variance: Any) -> Self:
        kind: Any = type(self)
        image: Self = kind(pixels, variance)
        return image

    def _combined(
        self, other: object, function: Callable[[Wide, Wide], tuple[Any, Any, Any]]
    ) -> Self:
        """Return a function of the pixels; it also gives its derivatives by both."""
        operand = self._operand(other)
        if operand is None:
            return cast(Self, NotImplemented)
        pixels, variance = operand
        with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
            value, by_own, by_other = function(self.pixels.astype(np.float64), pixels)
            if other is self:
                spread = _spread(by_own + by_other, self.variance)
            elif self.variance is None or variance is None:
                spread = None
            else:
                spread = _spread(by_own, self.variance) + _spread(by_other, variance)
            return self._made(value, spread)

    def _operand(self, other: object) -> tuple[Wide, Any] | None:
        """Return pixels and variance of what an image meets; None if that is no such thing."""
        if isinstance(other, ImageValues):
            if other.pixels.shape != self.pixels.shape:
                raise ParameterError(
                    f"images must have the same size, {_size(self.pixels)}, not"
                    f" {_size(other.pixels)}"
                )
            return other.pixels.astype(np.float64), other.variance
        if not isinstance(other, int | float | np.ndarray | np.number) or isinstance(other, bool):
            return None
        values = np.asarray(other)
        if values.dtype.kind not in "fiu":
            return None
        try:
            return np.broadcast_to(values, self.pixels.shape).astype(np.float64), 0.0
        except ValueError:
            raise ParameterError(
                f"an array must broadcast to the image's shape {self.pixels.shape}, not have the"
                f" shape {values.shape}"
            ) from None

    def __getitem__(self, key: Any) -> Any:
        """Return an Image for slices of rows and columns, else what `pixels` has there."""
        if not _is_rectangle(key):
            return self.pixels[key]
        pixels = self.pixels[key]
        if pixels.size == 0:
            raise ParameterError(f"no pixel of an image of {_size(self.pixels)} lies in {key}")
        variance = None if self.variance is None else self.variance[key]
        return self._made(pixels, variance)

    def __dlpack__(
        self,
        *,
        stream: Any = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any:
        """Hand a copy of the pixels to another library, such as `torch.from_dlpack(image)`.

        Always a copy: most libraries would write into pixels that are read-only.
        """
        if copy is False:
            raise BufferError("pixels are read-only: they are handed over as a copy")
        if dl_device is not None and tuple(dl_device) != CPU:
            raise BufferError(f"pixels are in main memory {CPU}, not on the device {dl_device}")
        return self.pixels.copy().__dlpack__(stream=stream)

    def __dlpack_device__(self) -> tuple[int, int]:
        return CPU


def _quotient(a: Wide, b: Wide) -> tuple[Any, Any, Any]:
    value = a / b
    return value, 1.0 / b, -value / b


def _spread(slope: Any, variance: Any) -> Any:
    """Return the variance of something with this slope; what does not vary with it adds none."""
    if variance is None:
        return None
    spread = np.where(np.equal(slope, 0.0) | np.equal(variance, 0.0), 0.0, slope**2 * variance)
    # Of a quotient by zero nothing is known.
    return np.where(np.isnan(spread), np.inf, spread)


def _is_rectangle(key: Any) -> bool:
    keys = key if isinstance(key, tuple) else (key,)
    return len(keys) <= 2 and all(isinstance(each, slice) for each in keys)


def _size(pixels: Pixels) -> str:
    return f"{pixels.shape[1]} x {pixels.shape[0]}"
