"""The yarns of one direction: one for all threads, or one for each."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plycloth._check import instance
from plycloth.yarn import FlatYarn, RoundYarn, Yarn

Yarns = Yarn | Sequence[Yarn]

_yarn = instance(RoundYarn, FlatYarn)


def one_or_each(name: str, value: Any) -> Yarns:
    """Check for a yarn, or a sequence of one per thread; stores equal ones as one object."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        yarn: Yarn = _yarn(name, value)
        return yarn
    known: dict[Yarn, Yarn] = {}
    each = (_yarn(f"{name}[{i}]", yarn) for i, yarn in enumerate(value))
    return tuple(known.setdefault(yarn, yarn) for yarn in each)


def kinds_of(yarns: Yarns, count: int) -> tuple[list[Yarn], NDArray[np.uint32]]:
    """Return the different yarns in the order of their first threads, and each thread's number."""
    if isinstance(yarns, RoundYarn | FlatYarn):
        return [yarns], np.zeros(count, np.uint32)
    # `one_or_each` has made equal ones the same.
    numbers: dict[int, int] = {}
    of_thread = [numbers.setdefault(id(yarn), len(numbers)) for yarn in yarns]
    firsts = np.unique(of_thread, return_index=True)[1]
    return [yarns[first] for first in firsts], np.array(of_thread, np.uint32)


def with_each(yarns: Yarns, change: Callable[[Yarn], Yarn]) -> Yarns:
    """Return the yarns with a change made to each; it is called once for each different one."""
    if isinstance(yarns, RoundYarn | FlatYarn):
        return change(yarns)
    changed = {yarn: change(yarn) for yarn in kinds_of(yarns, len(yarns))[0]}
    return tuple(changed[yarn] for yarn in yarns)
