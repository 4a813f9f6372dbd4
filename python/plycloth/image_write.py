"""Picture files from linear light."""

import io
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image as PilImage

from plycloth import _plycloth
from plycloth._check import Range, number, optional
from plycloth._color import to_codes
from plycloth.image_file import ImageError

Pixels = npt.NDArray[np.float32]

# A JPEG holds its resolution as a whole number of 16 bits.
DPI = Range(1.0, 65535.0)

# What Pillow is told beside the pixels: no loss where there need be none, and little in JPEG, whose
# halved chroma would blur the colours of single yarns.
OPTIONS: dict[str, dict[str, Any]] = {
    "PNG": {},
    "TIFF": {"compression": "tiff_adobe_deflate"},
    "JPEG": {"quality": 95, "subsampling": "4:4:4"},
}
FORMATS = {".png": "PNG", ".tif": "TIFF", ".tiff": "TIFF", ".jpg": "JPEG", ".jpeg": "JPEG"}

checked_dpi = optional(number(DPI))


def encode_file(pixels: Pixels, suffix: str, gamma: float | None, dpi: float | None) -> bytes:
    """Return the file of a picture; `suffix` is one of `image_file.WRITABLE`.

    Raises
    ------
    ImageError
        On NaN in anything but an EXR, or a picture too large for its format.
    ValueError
        On a gamma that is not positive or is for an EXR, or a resolution outside [1, 65535].
    """
    dpi = checked_dpi("dpi", dpi)
    if suffix == ".exr":
        if gamma is not None:
            raise ValueError("gamma: is for display-encoded pictures; an EXR holds linear light")
        return _plycloth.encode_exr(pixels, dpi)
    return _encode_codes(pixels, FORMATS[suffix], gamma, dpi)


def _encode_codes(
    pixels: Pixels, file_format: str, gamma: float | None, dpi: float | None
) -> bytes:
    height, width, _ = pixels.shape
    missing = np.count_nonzero(np.isnan(pixels).any(axis=2))
    if missing:
        raise ImageError(
            f"pixels: {missing} of {width * height} are NaN, which a {file_format} cannot "
            "hold; save them as .exr to look into it"
        )
    codes = to_codes(pixels, gamma)
    resolution = {} if dpi is None else {"dpi": (dpi, dpi)}
    data = io.BytesIO()
    try:
        PilImage.fromarray(codes).save(
            data, format=file_format, **OPTIONS[file_format], **resolution
        )
    except OSError as error:
        raise ImageError(
            f"pixels: {width} x {height} of them cannot be written as {file_format}: {error}"
        ) from error
    return data.getvalue()
