"""What a photograph leaves open about a cloth's geometry, and where to look for it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from plycloth.bsdf import PlyBsdf
from plycloth.fabric import Fabric
from plycloth.weave import WeavePattern
from plycloth.yarn import FlatYarn, RoundYarn, Yarn

FloatArray = NDArray[np.float64]

COVER_FACTORS = (0.7, 1.3)
"""How much narrower and wider a yarn is tried."""

LARGEST_COVER = 1.25

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

    def depth(self, spacing_mm: float) -> float:
        """Return the length of a way straight through the yarn, in millimetres."""
        return (THICKNESS if self.flat else 1.0) * self.cover * spacing_mm

    def variations(self, *, cross_sections: bool) -> list[YarnGuess]:
        """List yarns a little narrower and wider, and, if wanted, of the other cross section."""
        covers = [factor * self.cover for factor in COVER_FACTORS]
        others = [replace(self, cover=cover) for cover in covers if cover <= LARGEST_COVER]
        return [*others, replace(self, flat=not self.flat)] if cross_sections else others

    def __str__(self) -> str:
        return f"{'flat' if self.flat else 'round'} {self.cover:.2g}"


@dataclass(frozen=True)
class Geometry:
    """A guess at a cloth: its weave, its yarns and how far apart they lie."""

    name: str
    pattern: WeavePattern
    warp: YarnGuess
    weft: YarnGuess
    warp_spacing_mm: float
    weft_spacing_mm: float

    def fabric(self, bsdfs: tuple[PlyBsdf, PlyBsdf]) -> Fabric:
        """Return the fabric with BSDFs for warp and weft."""
        return Fabric(
            pattern=self.pattern,
            warp=self.warp.yarn(self.warp_spacing_mm, bsdfs[0]),
            weft=self.weft.yarn(self.weft_spacing_mm, bsdfs[1]),
            warp_spacing_mm=self.warp_spacing_mm,
            weft_spacing_mm=self.weft_spacing_mm,
        )

    def start(self, color: FloatArray) -> tuple[PlyBsdf, PlyBsdf]:
        """Return BSDFs to start a fit from: of the hue of `color`, neither clear nor opaque."""
        depths = (self.warp.depth(self.warp_spacing_mm), self.weft.depth(self.weft_spacing_mm))
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
            for depth in depths
        )
        return warp, weft

    def bounds(self) -> dict[str, tuple[float, float]]:
        """Return the ranges to look in: from almost clear to opaque, and any surface."""
        depths = (self.warp.depth(self.warp_spacing_mm), self.weft.depth(self.weft_spacing_mm))
        return {
            "extinction": (0.02 / max(depths), 50.0 / min(depths)),
            "roughness": (0.05, 1.0),
            "exit_roughness": (0.05, 1.0),
            "eta": (1.05, 3.0),
        }

    def variations(self, *, cross_sections: bool) -> list[Geometry]:
        """List the geometry with one of its yarns varied."""
        warps, wefts = (
            yarn.variations(cross_sections=cross_sections) for yarn in (self.warp, self.weft)
        )
        return [
            replace(self, warp=warp, weft=weft)
            for warp, weft in (
                *((other, self.weft) for other in warps),
                *((self.warp, other) for other in wefts),
            )
        ]

    def __str__(self) -> str:
        return f"{self.name}, warp {self.warp}, weft {self.weft}"


def faced(name: str, pattern: WeavePattern) -> list[tuple[str, WeavePattern]]:
    """Return a weave both ways round: mostly warp on the face, and mostly weft."""
    reverse = WeavePattern(~pattern.warp_up)
    if pattern.warp_up.mean() == 0.5:
        return [(name, pattern)]
    return [(f"{name}, warp-faced", pattern), (f"{name}, weft-faced", reverse)]


def weaves(repeat: int | None) -> list[tuple[str, WeavePattern]]:
    """Return the common weaves with a repeat of so many threads; None: one of each kind."""
    if repeat == 2:
        return [("plain", WeavePattern.plain())]
    if repeat == 3:
        return faced("2/1 twill", WeavePattern.twill(2, 1))
    if repeat == 4:
        return [
            *faced("3/1 twill", WeavePattern.twill(3, 1)),
            ("2/2 twill", WeavePattern.twill(2, 2)),
        ]
    if repeat is not None and repeat >= 5 and repeat != 6:
        step = next(s for s in range(2, repeat - 1) if np.gcd(s, repeat) == 1)
        return faced(f"{repeat}-end satin", WeavePattern.satin(repeat, step))
    return [
        ("plain", WeavePattern.plain()),
        ("2/2 twill", WeavePattern.twill(2, 2)),
        *faced("5-end satin", WeavePattern.satin(5, 2)),
    ]


YARNS = (
    (YarnGuess(True, 0.9), YarnGuess(True, 0.9)),
    (YarnGuess(False, 0.4), YarnGuess(True, 0.9)),
    (YarnGuess(True, 0.9), YarnGuess(False, 0.4)),
    (YarnGuess(False, 0.9), YarnGuess(False, 0.9)),
)
"""Pairs of warp and weft that look different: ribbons, ribbons held by thin threads, rods."""
