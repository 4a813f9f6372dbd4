"""The text of a WIF: sections, keys and values, each with its line number.

What the values mean is `_wif_read`'s business. A WIF looks like an INI file: section and key
names in any case and order, CR, LF or both at the ends of lines, `;` at a line's start for a
comment. Whether a later `;` starts a comment depends on the value: it does after numbers and
booleans, and belongs to a string.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from decimal import Decimal, InvalidOperation
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from plycloth._check import MOST_QUOTED, quoted

T = TypeVar("T")

_TRUE = ("true", "on", "yes", "1")
_FALSE = ("false", "off", "no", "0")

_WHOLE_NUMBERS = re.compile(r"[0-9,\s]*", re.ASCII)

# Longer row numbers are refused before `int` works on them.
_MOST_DIGITS = 9

# Numbers beyond 10 to this power, or its inverse, are refused before they are computed with.
_MOST_DECIMALS = 100


class WifError(ValueError):
    """A file that cannot be read as a WIF.

    Attributes
    ----------
    problem : str
        What is wrong.
    file : str
        Name of the file.
    section, key : str or None
        Where it is wrong, if it is in a section, or at a key.
    line : int or None
        The line's number, from 1.
    """

    def __init__(
        self,
        problem: str,
        file: str,
        section: str | None = None,
        key: str | None = None,
        line: int | None = None,
    ) -> None:
        super().__init__(problem, file, section, key, line)
        self.problem = problem
        self.file = file
        self.section = section
        self.key = key
        self.line = line

    def __str__(self) -> str:
        line = f", line {self.line}" if self.line else ""
        return f"{self.file}{line}: {_place(self.section, self.key)}{self.problem}"


class WifWarning(UserWarning):
    """Something odd in a WIF that does not keep it from being read."""


class Entry(NamedTuple):
    """A line `key=value`."""

    section: str
    key: str
    value: str
    line: int

    @property
    def bare(self) -> str:
        """The value without the comment that may follow a number or a boolean."""
        return self.value.partition(";")[0].strip()


@dataclass
class Wif:
    """The sections of a file, in upper case, each a table from keys, in lower case, to entries.

    Problems that do not keep the file from being read gather in `oddities`. `strict` makes errors
    of those that something must be guessed for.
    """

    file: str
    strict: bool = False
    sections: dict[str, dict[str, Entry]] = field(default_factory=dict)
    oddities: list[str] = field(default_factory=list)

    def rows_of(self, section: str) -> dict[str, Entry]:
        """Return the entries of a section, none if it is absent."""
        return self.sections.get(section, {})

    def entry(self, section: str, key: str) -> Entry | None:
        """Return an entry, None if it is absent or has no value."""
        found = self.rows_of(section).get(key)
        return found if found and found.bare else None

    def numbered(
        self, section: str, limit: int | None = None, *, first: int = 1
    ) -> dict[int, Entry]:
        """Return the entries with keys from `first` to `limit` in their order; others are odd.

        Where they count from 1, rows from 0 to `limit` - 1 are taken for those from 1 to `limit`.
        """
        shift = 1 if limit and first == 1 and self.counts_from_zero(section, limit) else 0
        numbered, odd = {}, []
        for key, entry in self.rows_of(section).items():
            number = _row_number(key)
            if number is None or number + shift < first or (limit and number + shift > limit):
                odd.append(entry)
            else:
                numbered[number + shift] = entry
        if shift:
            problem = f"rows are counted from 0 and there is none at {limit}"
            self.take("each is taken for the next", self.error(problem, section=section))
        if odd and limit:
            problem = f"not the number of a row from {first} to {limit}"
            self.take("left out", *(self.error(problem, entry) for entry in odd))
        else:
            self.note_all(odd, "not the number of a row")
        return dict(sorted(numbered.items()))

    def counts_from_zero(self, section: str, count: int | None) -> bool:
        """Tell whether a section of `count` rows has one at 0, and none at `count`."""
        numbers = {_row_number(key) for key, entry in self.rows_of(section).items() if entry.bare}
        return 0 in numbers and count not in numbers

    def read_rows(
        self, rows: Mapping[int, Entry], read: Callable[[Entry], T], taken: str
    ) -> dict[int, T]:
        """Read each row that has a value; `taken` says what is taken for those that cannot be."""
        # Rows repeat: each distinct text is read once.
        known: dict[str, T | WifError] = {}
        values: dict[int, T] = {}
        unread = []
        for number, entry in rows.items():
            if not entry.bare:
                continue
            if entry.bare not in known:
                known[entry.bare] = _value_or_error(read, entry)
            value = known[entry.bare]
            if isinstance(value, WifError):
                unread.append(value)
            else:
                values[number] = value
        if unread:
            self.take(taken, *unread)
        return values

    def take(self, taken: str, *errors: WifError) -> None:
        """Raise the first of some errors if strict, else remember what is taken in their place."""
        if self.strict:
            raise errors[0]
        more = f" (and {len(errors) - 1} more lines)" if len(errors) > 1 else ""
        oddity = f"{errors[0]}{more}: {taken}"
        if oddity not in self.oddities:
            self.oddities.append(oddity)

    def note(self, oddity: str, entry: Entry | None = None, section: str | None = None) -> None:
        """Remember an oddity, at an entry or in a section."""
        line = f", line {entry.line}" if entry else ""
        place = _place(entry.section, entry.key) if entry else _place(section, None)
        self.oddities.append(f"{self.file}{line}: {place}{oddity}")

    def note_all(self, entries: list[Entry], oddity: str) -> None:
        """Remember, once, an oddity that several entries share."""
        if entries:
            more = f" (and {len(entries) - 1} more lines)" if len(entries) > 1 else ""
            self.note(oddity + more, entries[0])

    def error(
        self, problem: str, entry: Entry | None = None, section: str | None = None
    ) -> WifError:
        """Return the error for a problem at an entry, or in a section."""
        if entry:
            return WifError(problem, self.file, entry.section, entry.key, entry.line)
        return WifError(problem, self.file, section)

    def whole_numbers(self, entry: Entry) -> NDArray[np.int64]:
        """Read a list of whole numbers, parted by commas or white space."""
        text = entry.bare
        if not _WHOLE_NUMBERS.fullmatch(text):
            raise self.error(f"must be whole numbers parted by commas, not {quoted(text)}", entry)
        parted = text.replace(",", " ").strip()
        if not parted:
            return np.empty(0, dtype=np.int64)
        return np.fromstring(parted, dtype=np.int64, sep=" ")

    def count(self, entry: Entry) -> int:
        """Read one whole number."""
        text = entry.bare
        if not (text.isdecimal() and len(text) <= _MOST_DIGITS):
            raise self.error(f"must be a whole number, not {quoted(text)}", entry)
        return int(text)

    def decimals(self, entry: Entry) -> list[Decimal]:
        """Read a list of finite decimal numbers, parted by commas."""
        try:
            numbers = [Decimal(part.strip()) for part in entry.bare.split(",")]
        except InvalidOperation:
            raise self.error(f"must be numbers, not {quoted(entry.bare)}", entry) from None
        if not all(number.is_finite() for number in numbers):
            raise self.error(f"must be finite, not {quoted(entry.bare)}", entry)
        if any(number and abs(number.adjusted()) > _MOST_DECIMALS for number in numbers):
            raise self.error(f"is too large or too small: {quoted(entry.bare)}", entry)
        return numbers

    def boolean(self, entry: Entry) -> bool:
        """Read true, on, yes or 1, or the opposite."""
        text = entry.bare.lower()
        if text not in _TRUE + _FALSE:
            choices = ", ".join(_TRUE + _FALSE)
            raise self.error(f"must be one of {choices}, not {quoted(entry.bare)}", entry)
        return text in _TRUE


def parse(text: str, file: str, is_relevant: Callable[[str], bool], *, strict: bool = False) -> Wif:
    """Part the text of a file into sections and entries.

    A section that appears twice is one section; of a key that appears twice, the last counts.
    Lines that are neither a section nor an entry are odd, unless they stand in a section that
    is not relevant, such as a program's private one.
    """
    wif = Wif(file, strict)
    section = ""
    stray, replacing = [], []
    for number, raw in enumerate(_lines(text), start=1):
        line = raw.strip()
        if line.startswith("["):
            section = _normal(line[1:].partition("]")[0]).upper()
            if section in wif.sections and is_relevant(section):
                wif.note(f"appears again in line {number}; both count", section=section)
            wif.sections.setdefault(section, {})
        elif line and line[0] != ";":
            key, equals, value = line.partition("=")
            entry = Entry(section, _normal(key), value.strip(), number)
            if not (equals and entry.key and section):
                stray.append(entry)
            elif _replaces(wif.sections[section], entry):
                replacing.append(entry)
    wif.note_all([e for e in replacing if is_relevant(e.section)], "replaces an earlier value")
    _note_stray(wif, [e for e in stray if not e.section or is_relevant(e.section)])
    return wif


def _replaces(rows: dict[str, Entry], entry: Entry) -> bool:
    """Store an entry, and tell whether another value stood there before."""
    before = rows.get(entry.key.lower(), entry)
    rows[entry.key.lower()] = entry
    return before.value != entry.value


def _note_stray(wif: Wif, stray: list[Entry]) -> None:
    if stray:
        count = f"{len(stray)} lines, this the first, are" if len(stray) > 1 else "this line is"
        place = f"{wif.file}, line {stray[0].line}"
        wif.oddities.append(f"{place}: {count} neither [section] nor key=value")


def _value_or_error(read: Callable[[Entry], T], entry: Entry) -> T | WifError:
    try:
        return read(entry)
    except WifError as error:
        return error


def _row_number(key: str) -> int | None:
    return int(key) if key.isdecimal() and len(key) <= _MOST_DIGITS else None


def _lines(text: str) -> list[str]:
    # `str.splitlines` would also part lines at form feeds and the like.
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _normal(name: str) -> str:
    return name.strip() if name.isdecimal() else " ".join(name.split())


def _place(section: str | None, key: str | None) -> str:
    if not section:
        return ""
    return f"[{_cut(section)}] {_cut(key)}: " if key else f"[{_cut(section)}]: "


def _cut(name: str) -> str:
    return name if len(name) <= MOST_QUOTED // 2 else f"{name[: MOST_QUOTED // 2 - 3]}..."
