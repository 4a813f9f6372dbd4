"""Scenes: a piece of cloth, a camera and lights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Any, get_args

from plycloth._check import (
    RADIOMETRIC,
    NumberOrNumbers,
    ParameterError,
    Range,
    Rgb,
    instance,
    optional,
    pair,
    rgb,
)
from plycloth._saved import Saved
from plycloth._value import Description
from plycloth.bsdf import PlyBsdf
from plycloth.camera import Camera
from plycloth.fabric import Fabric
from plycloth.light import Emitter, Light
from plycloth.yarn_set import with_each

# How far beyond a picture cloth must go on, in yarns, for the light that enters by its cut edge not
# to be seen. A bright satin in light at 12 degrees to it is brighter by 136% at its outermost yarn,
# by 13% at the fourth, by less than 1% at the seventh and by less than 0.1% beyond the tenth; in
# light at 50 degrees, or from behind, by at most 10%, 1%, 0.1% and less.
SPREAD = 16

AnyFabric = Annotated[Fabric, instance(Fabric)]
AnyCamera = Annotated[Camera, instance(*get_args(Camera))]

# The camera of a picture of the whole lies twice as far away.
LARGEST_MM = 1e8

Size = Annotated[tuple[float, float] | None, optional(pair(Range(0.0, LARGEST_MM, exclusive=True)))]


@dataclass(frozen=True, eq=False, repr=False)
class Swatch(Description):
    """A flat rectangular piece of fabric in the plane z = 0, centred on the origin.

    Parameters
    ----------
    fabric
        What it is a piece of.
    size_mm
        Width and height in millimetres, greater than 0; one number for a square. None: one
        repeat of the pattern.

    Raises
    ------
    ParameterError
        If the size lies outside its range.
    TypeError
        If a value is not of the kind named.
    """

    fabric: AnyFabric
    size_mm: Size = None

    if TYPE_CHECKING:

        def __init__(self, fabric: Fabric, size_mm: NumberOrNumbers | None = ...) -> None: ...

    @property
    def extent_mm(self) -> tuple[float, float]:
        """Width and height in millimetres: `size_mm`, or one repeat if that is None."""
        return self.fabric.repeat_mm if self.size_mm is None else self.size_mm

    def extended(self) -> Swatch:
        """Return a larger swatch with this one in its middle, to look at without its edges.

        The pattern goes on by whole repeats, on each side by at least 16 yarns: further than light
        spreads that enters by a cut edge. Memory hardly grows, since repeats look alike.
        """
        extents = zip(self.extent_mm, self.fabric.repeat_mm, strict=True)
        spread = SPREAD * self.fabric.unit_mm
        width, height = (
            extent + 2.0 * math.ceil(spread / repeat) * repeat for extent, repeat in extents
        )
        return replace(self, size_mm=(width, height))


def checked_lights(name: str, value: Any) -> tuple[Light, ...]:
    """Check for one or more lights; stores a tuple."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        raise TypeError(f"{name} must be a sequence of lights, not a {type(value).__name__}")
    if not value:
        raise ParameterError(f"{name} must hold at least one light, not 0: all would be black")
    is_light = instance(*get_args(Light))
    return tuple(is_light(f"{name}[{i}]", light) for i, light in enumerate(value))


AnySwatch = Annotated[Swatch, instance(Swatch)]
Lights = Annotated[tuple[Light, ...], checked_lights]
Background = Annotated[Rgb | None, optional(rgb(RADIOMETRIC))]


@dataclass(frozen=True, eq=False, repr=False)
class Scene(Saved):
    """All that a picture depends on, apart from how many samples it is made of.

    Parameters
    ----------
    swatch
        The cloth.
    camera
        From where it is seen.
    lights
        One or more lights.
    background
        What the camera sees where no cloth and no rectangle light stands in its way, linear RGB, in
        [0, 1e15]: in gaps, and beside the cloth. It lights nothing. None: the lights there, which
        is black unless they are surroundings.

    Raises
    ------
    ParameterError
        If there is no light.
    TypeError
        If a value is not of the kind named.
    """

    swatch: AnySwatch
    camera: AnyCamera
    lights: Lights
    background: Background = None

    if TYPE_CHECKING:

        def __init__(
            self,
            swatch: Swatch,
            camera: Camera,
            lights: Sequence[Emitter],
            background: NumberOrNumbers | None = ...,
        ) -> None: ...

    def with_bsdfs(self, warp: PlyBsdf, weft: PlyBsdf) -> Scene:
        """Return the same scene, but the yarns of warp and weft have these BSDFs."""
        fabric = self.swatch.fabric
        dyed = replace(
            fabric,
            warp=with_each(fabric.warp, lambda yarn: replace(yarn, bsdf=warp)),
            weft=with_each(fabric.weft, lambda yarn: replace(yarn, bsdf=weft)),
        )
        return replace(self, swatch=replace(self.swatch, fabric=dyed))
