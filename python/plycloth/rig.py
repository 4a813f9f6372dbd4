"""The photo rig of Tang et al. 2024: one camera, a lamp in front of the cloth and one behind it.

Lengths are the rig's own units, taken as millimetres: the picture shows a square of side
2 * 8 * tan(26.5 degrees) = 7.977 in the plane z = 0.
"""

import math

from plycloth._check import choice
from plycloth.camera import PerspectiveCamera
from plycloth.fabric import Fabric
from plycloth.light import PointLight
from plycloth.scene import Scene, Swatch

Vector = tuple[float, float, float]

CAMERA_HEIGHT = 8.0
FIELD_OF_VIEW = 53.0
LAMPS = {"front": (0.0, 8.0, 8.0), "back": (0.0, 0.0, -9.0)}
INTENSITY = 300.0

PICTURE_SIDE = 2.0 * CAMERA_HEIGHT * math.tan(math.radians(0.5 * FIELD_OF_VIEW))
"""Side of the square that the rig's pictures show, in millimetres."""

_lamp = choice(*LAMPS)

# The swatch reaches a little beyond the picture, so that no edge is seen.
MARGIN = 1.05


def photo_rig(
    fabric: Fabric,
    lamp: str,
    *,
    rotation: float = 0.0,
    lamp_offset: Vector = (0.0, 0.0, 0.0),
    resolution: tuple[int, int] = (512, 512),
) -> Scene:
    """Return the rig's scene with one of its two lamps lit.

    The authors compare their photographs with rendered ** (1 / 2.2).

    Parameters
    ----------
    fabric
        What was photographed.
    lamp
        "front" (above the picture's upper edge) or "back" (behind the picture's middle).
    rotation
        By how much the cloth lay turned on the rig, in degrees, counter-clockwise in the picture.
    lamp_offset
        How far the lamp stood from where the rig has it, along x, y and z.
    resolution
        Width and height of the picture in pixels.

    Raises
    ------
    ParameterError
        If there is no such lamp.
    """
    lamp = _lamp("lamp", lamp)
    # The cloth stays where it is: camera and lamp turn the other way.
    turn = math.radians(rotation)
    side = MARGIN * PICTURE_SIDE * (abs(math.cos(turn)) + abs(math.sin(turn)))
    camera = PerspectiveCamera(
        origin=(0.0, 0.0, CAMERA_HEIGHT),
        target=(0.0, 0.0, 0.0),
        up=_turned((0.0, 1.0, 0.0), -rotation),
        fov=FIELD_OF_VIEW,
        resolution=resolution,
    )
    x, y, z = (a + b for a, b in zip(LAMPS[lamp], lamp_offset, strict=True))
    light = PointLight(position=_turned((x, y, z), -rotation), intensity=(INTENSITY,) * 3)
    return Scene(Swatch(fabric, (side, side)), camera, (light,))


def _turned(point: Vector, degrees: float) -> Vector:
    """Turn a point about the z axis, counter-clockwise."""
    x, y, z = point
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return (cos * x - sin * y, sin * x + cos * y, z)
