"""Writing weaving drafts to WIF files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from decimal import Decimal
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from plycloth._plycloth import __version__
from plycloth._wif_yarns import EXACT_COLORS
from plycloth.draft import Draft

# A draft with more different picks than a loom has treadles is written as a lift plan.
MOST_TREADLES = 32

# The whole numbers up to this stand for a colour's values from 0 to 1.
_HIGHEST = 255

# What the format demands of its version 1.1.
_VERSION = {"Version": "1.1", "Date": "April 20, 1997", "Developers": "wif@mhsoft.com"}

Sections = dict[str, dict[str, str]]


def write_wif(draft: Draft, path: str | PathLike[str]) -> None:
    """Write a draft to a WIF (version 1.1), from which `read_wif` reads an equal draft.

    Ends that weave alike share a shaft, and picks that weave alike a treadle. With more than 32
    treadles a lift plan takes the place of tie-up and treadling, and there are no treadles. Lengths
    are in centimetres. Colours are whole numbers from 0 to 255, as all readers expect; those that
    this rounds are in a private section as well, from which `read_wif` has them back. Where yarns
    of a side differ, each of them gets a row: other readers stumble over missing ones.

    Parameters
    ----------
    draft
        What to write.
    path
        The file, written in UTF-8; one that exists is replaced.

    Raises
    ------
    TypeError
        If `draft` is no `Draft`.
    OSError
        If the file cannot be written.
    """
    if not isinstance(draft, Draft):
        raise TypeError(f"draft must be a Draft, not a {type(draft).__name__}")
    sections = {**_texts(draft), **_weave(draft.pattern.warp_up), **_yarns(draft)}
    source = {"Source Program": "plycloth", "Source Version": __version__}
    header = {"WIF": {**_VERSION, **source}}
    contents = {"CONTENTS": dict.fromkeys(sections, "true")}
    text = "\n".join(_layout(*section) for section in {**header, **contents, **sections}.items())
    Path(path).write_bytes(text.encode("utf-8"))


def _layout(name: str, rows: dict[str, str]) -> str:
    return "".join((f"[{name}]\n", *(f"{key}={value}\n" for key, value in rows.items())))


def _numbered(values: Iterable[str]) -> dict[str, str]:
    return {str(number): value for number, value in enumerate(values, start=1)}


def _texts(draft: Draft) -> Sections:
    sections = {}
    if draft.title:
        sections["TEXT"] = {"Title": draft.title}
    if draft.notes:
        sections["NOTES"] = _numbered(draft.notes.split("\n"))
    return sections


def _weave(warp_up: NDArray[np.bool_]) -> Sections:
    shaft_of_end, first_ends = _alike(warp_up.T)
    treadle_of_pick, first_picks = _alike(warp_up)
    lifted = warp_up[:, first_ends]
    sections = {
        "WEAVING": {"Rising Shed": "true", "Shafts": str(len(first_ends))},
        "THREADING": _numbered(map(str, shaft_of_end)),
    }
    if len(first_picks) > MOST_TREADLES:
        # The key is required, and readers refuse a lift plan beside treadles.
        sections["WEAVING"]["Treadles"] = "0"
        sections["LIFTPLAN"] = _numbered(_shaft_lists(lifted))
    else:
        sections["WEAVING"]["Treadles"] = str(len(first_picks))
        ties = _numbered(_shaft_lists(lifted[first_picks]))
        # A treadle without a row lifts nothing; some readers take the 0 for a shaft.
        sections["TIEUP"] = {key: tie for key, tie in ties.items() if tie != "0"} or ties
        sections["TREADLING"] = _numbered(map(str, treadle_of_pick))
    return sections


def _alike(rows: NDArray[np.bool_]) -> tuple[list[int], list[int]]:
    """Return a number for each row, from 1, equal for equal rows; and where each first stands."""
    numbers: dict[bytes, int] = {}
    number_of_row: list[int] = []
    firsts: list[int] = []
    for index, row in enumerate(np.packbits(rows, axis=1)):
        number = numbers.setdefault(row.tobytes(), len(numbers) + 1)
        number_of_row.append(number)
        if number > len(firsts):
            firsts.append(index)
    return number_of_row, firsts


def _shaft_lists(lifted: NDArray[np.bool_]) -> Iterable[str]:
    return (",".join(map(str, np.flatnonzero(row) + 1)) or "0" for row in lifted)


def _yarns(draft: Draft) -> Sections:
    palette = np.unique(np.concatenate((draft.warp_colors, draft.weft_colors)), axis=0)
    numbers = {tuple(color): str(i) for i, color in enumerate(palette.tolist(), start=1)}
    sections = {
        "COLOR PALETTE": {"Range": f"0,{_HIGHEST}", "Entries": str(len(palette))},
        **_tables(palette),
    }
    for side, colors, spacing, thickness in (
        ("WARP", draft.warp_colors, draft.warp_spacing, draft.warp_thickness),
        ("WEFT", draft.weft_colors, draft.weft_spacing, draft.weft_thickness),
    ):
        columns = {
            "Color": ("COLORS", [numbers[tuple(color)] for color in colors.tolist()]),
            "Spacing": ("SPACING", list(map(_centimeters, spacing))),
            "Thickness": ("THICKNESS", list(map(_centimeters, thickness))),
        }
        sections[side] = {"Threads": str(len(colors)), "Units": "Centimeters"}
        for key, (section, values) in columns.items():
            sections[side][key] = Counter(values).most_common(1)[0][0]
            if len(set(values)) > 1:
                sections[f"{side} {section}"] = _numbered(values)
    return sections


def _tables(palette: NDArray[np.float64]) -> Sections:
    """Return the table of colours, and one of those that it rounds."""
    whole = np.rint(palette * _HIGHEST)
    rows = _numbered(",".join(map(str, row)) for row in whole.astype(int).tolist())
    rounded = np.flatnonzero((whole / _HIGHEST != palette).any(axis=1)).tolist()
    exact = {str(i + 1): ",".join(map(_plain, palette[i].tolist())) for i in rounded}
    return {"COLOR TABLE": rows} | ({EXACT_COLORS: exact} if exact else {})


def _centimeters(millimetres: float) -> str:
    """Shift the decimal point, which unlike a division loses nothing."""
    return f"{Decimal(repr(float(millimetres))).scaleb(-1).normalize():f}"


def _plain(value: float) -> str:
    return f"{Decimal(repr(value)).normalize():f}"
