"""Yarns: what a thread of the cloth is made of and how it looks."""

import math
from dataclasses import dataclass
from typing import Annotated

from plycloth._check import FINITE, POSITIVE, ParameterError, instance, integer, number, optional
from plycloth._value import Description
from plycloth.bsdf import Bsdf, DiffuseBsdf, PlyBsdf

Length = Annotated[float, number(POSITIVE)]
OptionalLength = Annotated[float | None, optional(number(POSITIVE))]
Stiffness = Annotated[float, number(POSITIVE)]
AnyBsdf = Annotated[Bsdf, instance(PlyBsdf, DiffuseBsdf)]

MAX_PLIES = 12


@dataclass(frozen=True, eq=False, repr=False)
class RoundYarn(Description):
    """A yarn of round plies twisted about its centre line.

    Parameters
    ----------
    radius_mm
        R, the radius of the circle around all plies, in millimetres, greater than 0.
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
        Radius of one ply in millimetres, greater than 0. None: as large as fits, which is also
        the upper bound; see `ply_radius`.
    stiffness
        k of Eq. 2, relative to other yarns, greater than 0.

    Raises
    ------
    ParameterError
        If a value lies outside its range, or the plies do not fit side by side in the yarn.
    TypeError
        If a value is not of the kind named.
    """

    radius_mm: Length
    bsdf: AnyBsdf
    plies: Annotated[int, integer(1, MAX_PLIES)] = 3
    pitch_mm: Annotated[float | None, optional(number(FINITE))] = None
    ply_radius_mm: OptionalLength = None
    stiffness: Stiffness = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.pitch_mm == 0.0:
            raise ParameterError("RoundYarn.pitch_mm must not be 0; None stands for 8 radii")
        largest = _touching_ply_radius(self.radius_mm, self.plies)
        # A ratio of the given radius to this one is rounded: 1 in 1e9 is still a touch.
        if self.ply_radius > largest * (1.0 + 1e-9):
            raise ParameterError(
                f"RoundYarn.ply_radius_mm must be at most {largest:g} for {self.plies} plies side"
                f" by side in a radius of {self.radius_mm:g}, not {self.ply_radius:g}"
            )

    @property
    def pitch(self) -> float:
        """Pitch in millimetres: `pitch_mm`, or 8 radii if that is None."""
        return 8.0 * self.radius_mm if self.pitch_mm is None else self.pitch_mm

    @property
    def ply_radius(self) -> float:
        """Radius of one ply in millimetres: `ply_radius_mm`, or the largest if that is None.

        The centres of n plies stand at the corners of a regular n-gon of circumradius R - r, and
        neighbours touch where half a side, (R - r) sin(pi/n), equals r. So the largest is
        r = R sin(pi/n) / (1 + sin(pi/n)) for n >= 2. A single ply is the yarn: r = R.
        """
        if self.ply_radius_mm is None:
            return _touching_ply_radius(self.radius_mm, self.plies)
        return self.ply_radius_mm

    @property
    def helix_radius(self) -> float:
        """Distance R - r of the ply centres from the yarn's centre line, in millimetres.

        A single ply runs along the centre line, whatever its radius: 0.
        """
        return 0.0 if self.plies == 1 else self.radius_mm - self.ply_radius

    @property
    def half_width(self) -> float:
        """Half the yarn's extent in the plane of the cloth, in millimetres."""
        return self.radius_mm

    @property
    def collision_radius(self) -> float:
        """Half the yarn's extent across the cloth, R_A of Eq. 3, in millimetres."""
        return self.radius_mm


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


def _touching_ply_radius(radius: float, plies: int) -> float:
    if plies == 1:
        return radius
    sine = math.sin(math.pi / plies)
    return radius * sine / (1.0 + sine)
