"""Pictures in linear light: read, write, show and compare them."""

import io
import warnings
from dataclasses import dataclass
from os import PathLike, fspath
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image as PilImage
from PIL import ImageOps, UnidentifiedImageError

from plycloth import _plycloth
from plycloth._check import nearest
from plycloth._color import decode, encode

PathOrStr = str | PathLike[str]
FloatArray = npt.NDArray[np.floating]

WRITABLE = (".exr", ".png")
READABLE = (".exr", ".png", ".jpg", ".jpeg")
# Shown in place of NaN where a picture must not fail: a colour that cloth does not have.
NAN_COLOR = (1.0, 0.0, 1.0)


class ImageError(ValueError):
    """A file that is not a picture, or a picture that cannot be written."""


class ImageWarning(UserWarning):
    """A picture was read, but not as precisely as the file has it."""


@dataclass(frozen=True, eq=False, repr=False)
class Image:
    """A picture in linear light; shows itself in a notebook and passes as an array.

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

    def __post_init__(self) -> None:
        pixels = _owned(self.pixels)
        if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
            raise ValueError(f"pixels: has the shape {pixels.shape}, but must be H x W x 3")
        object.__setattr__(self, "pixels", pixels)
        if self.variance is None:
            return
        variance = _owned(self.variance)
        if variance.shape != pixels.shape:
            raise ValueError(
                f"variance: has the shape {variance.shape}, but the pixels have {pixels.shape}"
            )
        if not (variance >= 0).all():
            bad = np.count_nonzero(~(variance >= 0))
            raise ValueError(f"variance: {bad} values are negative or NaN, but must be at least 0")
        object.__setattr__(self, "variance", variance)

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

    def __reduce__(self) -> tuple[type["Image"], tuple[object, ...]]:
        # Made anew, a copy is read-only again.
        return Image, (self.pixels, self.variance)

    def __repr__(self) -> str:
        with_variance = "" if self.variance is None else ", with variance"
        return f"<Image {self.width} x {self.height}, mean {self.pixels.mean():.4g}{with_variance}>"

    def save(self, path: PathOrStr, *, gamma: float | None = None) -> None:
        """Write the picture to a file.

        Parameters
        ----------
        path : path
            Ends in ``.exr`` (linear 32-bit floats, without loss) or ``.png`` (8 bit per channel;
            values outside [0, 1] are clipped).
        gamma : float, optional
            PNG only: encode by ``value ** (1 / gamma)`` in place of the sRGB curve.

        Raises
        ------
        ImageError
            On another suffix, or NaN on the way to a PNG.
        ValueError
            On a gamma that is not positive, or one for an EXR.
        OSError
            When the file cannot be written.
        """
        suffix = _checked_suffix(path, WRITABLE)
        if suffix == ".png":
            data = self.to_png(gamma)
        elif gamma is not None:
            raise ValueError("gamma: is for PNG only; an EXR holds linear light")
        else:
            data = _plycloth.encode_exr(self.pixels)
        Path(path).write_bytes(data)

    def z_scores(self, other: "Image") -> npt.NDArray[np.float64]:
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
        missing = np.count_nonzero(np.isnan(self.pixels).any(axis=2))
        if missing:
            raise ImageError(
                f"pixels: {missing} of {self.width * self.height} are NaN, which a PNG cannot "
                "hold; save them as .exr to look into it"
            )
        codes = np.round(encode(self.pixels, gamma) * 255).astype(np.uint8)
        data = io.BytesIO()
        PilImage.fromarray(codes).save(data, format="png")
        return data.getvalue()

    def _repr_png_(self) -> bytes:
        missing = np.isnan(self.pixels).any(axis=2, keepdims=True)
        return Image(np.where(missing, np.array(NAN_COLOR, np.float32), self.pixels)).to_png()


def read_image(path: PathOrStr, gamma: float | None = None) -> Image:
    """Read a picture file as linear light.

    Parameters
    ----------
    path : path
        ``.png``, ``.jpg``, ``.jpeg`` (8 bit, or 16 bit grey) or ``.exr`` (any compression). Alpha
        is left out; a photograph that its camera marked as rotated is turned upright.
    gamma : float, optional
        For all but EXR, which is linear already: decode by ``code ** gamma`` in place of the sRGB
        curve.

    Raises
    ------
    OSError
        When the file cannot be read: FileNotFoundError, IsADirectoryError, PermissionError.
    ImageError
        On another suffix, or a file that is not such a picture.
    ValueError
        On a gamma that is not positive, or one for an EXR.

    Warns
    -----
    ImageWarning
        On a PNG with 16 bits per colour channel, of which the upper 8 are read.
    """
    suffix = _checked_suffix(path, READABLE)
    data = Path(path).read_bytes()
    if suffix != ".exr":
        return Image(decode(_codes(data, path), gamma).astype(np.float32))
    if gamma is not None:
        raise ValueError("gamma: is for PNG and JPEG only; an EXR holds linear light")
    try:
        return Image(_plycloth.decode_exr(data))
    except ValueError as error:
        raise ImageError(f"{fspath(path)}: {error}") from error


def _codes(data: bytes, path: PathOrStr) -> npt.NDArray[np.float64]:
    try:
        with PilImage.open(io.BytesIO(data)) as stored:
            picture = ImageOps.exif_transpose(stored)
            if picture.mode.startswith("I"):
                grey = np.asarray(picture, dtype=np.float64) / 65535
                return np.repeat(grey[:, :, None], 3, axis=2)
            if stored.format == "PNG" and _png_bit_depth(data) == 16:
                warnings.warn(
                    f"{fspath(path)}: has 16 bits per colour channel, of which 8 are read; "
                    "an EXR keeps them all",
                    ImageWarning,
                    stacklevel=3,
                )
            return np.asarray(picture.convert("RGB"), dtype=np.float64) / 255
    except PilImage.DecompressionBombError as error:
        raise ImageError(f"{fspath(path)}: has too many pixels: {error}") from error
    except UnidentifiedImageError as error:
        what = "the file is empty" if not data else "it holds none of a known format"
        raise ImageError(f"{fspath(path)}: not a readable picture: {what}") from error
    except (OSError, SyntaxError) as error:
        raise ImageError(f"{fspath(path)}: not a readable picture: {error}") from error


def _png_bit_depth(data: bytes) -> int:
    # PNG specification, 11.2.2: behind 8 bytes of signature, 8 of chunk head and two sizes of 4.
    return data[24]


def _owned(values: npt.ArrayLike) -> npt.NDArray[np.float32]:
    array = np.array(values, dtype=np.float32, order="C")
    array.flags.writeable = False
    return array


def _checked_suffix(path: PathOrStr, valid: tuple[str, ...]) -> str:
    suffix = Path(path).suffix.lower()
    if suffix in valid:
        return suffix
    raise ImageError(
        f"{fspath(path)}: has the suffix {suffix!r}, but must be one of {', '.join(valid)}; "
        f"the nearest is {nearest(suffix, valid)}"
    )
