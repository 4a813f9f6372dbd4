"""The photo rig: one camera straight above the cloth, a lamp in front of it and one behind it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Annotated, Self

from plycloth._check import (
    COORDINATE,
    FINITE,
    POSITIVE,
    Numbers,
    ParameterError,
    Point,
    Range,
    choice,
    number,
    vector,
)
from plycloth._saved import Saved
from plycloth.camera import PerspectiveCamera
from plycloth.fabric import Fabric
from plycloth.light import PointLight
from plycloth.scene import Scene, Swatch

Vector = tuple[float, float, float]
Length = Annotated[float, number(POSITIVE)]
Angle = Annotated[float, number(Range(0.0, 180.0, exclusive=True))]
Positive = Annotated[float, number(POSITIVE)]

LAMPS = ("front", "back")

_lamp = choice(*LAMPS)
_rotation = number(FINITE)
_width = number(POSITIVE)
_offset = vector(3, number(COORDINATE))

# What the swatch shows by itself reaches a little beyond the picture.
MARGIN = 1.05


@dataclass(frozen=True, eq=False, repr=False)
class PhotoRig(Saved):
    """How photographs of a cloth lit from the front and from behind were taken.

    The cloth lies in the plane z = 0, its middle at the origin. The defaults are the rig of Tang et
    al. 2024, its units taken as millimetres.

    Parameters
    ----------
    camera_height
        Height of the camera over the cloth's middle, at which it looks, in millimetres.
    field_of_view
        Horizontal field of view of the camera in degrees, in (0, 180).
    front_lamp
        Position of the lamp that shines on the face, millimetres; z > 0.
    back_lamp
        Position of the lamp that shines on the back, millimetres; z < 0.
    intensity
        Radiant intensity of either lamp.
    gamma
        Photographs hold light ** (1 / gamma).

    Raises
    ------
    ParameterError
        If a value lies outside its range, or a lamp is on the wrong side.
    TypeError
        If a value is not of the kind named.
    """

    camera_height: Length = 8.0
    field_of_view: Angle = 53.0
    front_lamp: Point = (0.0, 8.0, 8.0)
    back_lamp: Point = (0.0, 0.0, -9.0)
    intensity: Positive = 300.0
    gamma: Positive = 2.2

    if TYPE_CHECKING:

        def __init__(
            self,
            camera_height: float = ...,
            field_of_view: float = ...,
            front_lamp: Numbers = ...,
            back_lamp: Numbers = ...,
            intensity: float = ...,
            gamma: float = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.front_lamp[2] <= 0.0:
            raise ParameterError(f"PhotoRig.front_lamp must have z > 0, not {self.front_lamp[2]:g}")
        if self.back_lamp[2] >= 0.0:
            raise ParameterError(f"PhotoRig.back_lamp must have z < 0, not {self.back_lamp[2]:g}")

    @property
    def picture_width(self) -> float:
        """Width of the piece of cloth that a picture shows, in millimetres."""
        return 2.0 * self.camera_height * math.tan(math.radians(0.5 * self.field_of_view))

    def lamp(self, name: str) -> Vector:
        """Return the position of the lamp "front" or "back"."""
        return self.front_lamp if _lamp("lamp", name) == "front" else self.back_lamp

    def irradiance(self, name: str) -> float:
        """Return the irradiance of the cloth's middle by the lamp "front" or "back"."""
        position = self.lamp(name)
        return self.intensity * abs(position[2]) / math.hypot(*position) ** 3

    def scaled(self, picture_width: float) -> Self:
        """Return the rig enlarged until a picture shows so many millimetres of cloth, as bright."""
        scale = _width("picture_width", picture_width) / self.picture_width
        return replace(
            self,
            camera_height=scale * self.camera_height,
            front_lamp=tuple(scale * each for each in self.front_lamp),
            back_lamp=tuple(scale * each for each in self.back_lamp),
            intensity=scale**2 * self.intensity,
        )


RIG = PhotoRig()


def photo_rig(
    fabric: Fabric,
    lamp: str,
    *,
    rig: PhotoRig = RIG,
    rotation: float = 0.0,
    lamp_offset: Vector = (0.0, 0.0, 0.0),
    resolution: tuple[int, int] = (512, 512),
) -> Scene:
    """Return the scene of a photograph of `fabric` with one of the rig's lamps lit.

    Parameters
    ----------
    fabric
        What was photographed.
    lamp
        "front" or "back".
    rig
        The rig; by default that of Tang et al. 2024.
    rotation
        By how much the cloth lay turned on the rig, in degrees, counter-clockwise in the picture.
    lamp_offset
        How far the lamp stood from where the rig has it, along x, y and z.
    resolution
        Width and height of the picture in pixels.

    Raises
    ------
    ParameterError
        If there is no such lamp, or a number is not finite.
    TypeError
        If a value is not of the kind named.
    """
    position, offset = rig.lamp(lamp), _offset("lamp_offset", lamp_offset)
    rotation = _rotation("rotation", rotation)
    # The cloth stays where it is: camera and lamp turn the other way.
    turn = math.radians(rotation)
    longest = rig.picture_width * max(1.0, resolution[1] / resolution[0])
    side = MARGIN * longest * (abs(math.cos(turn)) + abs(math.sin(turn)))
    camera = PerspectiveCamera(
        origin=(0.0, 0.0, rig.camera_height),
        target=(0.0, 0.0, 0.0),
        up=_turned((0.0, 1.0, 0.0), -rotation),
        fov=rig.field_of_view,
        resolution=resolution,
    )
    x, y, z = (a + b for a, b in zip(position, offset, strict=True))
    light = PointLight(position=_turned((x, y, z), -rotation), intensity=(rig.intensity,) * 3)
    return Scene(Swatch(fabric, (side, side)).extended(), camera, (light,))


def _turned(point: Vector, degrees: float) -> Vector:
    """Turn a point about the z axis, counter-clockwise."""
    x, y, z = point
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (cos * x - sin * y, sin * x + cos * y, z)
