"""The yarns of one direction: one for all threads, or one for each."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plycloth._check import instance
from plycloth.yarn import FlatYarn, RoundYarn, Yarn

Yarns = Yarn | Sequence[Yarn]

# Half widths beyond this many mean spacings reach past the centre of the second neighbour.
MAX_HALF_WIDTH = 2.0

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


def refit(
    yarns: Yarns,
    kinds: Sequence[Yarn],
    kind_of: NDArray[np.uint32],
    measures: Sequence[tuple[float, float, float]],
) -> Yarns:
    """Return the yarns with a half width, a thickness and a collision radius for each kind."""
    resized = [_resized(yarn, *new) for yarn, new in zip(kinds, measures, strict=True)]
    if not isinstance(yarns, Sequence):
        return yarns if resized[0] is kinds[0] else resized[0]
    return tuple(
        yarn if resized[kind] is kinds[kind] else resized[kind]
        for yarn, kind in zip(yarns, kind_of, strict=True)
    )


def _resized(yarn: Yarn, half_width: float, thickness: float, collision: float) -> Yarn:
    """Return the yarn with other measures, or the same one if they are its own."""
    if (half_width, thickness, collision) == (
        yarn.half_width,
        yarn.thickness,
        yarn.collision_radius,
    ):
        return yarn
    if isinstance(yarn, FlatYarn):
        return replace(yarn, width_mm=2.0 * half_width, thickness_mm=thickness)
    narrower = half_width / yarn.radius_mm
    return replace(
        yarn,
        radius_mm=half_width,
        pitch_mm=yarn.pitch,
        ply_radius_mm=None if yarn.ply_radius_mm is None else narrower * yarn.ply_radius_mm,
        thickness_mm=thickness,
        collision_radius_mm=collision,
    )
