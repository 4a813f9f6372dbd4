"""Linear light from picture files."""

from __future__ import annotations

import warnings
from os import fspath
from pathlib import Path

import numpy as np
import numpy.typing as npt

from plycloth import _plycloth
from plycloth._check import instance, optional, quoted
from plycloth._color import decode
from plycloth.image import Image
from plycloth.image_codes import Codes, read_codes
from plycloth.image_file import READABLE, ImageError, ImageWarning, PathOrStr, checked_suffix

_layer = optional(instance(str))

# What a file is called that holds light, not codes for a display.
LINEAR_KINDS = {".exr": "an EXR", ".hdr": "a Radiance picture"}


def read_image(path: PathOrStr, gamma: float | None = None, *, layer: str | None = None) -> Image:
    """Read a picture file as linear light, with the primaries of sRGB (Rec. 709).

    Parameters
    ----------
    path : path
        - ``.png``, ``.tif``, ``.tiff`` (8 or 16 bit; a TIFF of floats holds linear light),
          ``.jpg``, ``.jpeg``, ``.webp``, and with the package pillow-heif ``.heic`` and ``.heif``.
          An embedded ICC profile is applied; colours outside sRGB are clipped to it. Without one
          a PNG's own gamma is. A photograph that its camera marked as rotated is turned upright.
        - ``.exr``, flat, not subsampled, any compression but HTJ2K. Chromaticities that the file
          names are converted, and so are luminance and chroma.
        - ``.hdr`` (Radiance), before any exposure that its header names.

        Alpha is left out.
    gamma : float, optional
        For what is not linear already: decode by ``code ** gamma`` in place of the sRGB curve,
        after the ICC profile if there is one.
    layer : str, optional
        EXR only: the layer or part to read, by name. None: the first that has colour (R, G and B,
        or Y, RY and BY), channels without a layer's name before others; if none has, the first
        that is grey (Y).

    Raises
    ------
    OSError
        When the file cannot be read: FileNotFoundError, IsADirectoryError, PermissionError.
    ImageError
        On another suffix, a file that is not such a picture, or a layer that it does not have.
    ValueError
        On a gamma that is not positive, or one for a picture in linear light.

    Warns
    -----
    ImageWarning
        If an ICC profile cannot be used, or other layers could have been meant.
    """
    stored = _read(path, layer)
    if stored.is_linear and gamma is not None:
        kind = LINEAR_KINDS.get(Path(path).suffix.lower(), "a TIFF of floats")
        raise ValueError(f"gamma: is for display-encoded pictures; {kind} holds linear light")
    return Image(_light(stored, gamma))


def read_photograph(path: PathOrStr, gamma: float) -> Image:
    """Read a picture as `read_image` does; the gamma is that of display-encoded ones alone."""
    return Image(_light(_read(path, None), gamma))


def _read(path: PathOrStr, layer: str | None) -> Codes:
    suffix = checked_suffix(path, READABLE)
    layer = _layer("layer", layer)
    if layer is not None and suffix != ".exr":
        raise ImageError(f"{fspath(path)}: has no layers; layer= is for EXR")
    data = Path(path).read_bytes()
    if suffix not in LINEAR_KINDS:
        return read_codes(data, path, suffix)
    try:
        pixels = _exr(data, path, layer) if suffix == ".exr" else _plycloth.decode_radiance(data)
    except ValueError as error:
        raise ImageError(f"{fspath(path)}: {error}") from error
    return Codes(pixels, is_linear=True)


def _exr(data: bytes, path: PathOrStr, layer: str | None) -> npt.NDArray[np.float32]:
    pixels, chosen, others = _plycloth.decode_exr(data, layer)
    if others:
        message = (
            f"{fspath(path)}: the layer {quoted(chosen)} is read; layer= names another:"
            f" {', '.join(map(repr, others))}"
        )
        warnings.warn(ImageWarning(message), stacklevel=4)
    return pixels


def _light(stored: Codes, gamma: float | None) -> npt.NDArray[np.float32]:
    if stored.is_linear:
        return stored.values.astype(np.float32)
    gamma = stored.gamma if gamma is None else gamma
    if stored.values.dtype == np.uint8:
        of_code = decode(np.arange(256) / 255, gamma).astype(np.float32)
        return np.take(of_code, stored.values)
    light = np.empty(stored.values.shape, np.float32)
    # Row by row: in double precision the whole takes many times its memory.
    for row, codes in zip(light, stored.values, strict=True):
        row[:] = decode(codes, gamma)
    return light
