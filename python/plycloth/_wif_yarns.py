"""Colour, spacing and thickness of each yarn of a WIF.

Each has a default in [WARP] or [WEFT] and a section with rows for the yarns that differ.
"""

from decimal import Decimal

import numpy as np
from numpy.typing import NDArray

from plycloth._check import quoted
from plycloth._wif_text import Entry, Wif, WifError
from plycloth.draft import DEFAULT_SPACING, DEFAULT_THICKNESS_RATIO

FloatArray = NDArray[np.float64]

_MM_PER_INCH = Decimal("25.4")
_MM_PER_UNIT = {
    "decipoints": _MM_PER_INCH / 720,
    "inches": _MM_PER_INCH,
    "centimeters": Decimal(10),
}
_OTHER_SPELLINGS = {
    "decipoint": "decipoints",
    "inch": "inches",
    "in": "inches",
    "centimeter": "centimeters",
    "centimetre": "centimeters",
    "centimetres": "centimeters",
    "cm": "centimeters",
}

_DEFAULT_RANGE = Decimal(0), Decimal(255)

# A table whose brightest value lies below this part of its range is odd.
DARKEST_TABLE = 0.01

# A section of plycloth's own, with the values from 0 to 1 of colours that the table rounds.
EXACT_COLORS = "PRIVATE PLYCLOTH COLORS"


class Palette:
    """The colours of [COLOR TABLE], scaled by the Range of [COLOR PALETTE] to [0, 1]."""

    def __init__(self, wif: Wif) -> None:
        self._wif = wif
        self._low, self._high = self._read_range()
        self._clipped: list[Entry] = []
        self._colors = wif.read_rows(
            wif.numbered("COLOR TABLE", first=0), self._table_color, "there is no such colour"
        )
        self._note_clipped()
        self._note_dark()
        if 0 in self._colors:
            wif.note("rows are counted from 0: colour 0 is that of row 0", section="COLOR TABLE")
        self._colors |= self._read_exact()

    def __bool__(self) -> bool:
        return bool(self._colors)

    def color(self, entry: Entry) -> tuple[float, ...]:
        """Return the colour that an entry names: `index` or `index,R,G,B`."""
        numbers = self._wif.decimals(entry)
        if len(numbers) == 4:
            color = self._scale(entry, numbers[1:])
            self._note_clipped()
            return color
        if len(numbers) != 1:
            raise self._wif.error(f"must be index or index,R,G,B, not {quoted(entry.bare)}", entry)
        if not self._colors:
            raise self._wif.error("there is no [COLOR TABLE] to look it up in", entry)
        if numbers[0] not in self._colors:
            raise self._wif.error(
                f"there is no colour {numbers[0]:.12g} in [COLOR TABLE], which has rows from"
                f" {min(self._colors)} to {max(self._colors)}",
                entry,
            )
        return self._colors[int(numbers[0])]

    def _read_exact(self) -> dict[int, tuple[float, ...]]:
        """Return the colours that the table has rounded; what no longer agrees with it is stale."""
        step = 1 / float(self._high - self._low)
        exact = self._wif.read_rows(
            self._wif.numbered(EXACT_COLORS, first=0),
            lambda entry: tuple(map(float, self._triple(entry))),
            "[COLOR TABLE] has the colour",
        )
        return {
            number: color
            for number, color in exact.items()
            if (rounded := self._colors.get(number))
            and np.allclose(color, rounded, rtol=0, atol=0.5001 * step)
        }

    def _read_range(self) -> tuple[Decimal, Decimal]:
        entry = self._wif.entry("COLOR PALETTE", "range")
        if entry is None:
            return _DEFAULT_RANGE
        try:
            return self._two_ends(entry)
        except WifError as error:
            self._wif.take("{},{} is taken".format(*_DEFAULT_RANGE), error)
            return _DEFAULT_RANGE

    def _two_ends(self, entry: Entry) -> tuple[Decimal, Decimal]:
        numbers = self._wif.decimals(entry)
        if len(numbers) != 2 or numbers[0] >= numbers[1]:
            raise self._wif.error(f"must be lowest,highest, not {quoted(entry.bare)}", entry)
        return numbers[0], numbers[1]

    def _table_color(self, entry: Entry) -> tuple[float, ...]:
        return self._scale(entry, self._triple(entry))

    def _triple(self, entry: Entry) -> list[Decimal]:
        numbers = self._wif.decimals(entry)
        if len(numbers) != 3:
            raise self._wif.error(f"must be R,G,B, not {quoted(entry.bare)}", entry)
        return numbers

    def _scale(self, entry: Entry, numbers: list[Decimal]) -> tuple[float, ...]:
        scaled = [float((n - self._low) / (self._high - self._low)) for n in numbers]
        if min(scaled) < 0 or max(scaled) > 1:
            self._clipped.append(entry)
        return tuple(min(max(value, 0.0), 1.0) for value in scaled)

    def _note_dark(self) -> None:
        """Say so where no colour uses more than a hundredth of the range, which may be a slip."""
        brightest = max((max(color) for color in self._colors.values()), default=0.0)
        if 0.0 < brightest < DARKEST_TABLE:
            self._wif.note(
                f"every colour is below {DARKEST_TABLE:.0%} of the range"
                f" {self._low:g},{self._high:g}, and so all but black",
                section="COLOR TABLE",
            )

    def _note_clipped(self) -> None:
        self._wif.note_all(self._clipped, f"is clipped to the range {self._low},{self._high}")
        self._clipped = []


def read_colors(
    wif: Wif,
    side: str,
    palette: Palette,
    is_woven: NDArray[np.bool_],
    fallback: tuple[float, ...],
) -> FloatArray:
    """Return the colour of each yarn of a side, WARP or WEFT.

    A default that is no valid colour is an error if a yarn that is woven needs it and the reading
    is strict, else odd.
    """
    colors = np.full((is_woven.size, 3), np.nan)
    rows = wif.numbered(f"{side} COLORS", is_woven.size)
    for number, color in wif.read_rows(rows, palette.color, "the default is taken").items():
        colors[number - 1] = color
    needs_default = np.isnan(colors[:, 0])
    is_woven_by_default = bool((needs_default & is_woven).any())
    default = _default_color(wif, side, palette, is_woven_by_default)
    if needs_default.any() and default is None:
        wif.note(f"no colour for {needs_default.sum()} yarns: {fallback} is taken", section=side)
    colors[needs_default] = default or fallback
    return colors


def _default_color(
    wif: Wif, side: str, palette: Palette, is_needed: bool
) -> tuple[float, ...] | None:
    entry = wif.entry(side, "color")
    if entry is None:
        return None
    try:
        return palette.color(entry)
    except WifError as error:
        if is_needed and wif.strict:
            raise
        wif.note(error.problem, entry)
        return None


def read_lengths(wif: Wif, side: str, count: int) -> tuple[FloatArray, FloatArray]:
    """Return spacing and thickness in millimetres of each of `count` yarns of a side.

    A missing thickness is a fixed part of the spacing, a missing spacing the same of the
    thickness, and where both are missing, yarns are 1 mm apart.
    """
    unit = _mm_per_unit(wif, side)
    spacing = _read_length(wif, side, "spacing", count, unit)
    thickness = _read_length(wif, side, "thickness", count, unit)
    no_spacing, no_thickness = np.isnan(spacing), np.isnan(thickness)
    spacing[no_spacing] = thickness[no_spacing] / DEFAULT_THICKNESS_RATIO
    no_length = no_spacing & no_thickness
    spacing[no_length] = DEFAULT_SPACING
    thickness[no_thickness] = spacing[no_thickness] * DEFAULT_THICKNESS_RATIO
    if no_length.any():
        wif.note(f"no spacing: {DEFAULT_SPACING:g} mm is taken", section=side)
    elif no_spacing.any():
        wif.note(f"no spacing: thickness / {DEFAULT_THICKNESS_RATIO} is taken", section=side)
    if no_thickness.any():
        wif.note(f"no thickness: {DEFAULT_THICKNESS_RATIO} of the spacing is taken", section=side)
    if (is_thick := thickness > spacing).any():
        first = int(np.flatnonzero(is_thick)[0])
        wif.note(
            f"yarns thicker than their spacing: {is_thick.sum()}, the first {first + 1}:"
            f" {thickness[first]:g} mm against {spacing[first]:g} mm",
            section=side,
        )
    return spacing, thickness


def _read_length(wif: Wif, side: str, what: str, count: int, unit: Decimal | None) -> FloatArray:
    """Read the lengths of all yarns, NaN where the file has none that can be read."""
    lengths = np.full(count, np.nan)
    _note_zoom(wif, side, what)
    if unit is None:
        return lengths

    def read(entry: Entry) -> float:
        return _in_mm(wif, entry, unit)

    # A number that no row has: the side's default, if it can be read.
    default = {0: entry} if (entry := wif.entry(side, what)) else {}
    for value in wif.read_rows(default, read, "it is taken for not given").values():
        lengths[:] = value
    rows = wif.numbered(f"{side} {what.upper()}", count)
    for number, value in wif.read_rows(rows, read, "the default is taken").items():
        lengths[number - 1] = value
    return lengths


def _note_zoom(wif: Wif, side: str, what: str) -> None:
    """Say that zooms, which magnify lengths on a screen, are left alone."""
    oddity = f"zooms are not applied: the {what} is taken as it is"
    if entry := wif.entry(side, f"{what} zoom"):
        wif.note(oddity, entry)
    wif.note_all(list(wif.rows_of(f"{side} {what.upper()} ZOOM").values()), oddity)


def _in_mm(wif: Wif, entry: Entry, unit: Decimal) -> float:
    numbers = wif.decimals(entry)
    if len(numbers) != 1 or numbers[0] < 0:
        raise wif.error(f"must be one number of at least 0, not {quoted(entry.bare)}", entry)
    # In decimal arithmetic, for a binary factor would move the last digit of what was written.
    length = float(numbers[0] * unit)
    if not np.isfinite(length):
        raise wif.error(f"is too large: {quoted(entry.bare)}", entry)
    if length == 0:
        raise wif.error("is 0", entry)
    return length


def _mm_per_unit(wif: Wif, side: str) -> Decimal | None:
    """Return the length of a side's unit, None if it is one that the format does not know."""
    entry = wif.entry(side, "units")
    if entry is None:
        other = wif.entry("WEFT" if side == "WARP" else "WARP", "units")
        taken = f"those of [{other.section}] are" if other else "centimeters are"
        if _has_lengths(wif, side):
            wif.note(f"no units: {taken} taken", section=side)
        if other is None:
            return _MM_PER_UNIT["centimeters"]
        entry = other
    name = entry.bare.lower()
    unit = _MM_PER_UNIT.get(_OTHER_SPELLINGS.get(name, name))
    if unit is None:
        problem = f"must be Decipoints, Inches or Centimeters, not {quoted(entry.bare)}"
        wif.take("no spacing or thickness is read", wif.error(problem, entry))
    return unit


def _has_lengths(wif: Wif, side: str) -> bool:
    return any(
        wif.entry(side, what) or wif.rows_of(f"{side} {what.upper()}")
        for what in ("spacing", "thickness")
    )
