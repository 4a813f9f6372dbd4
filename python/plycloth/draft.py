"""Weaving drafts: a pattern and the colour, spacing and thickness of each yarn."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth.drawdown import drawdown_png
from plycloth.weave import WeavePattern

FloatArray = NDArray[np.float64]

# What a draft gets that says nothing: dark ends and light picks, so that the drawdown reads as
# usual, yarns 1 mm apart and four fifths as thick as they are apart.
DEFAULT_WARP_COLOR = (0.2, 0.2, 0.2)
DEFAULT_WEFT_COLOR = (0.9, 0.9, 0.9)
DEFAULT_SPACING = 1.0
DEFAULT_THICKNESS_RATIO = 0.8


@dataclass(frozen=True, eq=False, repr=False)
class Draft:
    """A weaving draft: what to weave, with which colours, how dense and how thick.

    A draft is a value: frozen, its arrays read-only, compared and hashed by content, picklable.
    In a notebook it shows itself as a drawdown in the yarns' colours. `from_pattern` has defaults
    for everything but the pattern.

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
        title = f"{self.title!r}, " if self.title else ""
        return f"Draft({title}{self.pattern.picks} picks x {self.pattern.ends} ends)"

    def _repr_png_(self) -> bytes:
        return drawdown_png(self.pattern.warp_up, self.warp_colors, self.weft_colors)

    def _values(self) -> tuple[Any, ...]:
        return tuple(getattr(self, each.name) for each in fields(self))

    def _content(self) -> tuple[Any, ...]:
        return tuple(v.tobytes() if isinstance(v, np.ndarray) else v for v in self._values())

    def _store(self, name: str, check: Any, count: int) -> None:
        object.__setattr__(self, name, check(name, getattr(self, name), count))


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
