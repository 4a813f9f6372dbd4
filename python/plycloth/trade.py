"""Counts of the trade: threads per inch or centimetre, and sizes of yarns by weight.

A yarn's size says what a length of it weighs (ISO 1144): tex is grams per kilometre, denier grams
per 9 km; or what length a weight has: Nm is kilometres per kilogram, Ne hanks of 840 yards per
pound. How thick that makes it follows from the density of its material and from how much of the
yarn is fiber (Peirce 1937, "The Geometry of Cloth Structure").

All conversions take numbers or arrays of any shape, and return what they were given.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from plycloth._check import (
    ParameterError,
    Range,
    arrays,
    choice,
    known_name,
    number,
    quoted,
)

_MM_PER = {"inch": 25.4, "cm": 10.0}

# Grams per kilometre of a yarn of size 1, where sizes are weights per length.
_TEX_PER = {"tex": 1.0, "dtex": 0.1, "denier": 1.0 / 9.0}
# The same, where sizes are lengths per weight: a kilometre per kilogram, 840 yards per pound.
_TEX_TIMES = {"Nm": 1000.0, "Ne": 453.59237 / (840 * 0.9144) * 1000.0}

UNITS = (*_TEX_PER, *_TEX_TIMES)
"""Units of yarn sizes."""

DENSITIES = {
    "cotton": 1.52,
    "wool": 1.31,
    "silk": 1.34,
    "linen": 1.53,
    "viscose": 1.49,
    "acetate": 1.32,
    "polyester": 1.39,
    "nylon": 1.14,
    "acrylic": 1.19,
    "polypropylene": 0.91,
}
"""Densities of fibers in g/cm3, at 65% relative humidity.

From Morton and Hearle 2008, "Physical Properties of Textile Fibres", table 5.1; that of linen
(flax) from Bunsell 2018, "Handbook of Properties of Textile and Technical Fibres", table 1.1.
"""

PACKING = 0.6
"""Part of a yarn's volume that is fiber: of Peirce's cotton, 1.1 cm3/g under moderate pressure."""

_SPELLINGS = {unit.lower(): unit for unit in UNITS} | {"den": "denier", "d": "denier"}

_TOKEN = re.compile(r"\s*(\d+(?:\.\d+)?|[a-z]+|/)")
_EXAMPLES = "'20 tex', '20 tex x 2', '150 denier', '30/2 Ne' or '2/28 Nm'"

_per = choice(*_MM_PER)
_unit = choice(*UNITS)
# Of sizes, counts and lengths: any that thread can have, and such that no result overflows.
_positive = arrays((), Range(1e-12, 1e12))
checked_packing = number(Range(0.01, 1.0))
_density = number(Range(0.01, 100.0))


@dataclass(frozen=True)
class YarnSize:
    """What a yarn weighs.

    Attributes
    ----------
    single_tex : float
        Size of each of its singles in tex.
    plies : int
        How many of them are folded.
    """

    single_tex: float
    plies: int = 1

    @property
    def tex(self) -> float:
        """Size of the yarn in tex, but for what twist shortens it."""
        return self.plies * self.single_tex

    @classmethod
    def parse(cls, text: str) -> YarnSize:
        """Read a size as it is written in the trade.

        A number and a unit in either order, which may be tex, dtex, denier (den, d), Nm or Ne. Of
        a folded yarn the size is that of its singles: "20 tex x 2" is two of 20 tex, as are
        "30/2 Ne" and "2/28 Nm" two singles. Of the two numbers beside a stroke the smaller one is
        that of the plies, since some trades write it first and some last.

        Raises
        ------
        ParameterError
            If it is no such text, or its unit is unknown. A stroke is no fold in tex or denier
            ("150/48 den" has 48 filaments, "20/22 den" is raw silk from 20 to 22) and is refused.
        TypeError
            If it is no text.
        """
        if not isinstance(text, str):
            raise TypeError(f"a yarn size must be a text such as {_EXAMPLES}, not {quoted(text)}")
        tokens = _tokens(text)
        numbers = [float(token) for token in tokens if token[0].isdecimal()]
        words = [token for token in tokens if token.isalpha() and token != "x"]
        if len(words) != 1 or not numbers:
            raise _not_a_size(text)
        unit = _unit_of(words[0])
        # Such as "n/nu" for 30/2 Ne: n for numbers, u for the unit.
        form = "".join(_form_of(token) for token in tokens)
        if form in ("un", "nu"):
            return cls(_single_tex(text, numbers[0], unit))
        if form in ("nuxn", "unxn"):
            return cls(_single_tex(text, numbers[0], unit), _plies(text, numbers[1]))
        if form == "nxnu":
            return cls(_single_tex(text, numbers[1], unit), _plies(text, numbers[0]))
        if form not in ("un/n", "n/nu", "nu/n"):
            raise _not_a_size(text)
        if unit in _TEX_PER:
            raise ParameterError(
                f"a yarn size in {unit} must not have a stroke, as {quoted(text)}: leave out the"
                f" number of filaments, and write folded yarns as '20 {unit} x 2'"
            )
        plies, count = sorted(numbers)
        return cls(_single_tex(text, count, unit), _plies(text, plies))


def spacing_mm(threads: ArrayLike, per: str) -> Any:
    """Return the distance between threads in millimetres.

    Parameters
    ----------
    threads : float or array_like
        How many there are, greater than 0.
    per
        In which length: "inch" or "cm".
    """
    return _MM_PER[_per("per", per)] / _positive("threads", threads)[()]


def threads_per(spacing_mm: ArrayLike, per: str) -> Any:
    """Return how many threads there are per "inch" or "cm", of their distance in millimetres."""
    return _MM_PER[_per("per", per)] / _positive("spacing_mm", spacing_mm)[()]


def to_tex(size: ArrayLike, unit: str) -> Any:
    """Return the size in tex of a yarn of a size, greater than 0, in one of `UNITS`."""
    checked = _positive("size", size)[()]
    unit = _unit("unit", unit)
    return checked * _TEX_PER[unit] if unit in _TEX_PER else _TEX_TIMES[unit] / checked


def from_tex(tex: ArrayLike, unit: str) -> Any:
    """Return the size in one of `UNITS` of a yarn of a size, greater than 0, in tex."""
    checked = _positive("tex", tex)[()]
    unit = _unit("unit", unit)
    return checked / _TEX_PER[unit] if unit in _TEX_PER else _TEX_TIMES[unit] / checked


def diameter_mm(tex: ArrayLike, material: str | float, packing: float = PACKING) -> Any:
    """Return the diameter in millimetres of a single yarn of round cross section.

    Parameters
    ----------
    tex : float or array_like
        Size in tex, greater than 0.
    material
        One of `DENSITIES`, or a density in g/cm3.
    packing
        Part of its volume that is fiber, in [0.01, 1]: about 0.6 for spun yarns.

    Raises
    ------
    ParameterError
        If a value lies outside its range, or there is no such material.
    TypeError
        If a value is not of the kind named.
    """
    return np.sqrt(4.0 / math.pi * area_mm2(tex, material, packing))


def area_mm2(tex: ArrayLike, material: str | float, packing: float = PACKING) -> Any:
    """Return the cross section in square millimetres; the parameters are `diameter_mm`'s."""
    # 1 tex is 1e-3 g/m, and 1 g/m of 1 g/cm3 fills 1 mm2.
    fiber = 1e-3 * _positive("tex", tex)[()] / density(material)
    return fiber / checked_packing("packing", packing)


def tex_of_diameter(diameter_mm: ArrayLike, material: str | float, packing: float = PACKING) -> Any:
    """Return the size in tex of a yarn of a diameter: the opposite of `diameter_mm`."""
    area = math.pi / 4.0 * _positive("diameter_mm", diameter_mm)[()] ** 2
    return 1e3 * area * density(material) * checked_packing("packing", packing)


def density(material: str | float) -> float:
    """Return the density of a material in g/cm3: one of `DENSITIES`, or the number given."""
    if isinstance(material, str):
        return DENSITIES[known_name("material", material, DENSITIES)]
    if not isinstance(material, Real) or isinstance(material, bool):
        raise TypeError(
            f"material must be a name ({', '.join(DENSITIES)}) or a density in g/cm3,"
            f" not {quoted(material)}"
        )
    checked: float = _density("material", material)
    return checked


def _tokens(text: str) -> list[str]:
    """Part a size into numbers, words, strokes and crosses."""
    plain = text.lower().replace("\u00d7", "x")
    tokens: list[str] = _TOKEN.findall(plain)
    if "".join(tokens) != "".join(plain.split()):
        raise _not_a_size(text)
    return tokens


def _form_of(token: str) -> str:
    if token in ("x", "/"):
        return token
    return "n" if token[0].isdecimal() else "u"


def _unit_of(word: str) -> str:
    if word not in _SPELLINGS:
        raise ParameterError(
            f"the unit of a yarn size must be one of {', '.join(UNITS)}, not {quoted(word)}"
        )
    return _SPELLINGS[word]


def _single_tex(text: str, size: float, unit: str) -> float:
    try:
        return float(to_tex(size, unit))
    except ParameterError as error:
        raise ParameterError(f"a yarn {error}, as in {quoted(text)}") from None


def _plies(text: str, plies: float) -> int:
    if plies < 1 or plies != int(plies):
        raise ParameterError(f"the plies of a yarn must be a whole number, not {quoted(text)}")
    return int(plies)


def _not_a_size(text: str) -> ParameterError:
    return ParameterError(f"a yarn size must be such as {_EXAMPLES}, not {quoted(text)}")
