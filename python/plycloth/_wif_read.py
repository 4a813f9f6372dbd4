"""Reading weaving drafts from WIF files."""

from __future__ import annotations

import re
import warnings
from os import PathLike, fspath
from pathlib import Path

from plycloth._check import instance
from plycloth._wif_decode import decode
from plycloth._wif_shed import read_shed, treading_section
from plycloth._wif_text import Wif, WifError, WifWarning, parse
from plycloth._wif_yarns import Palette, read_colors, read_lengths
from plycloth.draft import DEFAULT_WARP_COLOR, DEFAULT_WEFT_COLOR, Draft
from plycloth.weave import WeavePattern

# The sections that are read. [WIF] and [CONTENTS] are not: version and contents may lie.
_SECTION = re.compile(
    r"TEXT|NOTES|WEAVING|THREADING|TIEUP|TREADLING|LIFTPLAN|COLOR (PALETTE|TABLE)"
    r"|(WARP|WEFT)( COLORS|( SPACING| THICKNESS)( ZOOM)?)?"
)

# More ends or picks than this are taken for a mistake in the file.
MOST_YARNS = 1_000_000


def read_wif(path: str | PathLike[str], *, trim: bool = True, strict: bool = False) -> Draft:
    """Read a weaving draft from a WIF (Weaving Information File, version 1.1).

    Of what the file says twice, the tie-up and treadling win over the lift plan, the later of
    two equal keys over the earlier, and the sections themselves over [CONTENTS], which is not
    read. Rows that are absent take the default of [WARP] or [WEFT]; of the threading and the
    treadling they are empty. A missing thickness is taken as 0.8 of the spacing, a missing
    spacing as its thickness over 0.8, or as 1 mm if neither is given, missing units as those of the
    other side, or as centimetres. Colours and lengths that cannot be read are taken for missing.

    Parameters
    ----------
    path
        The file, in UTF-8, UTF-16 or else Latin-1.
    trim
        Whether threads at the margins are left out that interlace with nothing (`Draft.trimmed`),
        with a warning: programs pad drafts with them.
    strict
        Whether it is an error, rather than a warning and a guess, where a colour, a length or
        their units cannot be read, where a lift plan disagrees with the tie-up and treadling, where
        rows are counted from 0, and where rows, shafts or treadles are beyond the number that the
        file states.

    Returns
    -------
    Draft
        The first pick and the first end of the file are the first of its pattern, unless they
        were left out.

    Raises
    ------
    WifError
        If the file is no WIF, or lacks what the pattern needs, or has more than a million yarns or
        100 million crossings, or is at fault where it is read strictly; it names the section, key
        and line.
    OSError
        If the file cannot be opened.

    Warns
    -----
    WifWarning
        For each thing that is odd or missing, and what was made of it.
    """
    wif = parse(_text(path), fspath(path), _is_read, strict=instance(bool)("strict", strict))
    draft = _interpret(wif)
    if instance(bool)("trim", trim):
        draft = _trimmed(wif, draft)
    for oddity in wif.oddities:
        warnings.warn(oddity, WifWarning, stacklevel=2)
    return draft


def _text(path: str | PathLike[str]) -> str:
    try:
        return decode(Path(path).read_bytes())
    except UnicodeDecodeError as error:
        problem = f"is no {error.encoding.upper()}: {error.reason}, at byte {error.start}"
        raise WifError(problem, fspath(path)) from None


def _trimmed(wif: Wif, draft: Draft) -> Draft:
    trimmed = draft.trimmed()
    if trimmed is not draft:
        wif.note(
            f"of {draft.pattern.picks} picks x {draft.pattern.ends} ends {trimmed.pattern.picks} x"
            f" {trimmed.pattern.ends} are kept: the others, at the margins, interlace with nothing"
            " (trim=False keeps them)"
        )
    return trimmed


def _is_read(section: str) -> bool:
    return _SECTION.fullmatch(section) is not None


def _interpret(wif: Wif) -> Draft:
    if not any(map(_is_read, wif.sections)):
        raise wif.error("is not a WIF: it has no section such as [WARP] or [THREADING]")
    if not wif.rows_of("THREADING"):
        raise wif.error("has no rows", section="THREADING")
    ends = _count_yarns(wif, "WARP", "THREADING")
    picks = _count_yarns(wif, "WEFT", treading_section(wif))
    shed = read_shed(wif, picks, ends)
    palette = Palette(wif)
    warp_spacing, warp_thickness = read_lengths(wif, "WARP", ends)
    weft_spacing, weft_thickness = read_lengths(wif, "WEFT", picks)
    return Draft(
        WeavePattern(shed.warp_up),
        read_colors(wif, "WARP", palette, shed.is_threaded, DEFAULT_WARP_COLOR),
        read_colors(wif, "WEFT", palette, shed.is_treadled, DEFAULT_WEFT_COLOR),
        warp_spacing,
        weft_spacing,
        warp_thickness,
        weft_thickness,
        _read_title(wif),
        _read_notes(wif),
    )


def _count_yarns(wif: Wif, side: str, section: str) -> int:
    """Return the number of yarns that a side declares, or else that a section has rows for."""
    if entry := wif.entry(side, "threads"):
        count = wif.count(entry)
        if not 1 <= count <= MOST_YARNS:
            raise wif.error(f"must be from 1 to {MOST_YARNS:,}, not {count}", entry)
        return count
    rows = wif.numbered(section, MOST_YARNS, first=0)
    if not rows:
        raise wif.error(f"has no Threads, and [{section}] has no numbered row", section=side)
    count = max(rows) + wif.counts_from_zero(section, max(rows) + 1)
    wif.note(f"no Threads: {count} are taken, the last row of [{section}]", section=side)
    return count


def _read_title(wif: Wif) -> str:
    entry = wif.rows_of("TEXT").get("title")
    return entry.value if entry else ""


def _read_notes(wif: Wif) -> str:
    return "\n".join(entry.value for entry in wif.numbered("NOTES").values())
