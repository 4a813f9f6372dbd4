"""Weave patterns: which yarn lies on the face of the cloth at each crossing."""

from __future__ import annotations

from collections.abc import Sequence
from math import gcd
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth._check import quoted
from plycloth.drawdown import drawdown_png


class WeavePattern:
    """One repeat of a weave: for each pick and each end, which of the two is on the face.

    The array reads like a drawdown: row 0 is the first pick, at the top; column 0 is the first
    end, at the left. A pattern is a value: it cannot be changed, equal patterns compare and hash
    equal, and it pickles. In a notebook it shows itself as a drawdown, warp black and weft white;
    `str` prints it as rows of `#` (warp) and `.` (weft).

    Parameters
    ----------
    warp_up
        Array of picks x ends, bool or of 0 and 1: True where the warp is on the face.

    Raises
    ------
    ValueError
        If the array is not two-dimensional, is empty, or holds anything but 0 and 1.
    """

    __slots__ = ("_warp_up",)

    def __init__(self, warp_up: ArrayLike) -> None:
        self._warp_up = _checked(warp_up)

    @property
    def warp_up(self) -> NDArray[np.bool_]:
        """Read-only bool array of picks x ends, True where the warp is on the face."""
        return self._warp_up

    @property
    def picks(self) -> int:
        """Number of picks (weft yarns) in the repeat."""
        return int(self._warp_up.shape[0])

    @property
    def ends(self) -> int:
        """Number of ends (warp yarns) in the repeat."""
        return int(self._warp_up.shape[1])

    @classmethod
    def from_rows(cls, rows: str | Sequence[str]) -> WeavePattern:
        """Return the pattern of rows of `#` (warp on the face) and `.` (weft), as `str` prints it.

        Parameters
        ----------
        rows
            From the top, as one text of lines or as a list.

        Raises
        ------
        ValueError
            If there are none, they differ in length, or hold another character.
        """
        lines = rows.split() if isinstance(rows, str) else rows
        is_rows = isinstance(lines, list | tuple) and all(isinstance(row, str) for row in lines)
        if not is_rows or not lines or not lines[0]:
            raise ValueError("rows must be a list of rows such as '#.#.'")
        for i, row in enumerate(lines):
            if len(row) != len(lines[0]) or set(row) - {"#", "."}:
                raise ValueError(
                    f"rows[{i}] must be {len(lines[0])} of '#' and '.', not {quoted(row)}"
                )
        marks = np.frombuffer("".join(lines).encode(), np.uint8).reshape(len(lines), -1)
        return cls(marks == ord("#"))

    @classmethod
    def plain(cls) -> WeavePattern:
        """Return the plain weave, 2 picks x 2 ends, the first end up on the first pick."""
        return cls(np.eye(2, dtype=bool))

    @classmethod
    def twill(cls, over: int, under: int) -> WeavePattern:
        """Return a twill: each end passes over `over` picks, then under `under` picks.

        The repeat has `over + under` picks and ends. From pick to pick the weave moves one end to
        the left, so that seen on the face the diagonals rise to the right.

        Raises
        ------
        ValueError
            If a number is not an integer of at least 1.
        """
        over = _count("over", over)
        period = over + _count("under", under)
        pick, end = np.indices((period, period))
        return cls((pick + end) % period < over)

    @classmethod
    def satin(cls, ends: int, step: int) -> WeavePattern:
        """Return a warp-faced satin: each end passes under one pick in `ends`.

        From pick to pick the end that goes under moves by `step` (the counter) to the right.
        The weft-faced sateen of the same counter is `satin(ends, step).flipped().mirrored()`.

        Parameters
        ----------
        ends
            Ends, and picks, of the repeat: at least 5.
        step
            From 2 to `ends - 2` and coprime to `ends`, so that no two bindings touch and every
            end is bound.

        Raises
        ------
        ValueError
            If there is no such satin; the message lists the valid counters.
        """
        ends, step = _count("ends", ends), _count("step", step)
        valid = [k for k in range(2, ends - 1) if gcd(k, ends) == 1]
        if not valid:
            raise ValueError(f"there is no {ends}-end satin: ends must be 5, or 7 and more")
        if step not in valid:
            choices = ", ".join(map(str, valid))
            raise ValueError(f"step of a {ends}-end satin must be one of {choices}, not {step}")
        warp_up = np.ones((ends, ends), dtype=bool)
        picks = np.arange(ends)
        warp_up[picks, picks * step % ends] = False
        return cls(warp_up)

    @classmethod
    def basket(cls, n: int) -> WeavePattern:
        """Return the n x n basket weave: a plain weave of bundles of `n` yarns.

        Raises
        ------
        ValueError
            If `n` is not an integer of at least 1.
        """
        block = np.ones((_count("n", n),) * 2, dtype=bool)
        return cls(np.kron(np.eye(2, dtype=bool), block))

    def mirrored(self) -> WeavePattern:
        """Return the pattern with its ends in the opposite order: a twill leans the other way."""
        return WeavePattern(self._warp_up[:, ::-1])

    def flipped(self) -> WeavePattern:
        """Return the back of the cloth as seen from behind, turned about the warp direction."""
        return WeavePattern(~self._warp_up[:, ::-1])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, WeavePattern):
            return NotImplemented
        return np.array_equal(self._warp_up, other._warp_up)

    def __hash__(self) -> int:
        return hash((self._warp_up.shape, np.packbits(self._warp_up).tobytes()))

    def __reduce__(self) -> tuple[Any, ...]:
        # Made anew, a copy's array is read-only again.
        return WeavePattern, (self._warp_up,)

    def __repr__(self) -> str:
        return f"WeavePattern({self.picks} picks x {self.ends} ends)"

    def __str__(self) -> str:
        return "\n".join("".join(row) for row in np.where(self._warp_up, "#", "."))

    def _repr_png_(self) -> bytes:
        black, white = np.zeros(3), np.ones(3)
        return drawdown_png(self._warp_up, black, white)


def _checked(warp_up: ArrayLike) -> NDArray[np.bool_]:
    try:
        given = np.asarray(warp_up)
    except ValueError:
        raise ValueError("warp_up must be an array, but its rows differ in length") from None
    if given.ndim != 2 or given.size == 0:
        raise ValueError(
            f"warp_up must be picks x ends, at least 1 x 1, not of shape {given.shape}"
        )
    if given.dtype.kind not in "biuf" or not np.isin(given, (0, 1)).all():
        raise ValueError("warp_up must hold only booleans, or 0 and 1")
    stored = np.array(given, dtype=bool, order="C")
    stored.flags.writeable = False
    return stored


def _count(name: str, value: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or value < 1:
        raise ValueError(f"{name} must be an integer of at least 1, not {quoted(value)}")
    return int(value)
