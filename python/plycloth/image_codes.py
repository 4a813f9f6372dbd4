"""Display-encoded pictures (PNG, JPEG, TIFF, WebP, HEIC) as codes of sRGB."""

import importlib
import io
import warnings
from dataclasses import dataclass, replace
from os import fspath
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as PilImage
from PIL import ImageCms, ImageOps, TiffTags, UnidentifiedImageError

from plycloth import _plycloth
from plycloth.image_file import HEIC, ImageError, ImageWarning, PathOrStr

# TIFF 6.0, section 8: bits of each sample.
BITS_PER_SAMPLE = next(
    tag for tag, info in TiffTags.TAGS_V2.items() if info.name == "BitsPerSample"
)

TIFF_SIGNATURES = (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")

# PNG specification, 11.3.2.5: sRGB pictures may say that their gamma is about this.
SRGB_GAMMA, GAMMA_ROUNDING = 2.2, 0.05

# Grey of a bit or a byte, with transparency or without.
GREY_MODES = ("1", "L", "LA", "La")


@dataclass(frozen=True)
class Codes:
    """A picture as its file has it, upright and without transparency.

    Parameters
    ----------
    values : ndarray, (height, width, 3)
        Codes of sRGB: uint8, or float32 from 0 to 1. If `is_linear`, linear light.
    is_linear : bool
        Whether the file held floats, which are linear.
    gamma : float, optional
        What the file itself says of its codes: they mean light by ``code ** gamma``. None: by the
        sRGB curve.
    """

    values: npt.NDArray[Any]
    is_linear: bool = False
    gamma: float | None = None


def read_codes(data: bytes, path: PathOrStr, suffix: str) -> Codes:
    """Read a display-encoded picture, with as many bits as it has.

    What an embedded ICC profile says of its colours is applied.

    Raises
    ------
    ImageError
        If it is no such picture, or pillow-heif is missing for one that needs it.

    Warns
    -----
    ImageWarning
        If its profile cannot be used.
    """
    if suffix in HEIC:
        _register_heic(path)
    try:
        with PilImage.open(io.BytesIO(data)) as stored:
            kind, profile = stored.format, stored.info.get("icc_profile")
            gamma = _own_gamma(stored)
            if stored.mode == "F":
                return Codes(_three(np.asarray(stored)[..., None]), is_linear=True)
            if not _is_deep(stored, data):
                return Codes(_shallow(stored, path), gamma=gamma)
    except PilImage.DecompressionBombError as error:
        raise ImageError(f"{fspath(path)}: has too many pixels: {error}") from error
    except UnidentifiedImageError as error:
        # Pillow opens no TIFF of floats in colour.
        if not data.startswith(TIFF_SIGNATURES):
            # Pillow's own words hold an address in memory.
            what = "the file is empty" if not data else "it holds none of a known format"
            raise ImageError(f"{fspath(path)}: not a readable picture: {what}") from error
        kind, profile, gamma = "TIFF", None, None
    except (OSError, SyntaxError, ValueError) as error:
        raise ImageError(f"{fspath(path)}: not a readable picture: {error}") from error
    return replace(_deep(data, str(kind), profile, path), gamma=gamma)


def _is_deep(stored: PilImage.Image, data: bytes) -> bool:
    """Tell whether a picture has more than the 8 bits per channel of colour that Pillow keeps."""
    if stored.format == "PNG":
        # PNG specification, 11.2.2: behind 8 bytes of signature, 8 of chunk head, two sizes of 4.
        return data[24] > 8
    if stored.format == "TIFF":
        bits: tuple[int, ...] = stored.tag_v2.get(BITS_PER_SAMPLE, (1,))  # type: ignore[attr-defined]
        return max(bits) > 8
    return False


def _own_gamma(stored: PilImage.Image) -> float | None:
    """Return what a PNG's gAMA chunk says, unless a profile says more or it is sRGB's."""
    exponent = stored.info.get("gamma")
    if not exponent or "icc_profile" in stored.info or "srgb" in stored.info:
        return None
    gamma = 1 / float(exponent)
    return None if abs(gamma - SRGB_GAMMA) < GAMMA_ROUNDING else gamma


def _deep(data: bytes, kind: str, profile: bytes | None, path: PathOrStr) -> Codes:
    try:
        values, is_float = _plycloth.decode_codes(data, kind)
    except ValueError as error:
        raise ImageError(f"{fspath(path)}: {error}") from error
    if is_float:
        return Codes(values, is_linear=True)
    return Codes(_three(_managed(values, profile, path)))


def _shallow(stored: PilImage.Image, path: PathOrStr) -> npt.NDArray[Any]:
    profile = stored.info.get("icc_profile")
    picture = ImageOps.exif_transpose(stored)
    if picture.mode == "CMYK" and profile:
        return np.asarray(_without_inks(picture, profile, path))
    codes = np.asarray(picture.convert("L" if picture.mode in GREY_MODES else "RGB"))
    return _three(_managed(np.atleast_3d(codes), profile, path))


def _without_inks(picture: PilImage.Image, profile: bytes, path: PathOrStr) -> PilImage.Image:
    """Apply the profile of a printer's inks, of which 8 bits are all that Pillow reads."""
    try:
        inks = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        srgb = ImageCms.createProfile("sRGB")
        shown = ImageCms.profileToProfile(picture, inks, srgb, outputMode="RGB")
    except (OSError, ImageCms.PyCMSError) as error:
        _warn_of_profile(path, error)
        return picture.convert("RGB")
    assert shown is not None
    return shown


def _managed(codes: npt.NDArray[Any], profile: bytes | None, path: PathOrStr) -> npt.NDArray[Any]:
    """Apply an ICC profile; the codes are left as they are if there is none of use."""
    if not profile:
        return codes
    fractions = codes.astype(np.float32) / np.float32(255 if codes.dtype == np.uint8 else 1)
    try:
        return _plycloth.to_srgb(fractions, profile)
    except ValueError as error:
        _warn_of_profile(path, error)
        return codes


def _warn_of_profile(path: PathOrStr, error: Exception) -> None:
    message = f"{fspath(path)}: its colour profile is of no use and left out: {error}"
    warnings.warn(ImageWarning(message), stacklevel=2)


def _three(codes: npt.NDArray[Any]) -> npt.NDArray[Any]:
    return np.repeat(codes, 3, axis=2) if codes.shape[2] == 1 else codes


def _register_heic(path: PathOrStr) -> None:
    try:
        importlib.import_module("pillow_heif").register_heif_opener()
    except ImportError as error:
        raise ImageError(
            f"{fspath(path)}: to read HEIC, install the package pillow-heif"
        ) from error
