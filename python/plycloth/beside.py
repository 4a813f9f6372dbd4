"""Pictures beside each other in one, each with a label."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib
import numpy as np
from numpy.typing import NDArray
from PIL import Image as PilImage
from PIL import ImageDraw, ImageFont

from plycloth._check import ParameterError, integer
from plycloth._color import decode
from plycloth.image import Image

# In parts of the height of the pictures.
GAP = 1 / 32
LABEL = 1 / 16
SMALLEST_LABEL = 14

Pixels = NDArray[np.float32]

_height = integer(8, 65536)


def side_by_side(pictures: Sequence[tuple[str, Image]], height: int) -> Image:
    """Return one picture with all of them from left to right, labels below, on white.

    Parameters
    ----------
    pictures
        One or more pairs of a label and a picture. A label too long for its picture is cut.
    height
        To which they are scaled, in pixels, 8 to 65536.

    Raises
    ------
    ParameterError
        If there is no picture, or the height lies outside its range.
    TypeError
        If the height is not whole.
    """
    if not pictures:
        raise ParameterError("pictures must hold at least one")
    rows = checked_height(height)
    strip = max(round(2 * LABEL * rows), SMALLEST_LABEL)
    gap = np.ones((rows + strip, max(round(GAP * rows), 1), 3), np.float32)
    parts = []
    for label, picture in pictures:
        scaled = _scaled(picture, rows)
        parts += [gap, np.concatenate([scaled, _label(label, scaled.shape[1], strip)])]
    return Image(np.concatenate(parts[1:], axis=1))


def checked_height(height: int) -> int:
    """Return a height that pictures may be scaled to, or raise an error that says which may."""
    stored: int = _height("height", height)
    return stored


def _scaled(picture: Image, height: int) -> Pixels:
    if picture.height == height:
        return picture.pixels
    size = (max(round(picture.width * height / picture.height), 1), height)
    channels = [
        PilImage.fromarray(np.ascontiguousarray(picture.pixels[..., channel])).resize(
            size, PilImage.Resampling.BILINEAR
        )
        for channel in range(3)
    ]
    return np.stack([np.asarray(channel) for channel in channels], axis=2)


def _label(text: str, width: int, height: int) -> Pixels:
    """Return black text on white, in the middle."""
    # The font of matplotlib has the letters of most languages; Pillow's own has few.
    file = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    font = ImageFont.truetype(str(file), max(round(0.6 * height), 8))
    # A label is one line, whatever breaks a file's name has.
    text = "".join(letter if letter.isprintable() else " " for letter in text)
    while text and font.getlength(text) > width:
        text = text.removesuffix("…")[:-1] + "…" if len(text) > 1 else ""
    canvas = PilImage.new("L", (width, height), 255)
    ImageDraw.Draw(canvas).text((width / 2, height / 2), text, 0, font, anchor="mm")
    light = decode(np.asarray(canvas) / 255)
    return np.repeat(light.astype(np.float32)[:, :, None], 3, axis=2)
