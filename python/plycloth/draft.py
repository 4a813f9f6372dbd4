"""Weaving drafts: a pattern and the colour, spacing and thickness of each yarn."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth._check import POSITIVE, ParameterError, integer, number, quoted
from plycloth.drawdown import drawdown_png
from plycloth.trade import spacing_mm
from plycloth.weave import WeavePattern

FloatArray = NDArray[np.float64]

# What a draft gets that says nothing: dark ends and light picks, so that the drawdown reads as
# usual, yarns 1 mm apart and four fifths as thick as they are apart.
DEFAULT_WARP_COLOR = (0.2, 0.2, 0.2)
DEFAULT_WEFT_COLOR = (0.9, 0.9, 0.9)
DEFAULT_SPACING = 1.0
DEFAULT_THICKNESS_RATIO = 0.8

_number = integer(-(10**9), 10**9)

# Characters of a list of colours in a message.
LONGEST_LIST = 200


@dataclass(frozen=True, eq=False, repr=False)
class Draft:
    """A weaving draft: what to weave, with which colours, how dense and how thick.

    A draft is a value: frozen, its arrays read-only, compared and hashed by content, picklable.
    In a notebook it shows itself as a drawdown in the yarns' colours. `from_pattern` has defaults
    for everything but the pattern; `trimmed` leaves out threads that hold nothing.

    Parameters
    ----------
    pattern
        Which yarn is on the face at each crossing.
    warp_colors
        RGB of each end, ends x 3, in [0, 1], display-encoded (as a file or a screen has it, not
        linear light); one colour of 3 stands for all.
    weft_colors
        The same for each pick, picks x 3.
    warp_spacing
        Width in millimetres that each end takes up, (ends,), above 0; one number stands for all.
    weft_spacing
        The same for each pick, (picks,).
    warp_thickness
        Diameter of each end in millimetres, (ends,), above 0; it may exceed the spacing.
    weft_thickness
        The same for each pick, (picks,).
    title
        One line; white space at its ends is dropped.
    notes
        Any number of lines; white space at their ends and blank lines at the ends are dropped.

    Raises
    ------
    ValueError
        If a shape does not fit the pattern or a value is out of range; the message names it.
    TypeError
        If the pattern is no `WeavePattern`, or the title or the notes are no text.
    """

    pattern: WeavePattern
    warp_colors: FloatArray
    weft_colors: FloatArray
    warp_spacing: FloatArray
    weft_spacing: FloatArray
    warp_thickness: FloatArray
    weft_thickness: FloatArray
    title: str = ""
    notes: str = ""

    if TYPE_CHECKING:

        def __init__(
            self,
            pattern: WeavePattern,
            warp_colors: ArrayLike,
            weft_colors: ArrayLike,
            warp_spacing: ArrayLike,
            weft_spacing: ArrayLike,
            warp_thickness: ArrayLike,
            weft_thickness: ArrayLike,
            title: str = ...,
            notes: str = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        if not isinstance(self.pattern, WeavePattern):
            raise TypeError(f"pattern must be a WeavePattern, not a {type(self.pattern).__name__}")
        for yarns, count in (("warp", self.pattern.ends), ("weft", self.pattern.picks)):
            self._store(f"{yarns}_colors", _colors, count)
            self._store(f"{yarns}_spacing", _lengths, count)
            self._store(f"{yarns}_thickness", _lengths, count)
        object.__setattr__(self, "title", _title(self.title))
        object.__setattr__(self, "notes", _notes(self.notes))

    @classmethod
    def from_pattern(
        cls,
        pattern: WeavePattern,
        *,
        warp_colors: ArrayLike = DEFAULT_WARP_COLOR,
        weft_colors: ArrayLike = DEFAULT_WEFT_COLOR,
        warp_spacing: ArrayLike = DEFAULT_SPACING,
        weft_spacing: ArrayLike = DEFAULT_SPACING,
        warp_thickness: ArrayLike | None = None,
        weft_thickness: ArrayLike | None = None,
        title: str = "",
        notes: str = "",
    ) -> Draft:
        """Make a draft of a pattern, by default dark ends and light picks, 1 mm apart.

        The parameters are those of the class, one value standing for all yarns where that is
        enough. A thickness of None is 0.8 of each yarn's spacing.
        """
        if warp_thickness is None:
            warp_thickness = DEFAULT_THICKNESS_RATIO * np.asarray(warp_spacing)
        if weft_thickness is None:
            weft_thickness = DEFAULT_THICKNESS_RATIO * np.asarray(weft_spacing)
        return cls(
            pattern,
            np.asarray(warp_colors),
            np.asarray(weft_colors),
            np.asarray(warp_spacing),
            np.asarray(weft_spacing),
            np.asarray(warp_thickness),
            np.asarray(weft_thickness),
            title,
            notes,
        )

    def trimmed(self) -> Draft:
        """Leave out the threads at the margins that interlace with nothing.

        An end interlaces with nothing if it is up, or down, at all picks that are left, and a pick
        likewise. Weaving programs pad drafts with such threads; no force holds them in the cloth.
        Those between others stay. A draft of which nothing would be left comes back whole.

        Returns
        -------
        Draft
            It, or one of fewer threads.
        """
        picks, ends = _interlacing(self.pattern.warp_up)
        if (picks, ends) == (slice(0, self.pattern.picks), slice(0, self.pattern.ends)):
            return self
        return Draft(
            WeavePattern(self.pattern.warp_up[picks, ends]),
            self.warp_colors[ends],
            self.weft_colors[picks],
            self.warp_spacing[ends],
            self.weft_spacing[picks],
            self.warp_thickness[ends],
            self.weft_thickness[picks],
            self.title,
            self.notes,
        )

    def mirrored(self) -> Draft:
        """Return the draft with its ends in the opposite order: end 1 at the right.

        Much weaving software draws end 1 at the right. As pictures the two are mirror images: a
        twill to the right becomes one to the left.
        """
        return replace(
            self,
            pattern=WeavePattern(self.pattern.warp_up[:, ::-1]),
            warp_colors=self.warp_colors[::-1],
            warp_spacing=self.warp_spacing[::-1],
            warp_thickness=self.warp_thickness[::-1],
        )

    def with_sett(
        self, *, ends: float | None = None, picks: float | None = None, per: str = "inch"
    ) -> Draft:
        """Return the draft with as many ends and picks per inch or centimetre.

        Spacings and thicknesses of a side are scaled by one factor, so that uneven ones stay so.

        Parameters
        ----------
        ends, picks
            How many there are on average, greater than 0. None: as many as there were.
        per
            "inch" or "cm".

        Raises
        ------
        ParameterError
            If a value lies outside its range.
        TypeError
            If a value is not of the kind named.
        """
        wanted = {
            side: float(number(POSITIVE)(name, count))
            for side, name, count in (("warp", "ends", ends), ("weft", "picks", picks))
            if count is not None
        }
        changed = {}
        for side, count in wanted.items():
            spacing = getattr(self, f"{side}_spacing")
            factor = spacing_mm(count, per) / spacing.mean()
            changed[f"{side}_spacing"] = factor * spacing
            changed[f"{side}_thickness"] = factor * getattr(self, f"{side}_thickness")
        return replace(self, **changed)

    @property
    def colors(self) -> FloatArray:
        """The different colours of ends and picks, n x 3, in the order of their first threads."""
        every = np.concatenate((self.warp_colors, self.weft_colors))
        _, firsts = np.unique(every, axis=0, return_index=True)
        return every[np.sort(firsts)]

    def recolored(self, changes: Mapping[int, ArrayLike | str]) -> Draft:
        """Return the draft with other colours in place of some of its own.

        Parameters
        ----------
        changes
            By the number of a colour, counted from 1 in the order of `colors`, what takes its
            place: RGB in [0, 1], display-encoded, or its code, such as "#aa3322".

        Raises
        ------
        ParameterError
            If the draft has no colour of that number, or a code is no colour.
        ValueError
            If a colour lies outside [0, 1].
        TypeError
            If `changes` is no mapping.
        """
        if not isinstance(changes, Mapping):
            raise TypeError(
                "changes must be a mapping of numbers to colours, such as {3: '#aa3322'}, not"
                f" {quoted(changes)}"
            )
        old = self.colors
        warp, weft = self.warp_colors.copy(), self.weft_colors.copy()
        for chosen, color in changes.items():
            if not 1 <= _number("the number of a colour", chosen) <= len(old):
                listed = ", ".join(f"{i} {_code(c)}" for i, c in enumerate(old, start=1))
                raise ParameterError(
                    f"the draft has no colour {chosen}: it has {_cut(listed, LONGEST_LIST)}"
                )
            new = _parsed(color) if isinstance(color, str) else color
            for colors, given in ((warp, self.warp_colors), (weft, self.weft_colors)):
                colors[(given == old[chosen - 1]).all(axis=1)] = _colors("a colour", new, 1)[0]
        return replace(self, warp_colors=warp, weft_colors=weft)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Draft):
            return NotImplemented
        return self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def __reduce__(self) -> tuple[Any, ...]:
        # Made anew, a copy's arrays are read-only again.
        return Draft, self._values()

    def __repr__(self) -> str:
        title = f"{quoted(self.title)}, " if self.title else ""
        return f"Draft({title}{self.pattern.picks} picks x {self.pattern.ends} ends)"

    def _repr_png_(self) -> bytes:
        return drawdown_png(self.pattern.warp_up, self.warp_colors, self.weft_colors)

    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, each.name) for each in fields(self))

    def _content(self) -> tuple[Any, ...]:
        return tuple(v.tobytes() if isinstance(v, np.ndarray) else v for v in self._values())

    def _store(self, name: str, check: Any, count: int) -> None:
        object.__setattr__(self, name, check(name, getattr(self, name), count))


def _interlacing(warp_up: NDArray[np.bool_]) -> tuple[slice, slice]:
    """Return the picks and the ends from the first to the last that interlace with any of these."""
    whole = slice(0, warp_up.shape[0]), slice(0, warp_up.shape[1])
    picks, ends = whole
    while True:
        part = warp_up[picks, ends]
        kept_picks = _within(picks, np.asarray(part.any(axis=1) & ~part.all(axis=1)))
        kept_ends = _within(ends, np.asarray(part.any(axis=0) & ~part.all(axis=0)))
        if kept_picks is None or kept_ends is None:
            return whole
        if (kept_picks, kept_ends) == (picks, ends):
            return picks, ends
        picks, ends = kept_picks, kept_ends


def _within(yarns: slice, interlaces: NDArray[np.bool_]) -> slice | None:
    found = np.flatnonzero(interlaces)
    if not found.size:
        return None
    return slice(yarns.start + int(found[0]), yarns.start + int(found[-1]) + 1)


def _code(color: FloatArray) -> str:
    return "#" + "".join(f"{round(255 * value):02x}" for value in color.tolist())


def _parsed(code: str) -> FloatArray:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", code):
        raise ParameterError(f"a colour must be # and six hexadecimal digits, not {quoted(code)}")
    return np.frombuffer(bytes.fromhex(code[1:]), np.uint8) / 255


def _cut(text: str, longest: int) -> str:
    return text if len(text) <= longest else text[:longest].rpartition(",")[0] + ", ..."


def _colors(name: str, values: ArrayLike, count: int) -> FloatArray:
    stored = _broadcast(name, values, (count, 3))
    if not ((stored >= 0) & (stored <= 1)).all():
        raise ValueError(f"{name} must be in [0, 1]")
    return stored


def _lengths(name: str, values: ArrayLike, count: int) -> FloatArray:
    stored = _broadcast(name, values, (count,))
    if not ((stored > 0) & np.isfinite(stored)).all():
        raise ValueError(f"{name} must be finite and above 0 millimetres")
    return stored


def _broadcast(name: str, values: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    given = np.asarray(values)
    if given.dtype.kind not in "fiu":
        raise ValueError(f"{name} must hold real numbers, not {given.dtype}")
    if given.shape not in (shape, shape[1:]):
        wanted = " or ".join(map(str, (shape, shape[1:])))
        raise ValueError(f"{name} must be of shape {wanted}, not {given.shape}")
    # Adding 0 turns -0 into 0, so that equal arrays have equal bytes and thus equal hashes.
    stored = np.broadcast_to(given.astype(np.float64), shape) + 0.0
    stored.flags.writeable = False
    return stored


def _title(title: str) -> str:
    if not isinstance(title, str):
        raise TypeError(f"title must be text, not a {type(title).__name__}")
    stripped = title.strip()
    if "\n" in stripped or "\r" in stripped:
        raise ValueError("title must be one line; longer texts belong into notes")
    return stripped


def _notes(notes: str) -> str:
    if not isinstance(notes, str):
        raise TypeError(f"notes must be text, not a {type(notes).__name__}")
    unix = notes.replace("\r\n", "\n").replace("\r", "\n")
    return "\n".join(line.strip() for line in unix.split("\n")).strip()
