"""What the parts of a fabric must be for each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from plycloth._check import ParameterError
from plycloth.relax import Relaxed
from plycloth.weave import WeavePattern
from plycloth.yarn import RoundYarn, Yarn
from plycloth.yarn_set import MAX_HALF_WIDTH, Yarns, kinds_of

FloatArray = NDArray[np.float64]

# A spacing below this part of the mean lets very many yarns lie on each other.
MIN_SPACING = 1.0 / 256.0

# A pitch below this part of a crossing would need very many segments: it is an error where a yarn
# has it, and no yarn's that leaves its pitch open.
MIN_PITCH = 0.125


def check_heights(
    heights: Relaxed, pattern: WeavePattern, spacings: tuple[FloatArray, FloatArray]
) -> None:
    """See that heights are of a pattern, and of these spacings (over their mean)."""
    heights.check_pattern("Fabric.heights", pattern)
    for name, spacing in zip(("warp", "weft"), spacings, strict=True):
        if not np.allclose(getattr(heights, f"{name}_spacing"), spacing, rtol=1e-6, atol=0.0):
            raise ParameterError(
                f"Fabric.heights.{name}_spacing must be that of the fabric over its mean: these"
                " are the heights of another cloth"
            )


def check_count(name: str, values: object, yarns: str, count: int) -> None:
    """See that values of single yarns are as many as the pattern's."""
    if isinstance(values, np.ndarray | tuple) and len(values) != count:
        what = "yarn" if isinstance(values, tuple) else "row"
        raise ParameterError(
            f"Fabric.{name} must have one {what} for each of the pattern's {count} {yarns},"
            f" not {len(values)}"
        )


def check_yarns(
    name: str, yarns: Yarns, spacing: float | FloatArray, crossing: float | FloatArray
) -> None:
    """See that yarns suit their own spacing and that of the yarns that they cross."""
    mean = float(np.mean(spacing))
    if np.min(spacing) < MIN_SPACING * mean:
        raise ParameterError(
            f"Fabric.{name}_spacing_mm must be at least 1/256 of its mean, {MIN_SPACING * mean:g},"
            f" not {np.min(spacing):g}"
        )
    if not isinstance(yarns, Sequence):
        _check_width(f"Fabric.{name}", yarns, mean)
        _check_pitch(f"Fabric.{name}", yarns, crossing)
        return
    for yarn in kinds_of(yarns, len(yarns))[0]:
        place = f"Fabric.{name}[{yarns.index(yarn)}]"
        _check_width(place, yarn, mean)
        _check_pitch(place, yarn, crossing)


def _check_width(name: str, yarn: Yarn, mean: float) -> None:
    if yarn.half_width > MAX_HALF_WIDTH * mean:
        raise ParameterError(
            f"{name} must have a radius (or half width) of at most {MAX_HALF_WIDTH:g}"
            f" spacings, {MAX_HALF_WIDTH * mean:g} mm, not {yarn.half_width:g} mm:"
            " a wider yarn would pass through its second neighbours"
        )


def _check_pitch(name: str, yarn: Yarn, crossing: float | FloatArray) -> None:
    least = MIN_PITCH * float(np.mean(crossing))
    if not isinstance(yarn, RoundYarn) or yarn.plies == 1 or yarn.pitch_mm is None:
        return
    if abs(yarn.pitch) < least:
        raise ParameterError(
            f"{name} must have a pitch of at least {MIN_PITCH:g} of the crossing yarns'"
            f" spacing, {least:g} mm, not {abs(yarn.pitch):g} mm"
        )


def with_pitch(yarn: Yarn, crossing: float | FloatArray) -> Yarn:
    """Return the yarn, with a pitch if it leaves that open and is thin where others are far."""
    least = MIN_PITCH * float(np.mean(crossing))
    if isinstance(yarn, RoundYarn) and yarn.pitch_mm is None and yarn.pitch < least:
        return replace(yarn, pitch_mm=least)
    return yarn
