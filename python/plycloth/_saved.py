"""Descriptions that are saved to files of their own."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import Self

from plycloth._value import Description


@dataclass(frozen=True, eq=False, repr=False)
class Saved(Description):
    """A description that a user keeps in a file."""

    @classmethod
    def load(cls, path: str | PathLike[str]) -> Self:
        """Read a JSON file that `save` wrote.

        Raises
        ------
        FormatError
            If the file does not hold a value of this kind.
        OSError
            If it cannot be opened.
        """
        # The format knows all descriptions, and so is above them.
        from plycloth._json import load_as

        return load_as(cls, path)

    def save(self, path: str | PathLike[str]) -> None:
        """Write one readable JSON file.

        Raises
        ------
        FormatError
            If it holds an environment image that is too large for JSON and is in no file.
        OSError
            If the file cannot be written.
        """
        from plycloth._json import save

        save(self, path)
