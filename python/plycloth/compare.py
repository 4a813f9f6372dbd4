"""Cloths and pictures of cloth beside each other, the cloths rendered alike."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from plycloth._check import NumberOrNumbers, ParameterError, instance, quoted
from plycloth._json import load_as
from plycloth.beside import checked_height, side_by_side
from plycloth.draft import DEFAULT_THICKNESS_RATIO
from plycloth.fabric import Fabric
from plycloth.image import Image
from plycloth.image_file import READABLE
from plycloth.image_read import read_image
from plycloth.light import Emitter
from plycloth.overview import GROUND, overview
from plycloth.presets import preset, presets
from plycloth.progress import Progress
from plycloth.render import render
from plycloth.scene import Swatch
from plycloth.weave import WeavePattern
from plycloth.wif import read_wif

# Pieces of cloth have at least so many yarns of the coarsest one along each side.
FEWEST_YARNS = 16
HEIGHT = 384
# Pixels that a picture may be wide.
LONGEST_SIDE = 65536

_subject = instance(Fabric, Image)


def subject(name: str, *, strict: bool = False) -> Fabric | Image:
    """Return the cloth or the picture that a name stands for.

    Parameters
    ----------
    name
        A draft (.wif), a fabric that plycloth saved (.json), a picture, or a measured yarn by
        name, of which a plain weave is shown.
    strict
        Whether a draft is read strictly (`read_wif`).

    Raises
    ------
    ParameterError
        If it is none of these.
    ValueError, OSError
        If the file cannot be read.
    """
    if name in presets():
        return _plain_cloth(name)
    match Path(name).suffix.lower():
        case ".wif":
            return Fabric.from_draft(read_wif(name, strict=strict))
        case ".json":
            return load_as(Fabric, name)
        case suffix if suffix in READABLE:
            return read_image(name)
    raise ParameterError(
        f"{name}: must be a draft (.wif), a fabric (.json), a picture ({', '.join(READABLE)}),"
        f" or a measured yarn ({', '.join(presets())})"
    )


def _plain_cloth(name: str) -> Fabric:
    """Return a plain weave of a measured yarn, as dense as a draft is that says nothing of it."""
    yarn = preset(name)
    spacing = yarn.thickness / DEFAULT_THICKNESS_RATIO
    return Fabric(WeavePattern.plain(), yarn, yarn, spacing, spacing).fitted()


def compare(
    subjects: Sequence[tuple[str, Fabric | Image]],
    light: str | Sequence[Emitter] = "day",
    *,
    size_mm: NumberOrNumbers | None = None,
    height: int = HEIGHT,
    ground: NumberOrNumbers | None = GROUND,
    spp: int = 32,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> Image:
    """Return one picture of cloths, rendered alike, and of pictures, side by side.

    Parameters
    ----------
    subjects
        One or more pairs of a label and a fabric, or a picture. A label too long is cut.
    light, ground
        As for `overview`.
    size_mm
        Width and height of each piece of cloth in millimetres, or one number for a square. None: a
        square that holds a repeat of each, and at least 16 yarns of the coarsest.
    height
        Of the pictures in pixels, 8 to 65536, without the labels below.
    spp, seed, threads, progress
        As for `render`.

    Raises
    ------
    ParameterError
        If there is no subject, or a value lies outside its range.
    TypeError
        If a subject is neither a fabric nor a picture, or a value is not of the kind named.
    """
    subjects = [_checked(pair) for pair in subjects]
    fabrics = [cloth for _, cloth in subjects if isinstance(cloth, Fabric)]
    size = _common_size_mm(fabrics) if fabrics and size_mm is None else size_mm

    def picture(cloth: Fabric | Image) -> Image:
        if isinstance(cloth, Image):
            return cloth
        width_mm, height_mm = Swatch(cloth, size).extent_mm
        width = max(1, round(checked_height(height) * width_mm / height_mm))
        if width > LONGEST_SIDE:
            raise ParameterError(
                f"height must be less for cloth of {width_mm:g} x {height_mm:g} mm: {height} rows"
                f" make {width} columns, but {LONGEST_SIDE} are the most"
            )
        scene = overview(cloth, light, size_mm=size, width=width, ground=ground)
        return render(scene, spp=spp, seed=seed, threads=threads, progress=progress)

    return side_by_side([(label, picture(cloth)) for label, cloth in subjects], height)


def _checked(pair: object) -> tuple[str, Fabric | Image]:
    match pair:
        case (str(label), cloth):
            return label, _subject(f"the subject {quoted(label)}", cloth)
    raise TypeError(
        f"subjects must be pairs of a label and a fabric or picture, not {quoted(pair)}"
    )


def _common_size_mm(fabrics: Sequence[Fabric]) -> float:
    repeat = max(max(fabric.repeat_mm) for fabric in fabrics)
    return max(repeat, FEWEST_YARNS * max(fabric.unit_mm for fabric in fabrics))
