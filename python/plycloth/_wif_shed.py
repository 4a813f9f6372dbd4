"""From threading, tie-up, treadling or lift plan of a WIF to the pattern they weave."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plycloth._wif_text import Entry, Wif, WifError

# More crossings, or shafts times picks, than this are taken for a mistake in the file rather
# than worked on until the memory is full.
MOST_CELLS = 100_000_000

BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]


class Shed(NamedTuple):
    """What the draft weaves, and which of its yarns the file really speaks of."""

    warp_up: BoolArray
    is_threaded: BoolArray
    is_treadled: BoolArray


class _Lists(NamedTuple):
    """A section whose rows are lists, as pairs of a row and a number in it, sorted by row."""

    entries: dict[int, Entry]
    row: IntArray
    number: IntArray

    def of_numbers_from(self, first: int) -> "_Lists":
        """Return the pairs of numbers from `first`: from 1, since 0 stands for none."""
        kept = self.number >= first
        return self._replace(row=self.row[kept], number=self.number[kept])


def treading_section(wif: Wif) -> str:
    """Return the section that says what each pick lifts: a tie-up pair wins over a lift plan."""
    if wif.rows_of("TIEUP") and wif.rows_of("TREADLING"):
        return "TREADLING"
    if wif.rows_of("LIFTPLAN"):
        return "LIFTPLAN"
    for present, missing in (("TREADLING", "TIEUP"), ("TIEUP", "TREADLING")):
        if wif.rows_of(present):
            raise wif.error(f"has no rows, and [{present}] needs it", section=missing)
    raise wif.error("has no rows, nor have [TIEUP] and [TREADLING]", section="LIFTPLAN")


def read_shed(wif: Wif, picks: int, ends: int) -> Shed:
    """Work out the drawdown of `picks` x `ends` crossings."""
    _check_size(wif, picks, ends, "crossings")
    threading = _read_lists(wif, "THREADING", ends)
    first_shaft = _first_shaft(wif, threading, ends)
    threading = threading.of_numbers_from(first_shaft)
    treading = _read_lists(wif, treading_section(wif), picks)
    shafts, shaft = np.unique(threading.number, return_inverse=True)
    _check_size(wif, picks, shafts.size, "picks times shafts")
    if treading_section(wif) == "TREADLING":
        lifted = _lift_by_treadles(wif, treading, shafts, picks, first_shaft)
        _compare_with_plan(wif, lifted, shafts, first_shaft)
    else:
        lifted = _lift_by_plan(treading.of_numbers_from(first_shaft), shafts, picks)
    _check_shaft_count(wif, threading)
    by_shaft = np.ascontiguousarray(lifted.T)
    warp_up = _unite_rows(ends, threading.row - 1, shaft, by_shaft).T
    if (rising := wif.entry("WEAVING", "rising shed")) and not wif.boolean(rising):
        warp_up = ~warp_up
    shed = Shed(warp_up, _rows_given(threading, ends), _rows_given(treading, picks))
    _note_bare_yarns(wif, "THREADING", shed.is_threaded)
    _note_bare_yarns(wif, treading_section(wif), shed.is_treadled)
    return shed


def _first_shaft(wif: Wif, threading: _Lists, ends: int) -> int:
    """Return 0 if the shafts are counted from there, as ends are then too, else 1."""
    if not (wif.counts_from_zero("THREADING", ends) and (threading.number == 0).any()):
        return 1
    declared = wif.entry("WEAVING", "shafts")
    if declared and (threading.number >= wif.count(declared)).any():
        return 1
    problem = wif.error("shafts are counted from 0, as are rows", section="THREADING")
    wif.take("0 is taken for a shaft, not for none", problem)
    return 0


def _read_lists(wif: Wif, section: str, limit: int | None = None, *, first: int = 1) -> _Lists:
    entries = wif.numbered(section, limit, first=first)
    # Rows repeat: each distinct text is read once.
    known: dict[str, IntArray] = {}
    lists = []
    for entry in entries.values():
        if (numbers := known.get(entry.value)) is None:
            numbers = known[entry.value] = wif.whole_numbers(entry)
        lists.append(numbers)
    lengths = np.array([numbers.size for numbers in lists], dtype=np.int64)
    row = np.repeat(np.array(list(entries), dtype=np.int64), lengths)
    number = np.concatenate([np.empty(0, dtype=np.int64), *lists])
    return _Lists(entries, row, number)


def _lift_by_treadles(
    wif: Wif, treadling: _Lists, shafts: IntArray, picks: int, first_shaft: int
) -> BoolArray:
    """Return picks x shafts: whether one of the pick's treadles is tied to the shaft."""
    entry = wif.entry("WEAVING", "treadles")
    declared = wif.count(entry) if entry else None
    tieup, first_treadle = _read_tieup(wif, treadling, declared)
    tieup = tieup.of_numbers_from(first_shaft)
    treadling = treadling.of_numbers_from(first_treadle)
    _check_treadles(wif, treadling, tieup, declared)
    treadles, treadle = np.unique(treadling.number, return_inverse=True)
    _check_size(wif, treadles.size, shafts.size, "treadles times shafts")
    ties = np.zeros((treadles.size, shafts.size), dtype=bool)
    tied_treadle, is_trodden = _look_up(tieup.row, treadles)
    tied_shaft, is_threaded = _look_up(tieup.number, shafts)
    is_used = is_trodden & is_threaded
    ties[tied_treadle[is_used], tied_shaft[is_used]] = True
    return _unite_rows(picks, treadling.row - 1, treadle, ties)


def _read_tieup(wif: Wif, treadling: _Lists, declared: int | None) -> tuple[_Lists, int]:
    """Return the tie-up, and the number of the first treadle: 0 if both sections count so."""
    if not wif.counts_from_zero("TIEUP", declared):
        return _read_lists(wif, "TIEUP"), 1
    tieup = _read_lists(wif, "TIEUP", first=0)
    count = max(tieup.entries) + 1
    if (treadling.number >= count).any():
        return _read_lists(wif, "TIEUP", count), 1
    problem = wif.error("rows are counted from 0", section="TIEUP")
    wif.take("0 in [TREADLING] is taken for the first treadle, not for none", problem)
    return tieup, 0


def _check_treadles(wif: Wif, treadling: _Lists, tieup: _Lists, declared: int | None) -> None:
    """Refuse a treadle that is beyond those declared and not tied up; either alone is odd.

    A treadle within those declared may well have no row: it lifts nothing.
    """
    beyond = np.flatnonzero(treadling.number > (declared or 0))
    if not beyond.size:
        return
    tied = np.array(list(tieup.entries), dtype=np.int64)
    untied = beyond[~np.isin(treadling.number[beyond], tied)]
    first = int(untied[0] if untied.size else beyond[0])
    treadle, entry = treadling.number[first], treadling.entries[int(treadling.row[first])]
    if untied.size and declared is not None:
        raise wif.error(
            f"treadle {treadle} has no row in [TIEUP] and is beyond Treadles={declared}", entry
        )
    if untied.size:
        problem = wif.error(f"treadle {treadle} has no row in [TIEUP]", entry)
        wif.take("it is taken to lift nothing", problem)
    elif declared is not None:
        problem = wif.error(f"treadle {treadle} is beyond Treadles={declared}", entry)
        wif.take("it is taken as tied up", problem)


def _compare_with_plan(wif: Wif, lifted: BoolArray, shafts: IntArray, first_shaft: int) -> None:
    """See that a lift plan that stands beside the tie-up and treadling lifts the same shafts."""
    if not wif.rows_of("LIFTPLAN"):
        return
    picks = len(lifted)
    taken = "the tie-up and treadling are taken"
    try:
        plan = _read_lists(wif, "LIFTPLAN", picks).of_numbers_from(first_shaft)
    except WifError as error:
        wif.take(taken, error)
        return
    differs = (_lift_by_plan(plan, shafts, picks) != lifted).any(axis=1)
    if (where := np.flatnonzero(differs & _rows_given(plan, picks))).size:
        problem = f"disagrees with the tie-up and treadling, as the first of {where.size} picks"
        wif.take(taken, wif.error(problem, plan.entries[int(where[0]) + 1]))


def _lift_by_plan(plan: _Lists, shafts: IntArray, picks: int) -> BoolArray:
    """Return picks x shafts: whether the pick's row of the lift plan names the shaft."""
    lifted = np.zeros((picks, shafts.size), dtype=bool)
    shaft, is_threaded = _look_up(plan.number, shafts)
    lifted[plan.row[is_threaded] - 1, shaft[is_threaded]] = True
    return lifted


def _look_up(values: IntArray, ascending: IntArray) -> tuple[IntArray, BoolArray]:
    """Return where each value stands in an array, and whether it is there at all."""
    if not ascending.size:
        return np.zeros_like(values), np.zeros(values.shape, dtype=bool)
    position = np.searchsorted(ascending, values).clip(max=ascending.size - 1)
    return position, ascending[position] == values


def _unite_rows(count: int, row: IntArray, source: IntArray, table: BoolArray) -> BoolArray:
    """Return `count` rows, each the union of those rows of `table` that its pairs name.

    `row` and `source` are the pairs, sorted by row and counted from 0.
    """
    united = np.zeros((count, table.shape[1]), dtype=bool)
    rank = np.arange(row.size) - np.searchsorted(row, row)
    by_rank = np.argsort(rank, kind="stable")
    # A row occurs at most once per rank, so that each rank is one vectorised step.
    for chosen in np.split(by_rank, np.cumsum(np.bincount(rank))[:-1]):
        united[row[chosen]] |= table[source[chosen]]
    return united


def _rows_given(lists: _Lists, count: int) -> BoolArray:
    given = np.zeros(count, dtype=bool)
    given[np.array(list(lists.entries), dtype=np.int64) - 1] = True
    return given


def _note_bare_yarns(wif: Wif, section: str, is_given: BoolArray) -> None:
    if not is_given.all():
        missing = np.flatnonzero(~is_given) + 1
        wif.note(
            f"{missing.size} of {is_given.size} rows are absent, the first {missing[0]}; they are"
            " taken for empty",
            section=section,
        )


def _check_shaft_count(wif: Wif, threading: _Lists) -> None:
    declared = wif.entry("WEAVING", "shafts")
    if not declared:
        return
    shafts = wif.count(declared)
    beyond = np.flatnonzero(threading.number > shafts)
    if beyond.size:
        entry = threading.entries[int(threading.row[beyond[0]])]
        problem = f"shaft {threading.number[beyond[0]]} is beyond Shafts={shafts}"
        wif.take("it is taken for one more", wif.error(problem, entry))


def _check_size(wif: Wif, rows: int, columns: int, what: str) -> None:
    if rows * columns > MOST_CELLS:
        raise wif.error(f"{rows} x {columns} {what} are too many, at most {MOST_CELLS:,} are read")
