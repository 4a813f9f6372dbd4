"""Pictures in linear light: hold, write, show and compare them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from plycloth._check import real_array
from plycloth._image_values import ImageValues
from plycloth.image_file import WRITABLE, PathOrStr, checked_suffix
from plycloth.image_write import encode_file

FloatArray = npt.NDArray[np.floating]

# Shown in place of NaN where a picture must not fail: a colour that cloth does not have.
NAN_COLOR = (1.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class Image(ImageValues):
    """A picture in linear light; shows itself in a notebook and passes as an array.

    Images can be added, subtracted, multiplied and divided, also by numbers and arrays, and their
    variances follow: independent images' add up, an image without one gives a result without.
    `image[10:20, 30:40]` is the Image of these rows and columns.

    Parameters
    ----------
    pixels : array_like, (height, width, 3)
        Linear RGB; kept as read-only float32. The top row comes first.
    variance : array_like, (height, width, 3), optional
        Variance of each value of `pixels`, that is, of the mean of its samples.

    Raises
    ------
    ValueError
        On a wrong shape, or a variance that is negative or NaN.
    """

    pixels: npt.NDArray[np.float32]
    variance: npt.NDArray[np.float32] | None = None

    if TYPE_CHECKING:

        def __init__(self, pixels: npt.ArrayLike, variance: npt.ArrayLike | None = ...) -> None: ...

    def __post_init__(self) -> None:
        pixels = _owned("pixels", self.pixels)
        if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
            raise ValueError(f"pixels: has the shape {pixels.shape}, but must be H x W x 3")
        object.__setattr__(self, "pixels", pixels)
        if self.variance is None:
            return
        variance = _owned("variance", self.variance)
        if variance.shape != pixels.shape:
            raise ValueError(
                f"variance: has the shape {variance.shape}, but the pixels have {pixels.shape}"
            )
        if not (variance >= 0).all():
            bad = np.count_nonzero(~(variance >= 0))
            raise ValueError(f"variance: {bad} values are negative or NaN, but must be at least 0")
        object.__setattr__(self, "variance", variance)

    @classmethod
    def adopt(
        cls, pixels: npt.NDArray[np.float32], variance: npt.NDArray[np.float32] | None
    ) -> Image:
        """Make a picture of arrays that nobody else holds: they are neither copied nor checked."""
        image = object.__new__(cls)
        for name, values in (("pixels", pixels), ("variance", variance)):
            if values is not None:
                values.flags.writeable = False
            object.__setattr__(image, name, values)
        return image

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.pixels.shape[0])

    @property
    def width(self) -> int:
        """Pixels per row."""
        return int(self.pixels.shape[1])

    def __array__(
        self, dtype: npt.DTypeLike | None = None, copy: bool | None = None
    ) -> npt.NDArray[np.generic]:
        wanted = self.pixels.dtype if dtype is None else np.dtype(dtype)
        if wanted != self.pixels.dtype:
            if copy is False:
                raise ValueError(f"dtype: {wanted} needs a copy, but copy=False forbids one")
            return self.pixels.astype(wanted)
        return self.pixels.copy() if copy else self.pixels

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Image):
            return NotImplemented
        return np.array_equal(self.pixels, other.pixels, equal_nan=True) and (
            np.array_equal(self.variance, other.variance)
            if self.variance is not None and other.variance is not None
            else self.variance is other.variance
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[type[Image], tuple[object, ...]]:
        # Made anew, a copy is read-only again.
        return Image, (self.pixels, self.variance)

    def __repr__(self) -> str:
        with_variance = "" if self.variance is None else ", with variance"
        return f"<Image {self.width} x {self.height}, mean {self.pixels.mean():.4g}{with_variance}>"

    def save(
        self, path: PathOrStr, *, gamma: float | None = None, dpi: float | None = None
    ) -> None:
        """Write the picture to a file.

        Parameters
        ----------
        path : path
            Ends in ``.exr`` (linear 32-bit floats, without loss), or in ``.png``, ``.tif``,
            ``.tiff``, ``.jpg`` or ``.jpeg`` (8 bit per channel; values outside [0, 1] are
            clipped).
        gamma : float, optional
            For all but EXR: encode by ``value ** (1 / gamma)`` in place of the sRGB curve.
        dpi : float, optional
            Resolution to note in the file, pixels per inch, in [1, 65535]; JPEG rounds it to a
            whole number, PNG to pixels per metre. None: the file says nothing of it.

        Raises
        ------
        ImageError
            On another suffix, NaN on the way to anything but an EXR, or a picture too large for
            its format.
        ValueError
            On a gamma that is not positive, or one for an EXR; on a resolution out of range.
        OSError
            When the file cannot be written.
        """
        suffix = checked_suffix(path, WRITABLE)
        Path(path).write_bytes(encode_file(self.pixels, suffix, gamma, dpi))

    def z_scores(self, other: Image) -> npt.NDArray[np.float64]:
        """How many standard deviations lie between two independent renders, value by value.

        Parameters
        ----------
        other : Image
            Of the same size.

        Returns
        -------
        ndarray, (height, width, 3)
            ``(self - other) / sqrt(self.variance + other.variance)``: standard normal where both
            estimate the same mean from many samples. Where neither varies, 0 if they agree and an
            infinity if they do not.

        Raises
        ------
        ValueError
            If a variance is missing or the sizes differ.
        """
        if self.pixels.shape != other.pixels.shape:
            raise ValueError(
                f"other: has the shape {other.pixels.shape}, but this one has {self.pixels.shape}"
            )
        if self.variance is None or other.variance is None:
            raise ValueError("variance: both pictures need one for z-scores")
        difference = self.pixels.astype(np.float64) - other.pixels
        deviation = np.sqrt(self.variance.astype(np.float64) + other.variance)
        certain = np.where(difference == 0, 0.0, np.copysign(np.inf, difference))
        return np.divide(difference, deviation, out=certain, where=deviation > 0)

    def to_png(self, gamma: float | None = None) -> bytes:
        """Return the picture as a PNG file in memory, encoded as `save` does.

        Raises
        ------
        ImageError
            If a value is NaN.
        ValueError
            On a gamma that is not positive.
        """
        return encode_file(self.pixels, ".png", gamma, None)

    def _repr_png_(self) -> bytes:
        missing = np.isnan(self.pixels).any(axis=2, keepdims=True)
        return Image(np.where(missing, np.array(NAN_COLOR, np.float32), self.pixels)).to_png()


def _owned(name: str, values: npt.ArrayLike) -> npt.NDArray[np.float32]:
    array = np.array(real_array(name, values, kinds="bfiu"), dtype=np.float32, order="C")
    array.flags.writeable = False
    return array
