"""What a photograph leaves open about a cloth's geometry, and where to look for it."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from plycloth.bsdf import PlyBsdf
from plycloth.fabric import Fabric
from plycloth.overlap import WORTH_A_WARNING, OverlapWarning
from plycloth.shared_cloth import relaxed_cloth
from plycloth.weave import WeavePattern
from plycloth.yarn import FlatYarn, RoundYarn, Yarn
from plycloth.yarn_set import with_each

FloatArray = NDArray[np.float64]

COVER_FACTORS = (0.7, 1.3)
"""How much narrower and wider a yarn is tried."""

COVERS = (0.5, 0.95)
"""How narrow and how wide yarns are over their spacing, unless a user says otherwise: of those that
fill the room that their neighbours leave, down to half of it."""

ROUNDING = 1e-9

THICKNESS = 0.1
"""Thickness of a flat yarn over its width: only its product with the extinction shows."""


@dataclass(frozen=True)
class YarnGuess:
    """The cross section of a yarn: flat or round, and its width over its spacing."""

    flat: bool
    cover: float

    def yarn(self, spacing_mm: float, bsdf: PlyBsdf) -> Yarn:
        """Return the yarn for a spacing."""
        width = self.cover * spacing_mm
        if self.flat:
            return FlatYarn(width_mm=width, bsdf=bsdf, thickness_mm=THICKNESS * width)
        return RoundYarn(radius_mm=0.5 * width, bsdf=bsdf, plies=1)

    def within(self, covers: tuple[float, float]) -> YarnGuess:
        """Return the yarn as near to this one as is within a range of widths over spacing."""
        return replace(self, cover=min(max(self.cover, covers[0]), covers[1]))

    def variations(self, covers: tuple[float, float], *, cross_sections: bool) -> list[YarnGuess]:
        """List yarns a little narrower and wider, and, if wanted, of the other cross section."""
        tried = [replace(self, cover=factor * self.cover) for factor in COVER_FACTORS]
        others = [other for each in tried if (other := each.within(covers)) != self]
        return [*others, replace(self, flat=not self.flat)] if cross_sections else others

    def __str__(self) -> str:
        return f"{'flat' if self.flat else 'round'} {self.cover:.2g}"


@dataclass(frozen=True)
class Geometry:
    """A guess at a cloth: its weave, its yarns and how far apart they lie, in millimetres.

    Round yarns are pressed, and where that is not enough all are narrowed, until none pass through
    each other, as `Fabric.fitted` does it.
    """

    name: str
    pattern: WeavePattern
    warp: YarnGuess
    weft: YarnGuess
    warp_spacing_mm: float
    weft_spacing_mm: float

    def fabric(self, bsdfs: tuple[PlyBsdf, PlyBsdf]) -> Fabric:
        """Return the fabric with BSDFs for warp and weft."""
        shape = self._shape
        # Relaxed here, it stays so for all fabrics of this geometry.
        relaxed_cloth(shape, progress=False)
        return replace(
            shape,
            warp=with_each(shape.warp, lambda yarn: replace(yarn, bsdf=bsdfs[0])),
            weft=with_each(shape.weft, lambda yarn: replace(yarn, bsdf=bsdfs[1])),
        )

    @cached_property
    def _shape(self) -> Fabric:
        """The fabric, whatever it is made of."""
        fabric = Fabric(
            pattern=self.pattern,
            warp=self.warp.yarn(self.warp_spacing_mm, PlyBsdf()),
            weft=self.weft.yarn(self.weft_spacing_mm, PlyBsdf()),
            warp_spacing_mm=self.warp_spacing_mm,
            weft_spacing_mm=self.weft_spacing_mm,
        )
        with warnings.catch_warnings():
            # Guesses without room are left out, see `has_room`.
            warnings.simplefilter("ignore", OverlapWarning)
            return fabric.fitted(progress=False)

    @property
    def covers(self) -> tuple[float, float]:
        """Widths of warp and weft over their spacing, as far as there is room for the guesses."""
        (warp,), (weft,) = self._shape.warp_kinds, self._shape.weft_kinds
        return (
            2.0 * warp.half_width / self.warp_spacing_mm,
            2.0 * weft.half_width / self.weft_spacing_mm,
        )

    def has_room(self, least_cover: float) -> bool:
        """Tell whether its yarns fit side by side and across, and are still so wide.

        A wide round yarn finds no room among ribbons that cross it closely, and ribbons find none
        where neighbours lie at heights that differ.
        """
        if min(self.covers) < least_cover * (1.0 - ROUNDING):
            return False
        return self._shape.overlaps().worst < WORTH_A_WARNING

    @property
    def depths(self) -> tuple[float, float]:
        """Length of a way straight through warp and weft, in millimetres."""
        (warp,), (weft,) = self._shape.warp_kinds, self._shape.weft_kinds
        return warp.thickness, weft.thickness

    def start(self, color: FloatArray) -> tuple[PlyBsdf, PlyBsdf]:
        """Return BSDFs to start a fit from: of the hue of `color`, neither clear nor opaque."""
        red, green, blue = (float(c) for c in 0.4 * color / color.max())
        warp, weft = (
            PlyBsdf(
                eta=1.6,
                base_color=(red, green, blue),
                transmitted_color=(red, green, blue),
                extinction=1.0 / depth,
                roughness=(0.25, 0.6),
                exit_roughness=(0.3, 0.8),
            )
            for depth in self.depths
        )
        return warp, weft

    def bounds(self) -> dict[str, tuple[float, float]]:
        """Return the ranges to look in: from almost clear to opaque, and any surface."""
        return {
            "extinction": (0.02 / max(self.depths), 50.0 / min(self.depths)),
            "roughness": (0.05, 1.0),
            "exit_roughness": (0.05, 1.0),
            "eta": (1.05, 3.0),
        }

    def variations(self, covers: tuple[float, float], *, cross_sections: bool) -> list[Geometry]:
        """List the geometry with one of its yarns varied, within a range of widths over spacing.

        Those whose yarns have no room are left out.
        """
        warps, wefts = (
            yarn.variations(covers, cross_sections=cross_sections)
            for yarn in (self.warp, self.weft)
        )
        varied = [replace(self, warp=other) for other in warps]
        varied += [replace(self, weft=other) for other in wefts]
        # A geometry that a user named may have yarns out of range: those that are not varied keep.
        least = min(covers[0], *self.covers)
        return [geometry for geometry in varied if geometry.has_room(least)]

    def __str__(self) -> str:
        return f"{self.name}, warp {self.warp}, weft {self.weft}"


YARNS = (
    (YarnGuess(True, 0.9), YarnGuess(True, 0.9)),
    (YarnGuess(False, 0.5), YarnGuess(True, 0.9)),
    (YarnGuess(True, 0.9), YarnGuess(False, 0.5)),
    (YarnGuess(False, 0.9), YarnGuess(False, 0.9)),
)
"""Pairs of warp and weft that look different: ribbons, ribbons held by thin threads, full yarns."""
