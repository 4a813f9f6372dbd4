"""Woven fabrics: a weave pattern, the yarns that follow it, and how close they lie."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth import _plycloth
from plycloth._check import (
    POSITIVE,
    UNIT,
    NumberOrNumbers,
    ParameterError,
    array,
    instance,
    number,
    number_or_array,
    optional,
)
from plycloth._color import decode
from plycloth._saved import Saved
from plycloth.bsdf import PlyBsdf
from plycloth.overlap import Overlaps
from plycloth.progress import Progress, relaxing
from plycloth.weave import WeavePattern
from plycloth.yarn import FlatYarn, RoundYarn, Yarn

if TYPE_CHECKING:
    from plycloth.draft import Draft
    from plycloth.relax import Relaxed

FloatArray = NDArray[np.float64]
AnyYarn = Annotated[Yarn, instance(RoundYarn, FlatYarn)]
AnyPattern = Annotated[WeavePattern, instance(WeavePattern)]
Spacing = Annotated[float | FloatArray, number_or_array(POSITIVE)]
Colors = Annotated[FloatArray | None, optional(array((None, 3), UNIT))]
Stiffness = Annotated[float, number(POSITIVE)]

# Half widths beyond this many mean spacings reach past the centre of the second neighbour.
MAX_HALF_WIDTH = 2.0
# A spacing below this part of the mean lets very many yarns lie on each other.
MIN_SPACING = 1.0 / 256.0

# A pitch below this part of a crossing would need very many segments.
MIN_PITCH = 0.125

# The albedo that a draft's white stands for: that of bleached cotton, not a perfect reflector.
WHITE_ALBEDO = 0.8


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
        The yarn of all ends and that of all picks.
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

    Raises
    ------
    ParameterError
        If a value lies outside its range, an array has not one row per yarn, a spacing is less
        than 1/256 of the mean, a yarn is so wide that at the mean spacing it would reach past the
        centre line of its second neighbour, or its pitch is less than an eighth of a crossing.
    TypeError
        If a value is not of the kind named.
    """

    pattern: AnyPattern
    warp: AnyYarn
    weft: AnyYarn
    warp_spacing_mm: Spacing
    weft_spacing_mm: Spacing
    warp_colors: Colors = None
    weft_colors: Colors = None
    collision_stiffness: Stiffness = 100.0

    if TYPE_CHECKING:

        def __init__(
            self,
            pattern: WeavePattern,
            warp: Yarn,
            weft: Yarn,
            warp_spacing_mm: NumberOrNumbers,
            weft_spacing_mm: NumberOrNumbers,
            warp_colors: ArrayLike | None = ...,
            weft_colors: ArrayLike | None = ...,
            collision_stiffness: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_count("warp_spacing_mm", self.warp_spacing_mm, "ends", self.pattern.ends)
        _check_count("weft_spacing_mm", self.weft_spacing_mm, "picks", self.pattern.picks)
        _check_count("warp_colors", self.warp_colors, "ends", self.pattern.ends)
        _check_count("weft_colors", self.weft_colors, "picks", self.pattern.picks)
        _check_width("warp", self.warp, self.warp_spacing_mm)
        _check_width("weft", self.weft, self.weft_spacing_mm)
        _check_pitch("warp", self.warp, self.weft_spacing_mm)
        _check_pitch("weft", self.weft, self.warp_spacing_mm)

    @classmethod
    def from_draft(
        cls,
        draft: Draft,
        warp: Yarn | None = None,
        weft: Yarn | None = None,
        *,
        progress: Progress = None,
    ) -> Self:
        """Make the fabric that a draft describes.

        Parameters
        ----------
        draft
            Gives the pattern, the spacings and, decoded to linear light, the colours.
        warp, weft
            The yarns. None: a three-ply yarn whose radius is half the median thickness that the
            draft gives, pressed and if need be narrowed as `fitted` does it, and whose plies are as
            white as bleached cotton where the draft is white. A yarn that is given stays as it is.
        progress
            As for `fitted`.

        Raises
        ------
        ParameterError
            If the draft's yarns are too thick for its spacings.
        """
        from plycloth.draft import Draft

        if not isinstance(draft, Draft):
            raise TypeError(f"draft must be a Draft, not {type(draft).__name__}")
        fabric = cls(
            pattern=draft.pattern,
            warp=warp or default_yarn(draft.warp_thickness),
            weft=weft or default_yarn(draft.weft_thickness),
            warp_spacing_mm=_number_if_even(draft.warp_spacing),
            weft_spacing_mm=_number_if_even(draft.weft_spacing),
            warp_colors=decode(draft.warp_colors),
            weft_colors=decode(draft.weft_colors),
        )
        if warp is not None and weft is not None:
            return fabric
        fitted = fabric.fitted(progress=progress)
        return replace(fitted, warp=warp or fitted.warp, weft=weft or fitted.weft)

    def overlaps(self) -> Overlaps:
        """Find where yarns overlap: relaxation keeps them apart at the crossings' centres alone.

        Takes a relaxation, and time linear in the number of crossings. Depths are right to first
        order in the depth.
        """
        return self.overlaps_of(_plycloth.overlaps(self))

    def fitted(self, *, progress: Progress = None) -> Self:
        """Return the fabric with yarns that do not overlap by more than 2% of their thickness.

        Yarns that overlap are pressed oval: as wide as they were, but no wider than half the least
        distance between neighbours on each side, and as round as fits, down to a third of the
        width. Where that is not enough all yarns are narrowed by one factor. At a crossing pressed
        yarns keep half of the distance of the round ones (`collision_radius_mm`), since wide yarns
        that touch there cut into each other beside it. Ribbons keep their width as far as it does
        not exceed the distance between neighbours. Plies, pitch and BSDF stay. The time is that
        of one relaxation, up to two short ones, and some tests of all crossings.

        Parameters
        ----------
        progress
            None: a bar where a person watches, after half a second; False: none; or a callable of
            (done, None), since it is not known before how many relaxations it takes.
        """
        with relaxing(progress, total=None) as report:
            warp, weft = _plycloth.fitted(self, progress=report)
        return replace(self, warp=_resized(self.warp, *warp), weft=_resized(self.weft, *weft))

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
        )

    def overlaps_of(self, depth_mm: FloatArray) -> Overlaps:
        """Return depths (picks x ends, in millimetres) with what they are measured by."""
        return Overlaps(self.pattern, depth_mm, min(self.warp.thickness, self.weft.thickness))

    def relaxed(self) -> Relaxed:
        """Relax the yarns' heights (section 3.1).

        Lengths in the result are in units of weave space, `unit_mm` millimetres each.
        """
        from plycloth.relax import relax

        unit = self.unit_mm
        return relax(
            self.pattern,
            warp_radius=self.warp.collision_radius / unit,
            weft_radius=self.weft.collision_radius / unit,
            warp_stiffness=self.warp.stiffness,
            weft_stiffness=self.weft.stiffness,
            collision_stiffness=self.collision_stiffness,
            warp_spacing=self.warp_spacing_mm / unit,
            weft_spacing=self.weft_spacing_mm / unit,
        )

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


def _check_count(name: str, values: float | FloatArray | None, yarns: str, count: int) -> None:
    if isinstance(values, np.ndarray) and len(values) != count:
        raise ParameterError(
            f"Fabric.{name} must have one row for each of the pattern's {count} {yarns},"
            f" not {len(values)}"
        )


def _check_width(name: str, yarn: Yarn, spacing: float | FloatArray) -> None:
    mean = float(np.mean(spacing))
    if np.min(spacing) < MIN_SPACING * mean:
        raise ParameterError(
            f"Fabric.{name}_spacing_mm must be at least 1/256 of its mean, {MIN_SPACING * mean:g},"
            f" not {np.min(spacing):g}"
        )
    if yarn.half_width > MAX_HALF_WIDTH * mean:
        raise ParameterError(
            f"Fabric.{name} must have a radius (or half width) of at most {MAX_HALF_WIDTH:g}"
            f" spacings, {MAX_HALF_WIDTH * mean:g} mm, not {yarn.half_width:g} mm:"
            " a wider yarn would pass through its second neighbours"
        )


def _check_pitch(name: str, yarn: Yarn, crossing: float | FloatArray) -> None:
    least = MIN_PITCH * float(np.mean(crossing))
    if isinstance(yarn, RoundYarn) and yarn.plies > 1 and abs(yarn.pitch) < least:
        raise ParameterError(
            f"Fabric.{name} must have a pitch of at least {MIN_PITCH:g} of the crossing yarns'"
            f" spacing, {least:g} mm, not {abs(yarn.pitch):g} mm"
        )


def default_yarn(thickness_mm: FloatArray) -> RoundYarn:
    """Return the yarn that stands for those of a draft."""
    bsdf = PlyBsdf(base_color=(WHITE_ALBEDO,) * 3, transmitted_color=(WHITE_ALBEDO,) * 3)
    return RoundYarn(radius_mm=0.5 * float(np.median(thickness_mm)), bsdf=bsdf)


def _number_if_even(spacing: FloatArray) -> float | FloatArray:
    return float(spacing[0]) if np.ptp(spacing) == 0.0 else spacing


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
