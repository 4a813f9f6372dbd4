"""Woven fabrics: a weave pattern, the yarns that follow it, and how close they lie."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth import _plycloth
from plycloth._check import (
    POSITIVE,
    UNIT,
    NumberOrNumbers,
    array,
    instance,
    integer,
    number,
    number_or_array,
    optional,
)
from plycloth._color import decode
from plycloth._saved import Saved
from plycloth.draft_yarns import draft_yarns
from plycloth.fabric_check import check_count, check_heights, check_yarns, with_pitch
from plycloth.overlap import Overlaps, OverlapWarning
from plycloth.progress import Progress, relaxing
from plycloth.relax import Relaxed
from plycloth.shared_cloth import relaxed_cloth
from plycloth.trade import spacing_mm
from plycloth.weave import WeavePattern
from plycloth.yarn import Yarn
from plycloth.yarn_set import Yarns, kinds_of, one_or_each, refit

if TYPE_CHECKING:
    from plycloth.draft import Draft

FloatArray = NDArray[np.float64]
AnyPattern = Annotated[WeavePattern, instance(WeavePattern)]
AnyYarns = Annotated[Yarns, one_or_each]
Spacing = Annotated[float | FloatArray, number_or_array(POSITIVE)]
Colors = Annotated[FloatArray | None, optional(array((None, 3), UNIT))]
Stiffness = Annotated[float, number(POSITIVE)]
Heights = Annotated[Relaxed | None, optional(instance(Relaxed))]

_threads = optional(integer(1, 1024))

# Yarns that are left less than this part of their width, or spacing, are hardly what was meant.
NARROW = 0.5


@dataclass(frozen=True, eq=False, repr=False)
class Fabric(Saved):
    """A woven fabric, one repeat of which fills the plane.

    The cloth lies in the plane z = 0 with its face towards +z. Ends (warp yarns) run along y, the
    first at the left; picks (weft yarns) run along x, the first at the top.

    Parameters
    ----------
    pattern
        Which yarn is on the face at each crossing, picks x ends.
    warp, weft
        The yarn of all ends and that of all picks; or a sequence of yarns, one per end, or one per
        pick from the top. They may differ in all they have.
    warp_spacing_mm
        Distance between neighbouring ends in millimetres, greater than 0: one number, or an
        array of one per end, the width that the end takes up in the repeat.
    weft_spacing_mm
        The same between picks.
    warp_colors
        Factors in linear RGB, ends x 3, in [0, 1], on each end's base_color, transmitted_color
        and transmission_tint, or on its reflectance if the yarn is diffuse. None: all 1.
    weft_colors
        The same for the picks, picks x 3.
    collision_stiffness
        k_c of Eq. 3, greater than 0. The default presses yarns into each other by less than 1e-3
        of their thickness; 1 is the paper's, with which they give way by some per cent.
    heights
        The yarns' heights, if they are known, as `relaxed` returns them for this pattern and these
        spacings. They are taken as they are, whatever the yarns. None: those of least energy.

    Raises
    ------
    ParameterError
        If a value lies outside its range, an array has not one row per yarn, a spacing is less
        than 1/256 of the mean, heights are of another pattern or of other spacings, a yarn is so
        wide that at the mean spacing it would reach past the centre line of its second neighbour,
        or its pitch is less than an eighth of a crossing.
    TypeError
        If a value is not of the kind named.
    """

    pattern: AnyPattern
    warp: AnyYarns
    weft: AnyYarns
    warp_spacing_mm: Spacing
    weft_spacing_mm: Spacing
    warp_colors: Colors = None
    weft_colors: Colors = None
    collision_stiffness: Stiffness = 100.0
    heights: Heights = None

    if TYPE_CHECKING:

        def __init__(
            self,
            pattern: WeavePattern,
            warp: Yarns,
            weft: Yarns,
            warp_spacing_mm: NumberOrNumbers,
            weft_spacing_mm: NumberOrNumbers,
            warp_colors: ArrayLike | None = ...,
            weft_colors: ArrayLike | None = ...,
            collision_stiffness: float = ...,
            heights: Relaxed | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count("warp_spacing_mm", self.warp_spacing_mm, "ends", self.pattern.ends)
        check_count("weft_spacing_mm", self.weft_spacing_mm, "picks", self.pattern.picks)
        check_count("warp_colors", self.warp_colors, "ends", self.pattern.ends)
        check_count("weft_colors", self.weft_colors, "picks", self.pattern.picks)
        check_count("warp", self.warp, "ends", self.pattern.ends)
        check_count("weft", self.weft, "picks", self.pattern.picks)
        check_yarns("warp", self.warp, self.warp_spacing_mm, self.weft_spacing_mm)
        check_yarns("weft", self.weft, self.weft_spacing_mm, self.warp_spacing_mm)
        if self.heights is not None:
            spacings = self.end_spacing / self.unit_mm, self.pick_spacing / self.unit_mm
            check_heights(self.heights, self.pattern, spacings)

    @classmethod
    def from_draft(
        cls,
        draft: Draft,
        warp: Yarns | None = None,
        weft: Yarns | None = None,
        *,
        progress: Progress = None,
    ) -> Self:
        """Make the fabric that a draft describes.

        Parameters
        ----------
        draft
            Gives the pattern, the spacings and, decoded to linear light, the colours.
        warp, weft
            The yarns. None: three-ply yarns, each as thick as the draft says of its thread,
            pressed and if need be narrowed as `fitted` does it, and whose plies are as white as
            bleached cotton where the draft is white. Yarns that are given stay as they are.
        progress
            As for `fitted`.

        Raises
        ------
        ParameterError
            If yarns that are given are too thick for the draft's spacings.
        """
        from plycloth.draft import Draft

        if not isinstance(draft, Draft):
            raise TypeError(f"draft must be a Draft, not {type(draft).__name__}")
        fabric = cls(
            pattern=draft.pattern,
            warp=draft_yarns(draft.warp_thickness, draft.warp_spacing) if warp is None else warp,
            weft=draft_yarns(draft.weft_thickness, draft.weft_spacing) if weft is None else weft,
            warp_spacing_mm=_number_if_even(draft.warp_spacing),
            weft_spacing_mm=_number_if_even(draft.weft_spacing),
            warp_colors=decode(draft.warp_colors),
            weft_colors=decode(draft.weft_colors),
        )
        if warp is not None and weft is not None:
            return fabric
        fitted = fabric.fitted(progress=progress)
        return replace(
            fitted,
            warp=fitted.warp if warp is None else warp,
            weft=fitted.weft if weft is None else weft,
        )

    @classmethod
    def of_sett(
        cls,
        pattern: WeavePattern,
        warp: Yarns,
        weft: Yarns,
        *,
        ends: NumberOrNumbers,
        picks: NumberOrNumbers,
        per: str,
        warp_colors: ArrayLike | None = None,
        weft_colors: ArrayLike | None = None,
    ) -> Self:
        """Make a fabric of so many ends and picks per length.

        Parameters
        ----------
        pattern, warp, weft, warp_colors, weft_colors
            As for the class.
        ends, picks
            How many there are per length, greater than 0: one number, or an array of one per end
            or pick, for those that lie closer or wider than others.
        per
            "inch" or "cm".

        Raises
        ------
        ParameterError, TypeError
            As for the class.
        """
        end_spacing = spacing_mm(number_or_array(POSITIVE)("ends", ends), per)
        pick_spacing = spacing_mm(number_or_array(POSITIVE)("picks", picks), per)
        return cls(pattern, warp, weft, end_spacing, pick_spacing, warp_colors, weft_colors)

    def overlaps(self, *, threads: int | None = None) -> Overlaps:
        """Find where yarns overlap: relaxation keeps them apart at the crossings' centres alone.

        Takes a relaxation, if the fabric was not relaxed before, and time linear in the number of
        crossings. Depths are right to first order in the depth.

        Parameters
        ----------
        threads
            Threads to use; None: one per processor.
        """
        threads = _threads("threads", threads)
        depth_mm = relaxed_cloth(self, threads, progress=False).overlaps(threads)
        thinnest = min(yarn.thickness for yarn in (*self.warp_kinds, *self.weft_kinds))
        return Overlaps(self.pattern, depth_mm, thinnest)

    def fitted(self, *, progress: Progress = None) -> Self:
        """Return the fabric with yarns that do not overlap by more than 2% of their thickness.

        Yarns that overlap are pressed oval: as wide as they were, but no wider than their
        neighbours leave room for (of two that would meet, both are narrowed by one factor, and with
        them all yarns that are alike), and as round as fits, down to a third of the width. Where
        that is not enough all yarns are narrowed by one factor. At a crossing pressed yarns keep
        half of the distance of the round ones (`collision_radius_mm`), since wide yarns
        that touch there cut into each other beside it. Ribbons keep their width as far as it does
        not exceed the distance between neighbours; of ribbons and round yarns side by side both are
        narrowed where no narrowing of the round ones helps. Plies, pitch and BSDF stay. The time is
        that of one relaxation, up to two short ones, and some tests of all crossings. Heights that
        were given are dropped if a yarn changes.

        Parameters
        ----------
        progress
            None: a bar where a person watches, after half a second; False: none; or a callable of
            (done, None), since it is not known before how many relaxations it takes.

        Warns
        -----
        OverlapWarning
            If yarns are narrowed to less than half of their width and of their spacing, or if no
            size helps, so that they stay as they are.
        """
        with relaxing(progress, total=None) as report:
            warp, weft, clear = _plycloth.fitted(self, progress=report)
        if not clear:
            message = "yarns pass through each other however small they are: they stay as they are"
            warnings.warn(OverlapWarning(message), stacklevel=2)
        left = min(
            _part_left(self.warp_kinds, self.warp_spacing_mm, warp),
            _part_left(self.weft_kinds, self.weft_spacing_mm, weft),
        )
        if left < NARROW:
            message = f"yarns had to be narrowed, to {left:.1%} of the room that they had"
            warnings.warn(OverlapWarning(message), stacklevel=2)
        new_warp = refit(self.warp, self.warp_kinds, self.end_kind, warp)
        new_weft = refit(self.weft, self.weft_kinds, self.pick_kind, weft)
        if (new_warp, new_weft) == (self.warp, self.weft):
            return self
        return replace(self, warp=new_warp, weft=new_weft, heights=None)

    def turned_over(self) -> Self:
        """Return the same cloth with its back to the viewer, turned about the warp direction.

        What was on the left is on the right then, and ends that were on the face are on the back.
        """
        return replace(
            self,
            pattern=self.pattern.flipped(),
            warp=_reversed(self.warp),
            warp_spacing_mm=_reversed(self.warp_spacing_mm),
            warp_colors=_reversed(self.warp_colors),
            heights=None if self.heights is None else self.heights.turned_over(),
        )

    def relaxed(self, *, progress: Progress = None) -> Relaxed:
        """Return the yarns' heights of least energy (section 3.1), or those that are given.

        Lengths are in units of weave space, `unit_mm` millimetres each. A fabric is relaxed once;
        others that differ from it in optics and colours alone share its heights while it lives. To
        save them with the fabric, give them to it: ``replace(fabric, heights=fabric.relaxed())``.

        Parameters
        ----------
        progress
            None: a bar where a person watches, after half a second; False: none; or a callable of
            (done, total).
        """
        if self.heights is not None:
            return self.heights
        cloth = relaxed_cloth(self, progress=progress)
        energy, gradient_norm, iterations, warp, weft = cloth.heights()
        spacing = self.end_spacing / self.unit_mm, self.pick_spacing / self.unit_mm
        return Relaxed(energy, gradient_norm, iterations, *warp, *weft, *spacing)

    @property
    def warp_kinds(self) -> tuple[Yarn, ...]:
        """The different yarns of the ends, in the order of their first ends.

        They are as they are rendered: a round yarn that leaves its pitch open has one of at least
        an eighth of the picks' spacing.
        """
        kinds = kinds_of(self.warp, self.pattern.ends)[0]
        return tuple(with_pitch(yarn, self.weft_spacing_mm) for yarn in kinds)

    @property
    def weft_kinds(self) -> tuple[Yarn, ...]:
        """The same of the picks."""
        kinds = kinds_of(self.weft, self.pattern.picks)[0]
        return tuple(with_pitch(yarn, self.warp_spacing_mm) for yarn in kinds)

    @property
    def end_kind(self) -> NDArray[np.uint32]:
        """Which of `warp_kinds` each end is, one number per end."""
        return kinds_of(self.warp, self.pattern.ends)[1]

    @property
    def pick_kind(self) -> NDArray[np.uint32]:
        """Which of `weft_kinds` each pick is, one number per pick."""
        return kinds_of(self.weft, self.pattern.picks)[1]

    @property
    def end_spacing(self) -> FloatArray:
        """Width that each end takes up in millimetres, one per end."""
        return _per_yarn(self.warp_spacing_mm, self.pattern.ends)

    @property
    def pick_spacing(self) -> FloatArray:
        """Height that each pick takes up in millimetres, one per pick."""
        return _per_yarn(self.weft_spacing_mm, self.pattern.picks)

    @property
    def repeat_mm(self) -> tuple[float, float]:
        """Width and height of one repeat of the pattern in millimetres."""
        return float(self.end_spacing.sum()), float(self.pick_spacing.sum())

    @property
    def unit_mm(self) -> float:
        """Length of one unit of weave space in millimetres.

        The yarns' spacing, averaged over warp and weft. The energy of section 3.1 is not free of
        scale, so a fabric is relaxed where its spacing is 1, whatever it is in millimetres.
        """
        return 0.5 * float(np.mean(self.warp_spacing_mm) + np.mean(self.weft_spacing_mm))


def _reversed(values: Any) -> Any:
    """Return the values of yarns in the opposite order, or the one that stands for all."""
    return values[::-1] if isinstance(values, np.ndarray | tuple) else values


def _per_yarn(spacing: float | FloatArray, count: int) -> FloatArray:
    return np.broadcast_to(np.asarray(spacing, np.float64), (count,))


def _part_left(
    kinds: Sequence[Yarn],
    spacing: float | FloatArray,
    measures: Sequence[tuple[float, float, float]],
) -> float:
    """Return what is left of the yarns' width, or of their spacing if that is less: the least."""
    room = 0.5 * float(np.mean(spacing))
    return min(
        new[0] / min(kind.half_width, room) for kind, new in zip(kinds, measures, strict=True)
    )


def _number_if_even(spacing: FloatArray) -> float | FloatArray:
    return float(spacing[0]) if np.ptp(spacing) == 0.0 else spacing
