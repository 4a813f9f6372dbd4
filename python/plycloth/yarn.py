"""Yarns: what a thread of the cloth is made of and how it looks."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Self

from plycloth._check import FINITE, POSITIVE, ParameterError, instance, integer, number, optional
from plycloth._value import Description
from plycloth.bsdf import Bsdf, DiffuseBsdf, PlyBsdf
from plycloth.trade import PACKING, YarnSize, area_mm2, diameter_mm

MAX_PLIES = 12

Length = Annotated[float, number(POSITIVE)]
OptionalLength = Annotated[float | None, optional(number(POSITIVE))]
Stiffness = Annotated[float, number(POSITIVE)]
Plies = Annotated[int, integer(1, MAX_PLIES)]
Pitch = Annotated[float | None, optional(number(FINITE))]
AnyBsdf = Annotated[Bsdf, instance(PlyBsdf, DiffuseBsdf)]

# A ratio to a bound is rounded: one part in 1e9 above it is still within.
ROUNDING = 1e-9

BISECTIONS = 52


@dataclass(frozen=True, eq=False, repr=False)
class RoundYarn(Description):
    """A yarn of round plies twisted about its centre line, which may be pressed flat.

    A pressed yarn is a round one of radius thickness / 2 stretched along its width: its cross
    section is an ellipse, and so are those of its plies.

    Parameters
    ----------
    radius_mm
        R, the radius of the circle around all plies (half the width of the ellipse, if the yarn is
        pressed), in millimetres, greater than 0.
    bsdf
        How each ply scatters light.
    plies
        Number of plies, 1 to 12.
    pitch_mm
        Length along the yarn of one full turn of the plies, in millimetres, not 0. Positive is
        a right-handed helix (Z twist: counter-clockwise towards who looks against the yarn's
        direction), negative a left-handed one (S twist). None: 8 radii. A swatch rounds it by at
        most 2% (docs/conventions.md has the limits), so that its pieces repeat.
    ply_radius_mm
        Radius of one ply (along the yarn's width) in millimetres, greater than 0 and at most the
        `ply_radius` of the same yarn without twist. None: as large as the twist allows; see
        `ply_radius`.
    stiffness
        k of Eq. 2, relative to other yarns, greater than 0.
    thickness_mm
        Height of the pressed cross section in millimetres, greater than 0 and at most twice
        `radius_mm`. None: round, twice `radius_mm`.
    collision_radius_mm
        R_A of Eq. 3: how far from those that it crosses the yarn keeps at a crossing, together
        with their own, in millimetres, greater than 0. None: half the thickness. Yarns that are
        wide for their spacing must keep some distance at the crossing, so as not to cut into each
        other beside it.

    Raises
    ------
    ParameterError
        If a value lies outside its range, the plies do not fit side by side in the yarn, or the
        yarn is higher than wide.
    TypeError
        If a value is not of the kind named.
    """

    radius_mm: Length
    bsdf: AnyBsdf
    plies: Plies = 3
    pitch_mm: Pitch = None
    ply_radius_mm: OptionalLength = None
    stiffness: Stiffness = 1.0
    thickness_mm: OptionalLength = None
    collision_radius_mm: OptionalLength = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.thickness > 2.0 * self.radius_mm * (1.0 + ROUNDING):
            raise ParameterError(
                f"RoundYarn.thickness_mm must be at most twice the radius,"
                f" {2.0 * self.radius_mm:g}, not {self.thickness:g}"
            )
        if self.pitch_mm == 0.0:
            raise ParameterError("RoundYarn.pitch_mm must not be 0; None stands for 8 radii")
        largest = _straight_ply_radius(self.radius_mm, self.plies)
        if self.ply_radius > largest * (1.0 + ROUNDING):
            raise ParameterError(
                f"RoundYarn.ply_radius_mm must be at most {largest:g} for {self.plies} plies side"
                f" by side in a radius of {self.radius_mm:g}, not {self.ply_radius:g}"
            )

    @classmethod
    def of_size(
        cls, size: str, bsdf: Bsdf, *, material: str | float, packing: float = PACKING
    ) -> Self:
        """Make the yarn of a size as the trade has it.

        Each single is a ply, as thick as its weight says (`trade.diameter_mm`); they touch, with a
        pitch of 8 radii. `dataclasses.replace` gives it another pitch, or presses it.

        Parameters
        ----------
        size
            Such as "20 tex", "20 tex x 2", "150 denier", "30/2 Ne" or "2/28 Nm"
            (`trade.YarnSize.parse`).
        bsdf
            How each ply scatters light.
        material
            Its fibers: one of `trade.DENSITIES`, such as "cotton", or a density in g/cm3.
        packing
            Part of each ply's volume that is fiber, in [0.01, 1].

        Raises
        ------
        ParameterError
            If the size cannot be read, a value lies outside its range, there is no such material,
            or more than 12 yarns are folded.
        TypeError
            If a value is not of the kind named.
        """
        known = YarnSize.parse(size)
        plies = integer(1, MAX_PLIES)("the plies of a yarn", known.plies)
        ply_radius = 0.5 * float(diameter_mm(known.single_tex, material, packing))
        # At the default pitch the plies of all radii are alike.
        return cls(ply_radius / cls(1.0, bsdf, plies).ply_radius, bsdf, plies)

    @property
    def pitch(self) -> float:
        """Pitch in millimetres: `pitch_mm`, or 8 radii if that is None."""
        return 8.0 * self.radius_mm if self.pitch_mm is None else self.pitch_mm

    @property
    def ply_radius(self) -> float:
        """Radius of one ply in millimetres: `ply_radius_mm`, or the touching one if that is None.

        The centres of n plies run along helices of radius R - r. They touch where the least
        distance between neighbouring helices equals 2 r; twisted plies come closer to each other
        than their cross section shows. Without twist half a side of the regular n-gon of centres,
        (R - r) sin(pi/n), equals r, so that r = R sin(pi/n) / (1 + sin(pi/n)) for n >= 2. A single
        ply is the yarn: r = R. Plies of a pressed yarn touch where those of the round one do of
        which it is a stretched copy.
        """
        if self.ply_radius_mm is None:
            # Stretched by a ratio, the only ply could round to more than the yarn.
            if self.plies == 1:
                return self.radius_mm
            round_radius = 0.5 * self.thickness
            touching = _touching_ply_radius(round_radius, self.plies, abs(self.pitch))
            return self.radius_mm / round_radius * touching
        return self.ply_radius_mm

    @property
    def thickness(self) -> float:
        """Height of the cross section in millimetres: `thickness_mm`, or 2 R if that is None."""
        return 2.0 * self.radius_mm if self.thickness_mm is None else self.thickness_mm

    @property
    def helix_radius(self) -> float:
        """Distance R - r of the ply centres from the yarn's centre line, along its width, in mm.

        A single ply runs along the centre line, whatever its radius: 0.
        """
        return 0.0 if self.plies == 1 else self.radius_mm - self.ply_radius

    @property
    def half_width(self) -> float:
        """Half the yarn's extent in the plane of the cloth, in millimetres."""
        return self.radius_mm

    @property
    def collision_radius(self) -> float:
        """R_A of Eq. 3 in millimetres: that given, or half the thickness."""
        return self.collision_radius_mm or 0.5 * self.thickness


@dataclass(frozen=True, eq=False, repr=False)
class FlatYarn(Description):
    """A ribbon-like yarn, such as a bundle of untwisted filaments.

    Parameters
    ----------
    width_mm
        Width of the ribbon in millimetres, greater than 0.
    bsdf
        How the ribbon scatters light; x and y are the same point (section 4.3).
    thickness_mm
        Virtual thickness h of Eq. 15 and twice the collision radius, in millimetres, greater
        than 0. None: a tenth of the width.
    stiffness
        k of Eq. 2, relative to other yarns, greater than 0.

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not of the kind named.
    """

    width_mm: Length
    bsdf: AnyBsdf
    thickness_mm: OptionalLength = None
    stiffness: Stiffness = 1.0

    @classmethod
    def of_size(
        cls, size: str, bsdf: Bsdf, *, material: str | float, packing: float = PACKING
    ) -> Self:
        """Make the ribbon of a size as the trade has it, a tenth as thick as it is wide.

        The parameters and errors are those of `RoundYarn.of_size`; folded singles are one bundle.
        """
        area = float(area_mm2(YarnSize.parse(size).tex, material, packing))
        thin = cls(1.0, bsdf).thickness
        return cls(math.sqrt(area / thin), bsdf)

    @property
    def thickness(self) -> float:
        """Thickness in millimetres: `thickness_mm`, or a tenth of the width if that is None."""
        return 0.1 * self.width_mm if self.thickness_mm is None else self.thickness_mm

    @property
    def half_width(self) -> float:
        """Half the yarn's extent in the plane of the cloth, in millimetres."""
        return 0.5 * self.width_mm

    @property
    def collision_radius(self) -> float:
        """Half the yarn's extent across the cloth, R_A of Eq. 3, in millimetres."""
        return 0.5 * self.thickness


Yarn = RoundYarn | FlatYarn


def _straight_ply_radius(radius: float, plies: int) -> float:
    """Return the radius of parallel plies that touch."""
    if plies == 1:
        return radius
    sine = math.sin(math.pi / plies)
    return radius * sine / (1.0 + sine)


@lru_cache(maxsize=1024)
def _touching_ply_radius(radius: float, plies: int, pitch: float) -> float:
    """Return the radius of twisted plies that touch."""
    straight = _straight_ply_radius(radius, plies)
    if plies == 1:
        return straight
    phase, rise = 2.0 * math.pi / plies, pitch / (2.0 * math.pi)

    def clear(ply_radius: float) -> bool:
        return _helix_distance(radius - ply_radius, phase, rise) >= 2.0 * ply_radius

    # Straight plies touch up to rounding, and they are the limit of a long pitch.
    return straight if clear(straight * (1.0 - ROUNDING)) else _last(clear, straight)


def _helix_distance(radius: float, phase: float, rise: float) -> float:
    """Return the least distance between two helices of a radius, turned by `phase`, up to pi.

    They rise by `rise` a radian. The squared distance from a point of one to the point of the
    other that stands at an angle a to it is 2 R^2 (1 - cos a) + rise^2 (a - phase)^2. Half its
    derivative, R^2 sin a - rise^2 (phase - a), is concave over [0, phase], negative at 0 and not
    at the end: its first zero is the minimum.
    """

    def falls(angle: float) -> bool:
        return radius**2 * math.sin(angle) < rise**2 * (phase - angle)

    angle = _last(falls, phase)
    return math.hypot(2.0 * radius * math.sin(0.5 * angle), rise * (phase - angle))


def _last(holds: Callable[[float], bool], end: float) -> float:
    """Return the last place in [0, `end`] where something holds that does so from 0 to there."""
    low, high = 0.0, end
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low
