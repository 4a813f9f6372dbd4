"""Yarn relaxation: heights of the yarns of a weave, after Montazeri et al. 2020, section 3.1."""

from __future__ import annotations

import io
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth import _plycloth
from plycloth._check import (
    NON_NEGATIVE,
    POSITIVE,
    ParameterError,
    Range,
    array,
    integer,
    number,
    number_or_array,
)
from plycloth._value import Description
from plycloth.progress import Progress, relaxing
from plycloth.weave import WeavePattern

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]

# Yarns that rise higher, or more steeply, lie in no cloth.
_heights = array((None, None), Range(-1e3, 1e3))
_slopes = array((None, None), Range(-1e6, 1e6))
_spacings = array((None,), POSITIVE)
_positive = number(POSITIVE)
_one_or_each = number_or_array(POSITIVE)


@dataclass(frozen=True, eq=False, repr=False)
class Relaxed(Description):
    """Relaxed yarns of one cell, as `relax` finds them.

    A yarn's height over the plane of the cloth is a periodic piecewise cubic, given at two knots
    per crossing: even knots are the boundaries of the slots of the crossed yarns, odd ones their
    middles, so that knot ``2 * j + 1`` is the crossing with yarn ``j`` of the other direction.

    Attributes
    ----------
    energy : float
        Strain and collision energy of one cell, Eq. 4.
    gradient_norm : float
        Euclidean norm of the energy's gradient with respect to all heights and slopes.
    iterations : int
        Newton steps taken.
    warp_height, warp_slope : ndarray, shape (ends, 2 * picks)
        Height, and its derivative along the yarn in the pattern's order of picks.
    weft_height, weft_slope : ndarray, shape (picks, 2 * ends)
        The same for the weft, along the pattern's order of ends.
    warp_spacing, weft_spacing : ndarray, shape (ends,) and (picks,)
        Width of each yarn's slot.
    """

    energy: Annotated[float, number(NON_NEGATIVE)]
    gradient_norm: Annotated[float, number(NON_NEGATIVE)]
    iterations: Annotated[int, integer(0, 2**31)]
    warp_height: Annotated[FloatArray, _heights]
    warp_slope: Annotated[FloatArray, _slopes]
    weft_height: Annotated[FloatArray, _heights]
    weft_slope: Annotated[FloatArray, _slopes]
    warp_spacing: Annotated[FloatArray, _spacings]
    weft_spacing: Annotated[FloatArray, _spacings]

    def check_pattern(self, name: str, pattern: WeavePattern) -> None:
        """Raise an error that speaks of `name` if the curves are not those of a pattern."""
        ends, picks = pattern.ends, pattern.picks
        for field, shape in (
            ("warp_height", (ends, 2 * picks)),
            ("warp_slope", (ends, 2 * picks)),
            ("weft_height", (picks, 2 * ends)),
            ("weft_slope", (picks, 2 * ends)),
            ("warp_spacing", (ends,)),
            ("weft_spacing", (picks,)),
        ):
            if (given := getattr(self, field).shape) != shape:
                wanted, given = (" x ".join(map(str, size)) for size in (shape, given))
                raise ParameterError(
                    f"{name}.{field} must be {wanted} for a pattern of {picks} picks x {ends} ends,"
                    f" not {given}"
                )
        over = self.warp_height[:, 1::2].T - self.weft_height[:, 1::2]
        wrong = np.where(pattern.warp_up, over, -over) < -1e-6
        if wrong.any():
            pick, end = np.argwhere(wrong)[0]
            raise ParameterError(
                f"{name} must have the yarn on top that the pattern has there, but has not at"
                f" {np.count_nonzero(wrong)} crossings, the first of end {end + 1} and pick"
                f" {pick + 1}"
            )

    def turned_over(self) -> Relaxed:
        """Return the heights of the cloth turned about the warp direction."""
        # The weft is seen from its other end: knot k is then knot -k.
        knots = -np.arange(self.weft_height.shape[1])
        return replace(
            self,
            warp_height=-self.warp_height[::-1],
            warp_slope=-self.warp_slope[::-1],
            weft_height=-self.weft_height[:, knots],
            weft_slope=self.weft_slope[:, knots],
            warp_spacing=self.warp_spacing[::-1],
        )

    def plot(self, *, ends: int = 4) -> Figure:
        """Draw the first ends from the side, and the picks that they cross as dots.

        Parameters
        ----------
        ends
            How many ends, at least 1; no more than there are.

        Raises
        ------
        ValueError
            If `ends` is less than 1.
        """
        from plycloth.plot import plot_relaxed

        return plot_relaxed(self, ends=ends)

    def _repr_png_(self) -> bytes:
        data = io.BytesIO()
        self.plot().savefig(data, format="png", dpi=80)
        return data.getvalue()


def relax(
    pattern: WeavePattern | ArrayLike,
    *,
    warp_radius: ArrayLike,
    weft_radius: ArrayLike,
    warp_stiffness: ArrayLike = 1.0,
    weft_stiffness: ArrayLike = 1.0,
    collision_stiffness: float = 1.0,
    warp_spacing: ArrayLike = 1.0,
    weft_spacing: ArrayLike = 1.0,
    progress: Progress = None,
) -> Relaxed:
    """Find the yarn heights of least energy of a weave repeated over the plane.

    The energy is Eq. 4 of Montazeri et al. 2020, "A Practical Ply-Based Appearance Model of Woven
    Fabrics", with a strain term per yarn (Eq. 2) and a collision term per crossing (Eq. 3). The
    pattern says which yarn is on top at each crossing. Among such heights the energy is convex;
    its minimum leaves open a common shift, taken such that the mean height of all crossings is
    zero, and how far yarns that nothing holds together lie apart: these are laid onto each other.

    Time grows with the crossings of yarns that hold each other, and where these float far it grows
    faster: cloth of mostly floats, 600 yarns wide and high, takes from some seconds to minutes.
    Stiffnesses that differ by more than a factor of 100 from yarn to yarn make it slow, too.
    Threads that interlace with nothing cost next to nothing. The memory is about 100 bytes for
    each crossing, 64 of them the result.

    Parameters
    ----------
    pattern : WeavePattern or array_like of bool, shape (picks, ends)
        True where the warp is on the face (towards positive heights).
    warp_radius, weft_radius : float or array_like
        Collision radius, one for all yarns or one per yarn; in the unit of the spacing.
    warp_stiffness, weft_stiffness : float or array_like
        Strain coefficient k, one for all yarns or one per yarn.
    collision_stiffness : float
        Collision coefficient k_c.
    warp_spacing, weft_spacing : float or array_like
        Width of a yarn's slot across its own direction, one for all yarns or one per yarn. A warp
        yarn's period is the sum of the weft's slots, and the other way round.
    progress
        None: a bar where a person watches, after half a second; False: none; or a callable of
        (done, total). Ctrl-C ends the work.

    Returns
    -------
    Relaxed
        The curves, in the unit of the spacing, and the energy.

    Raises
    ------
    ParameterError
        If a number is not finite and positive, or an array has not one number per yarn.
    ValueError
        If the pattern is empty, not two-dimensional, or holds anything but 0 and 1.
    TypeError
        If a value is no number at all.
    MemoryError
        If there is not as much memory as it takes.
    ConvergenceError
        If the minimum cannot be found because the numbers are too many orders of magnitude apart.
    """
    if not isinstance(pattern, WeavePattern):
        pattern = WeavePattern(pattern)
    warp_up = pattern.warp_up
    picks, ends = warp_up.shape
    spacing = (
        _per_yarn("warp_spacing", warp_spacing, ends),
        _per_yarn("weft_spacing", weft_spacing, picks),
    )
    yarns = (
        (
            _per_yarn("warp_radius", warp_radius, ends),
            _per_yarn("warp_stiffness", warp_stiffness, ends),
            spacing[0],
        ),
        (
            _per_yarn("weft_radius", weft_radius, picks),
            _per_yarn("weft_stiffness", weft_stiffness, picks),
            spacing[1],
        ),
    )
    stiffness = _positive("collision_stiffness", collision_stiffness)
    with relaxing(progress) as report:
        energy, gradient_norm, iterations, warp, weft = _plycloth.relax(
            warp_up, *yarns, stiffness, report
        )
    return Relaxed(energy, gradient_norm, iterations, *warp, *weft, *spacing)


def _per_yarn(name: str, value: ArrayLike, count: int) -> FloatArray:
    """Return one number per yarn, from such or from a single one."""
    checked = _one_or_each(name, value)
    if isinstance(checked, np.ndarray) and len(checked) != count:
        raise ParameterError(
            f"{name} must be one number, or one for each of the {count} yarns,"
            f" not {len(checked)} numbers"
        )
    return np.array(np.broadcast_to(checked, count))
