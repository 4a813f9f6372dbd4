"""A ready view of a fabric: from straight above, in a pleasing light."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from plycloth._check import NumberOrNumbers, ParameterError, instance, integer, known_name
from plycloth.camera import OrthographicCamera
from plycloth.fabric import Fabric
from plycloth.light import DirectionalLight, Emitter, EnvironmentLight, Light
from plycloth.scene import Scene, Swatch, checked_lights

# What reaches the cloth from sun and sky together. Half of what cloth does not absorb leaves on its
# other side; the light makes up for it, so that colours come out about as bright as in the draft.
IRRADIANCE = 2.5 * math.pi

# Where the sun stands, in degrees: counter-clockwise from +x in the picture, and above the cloth
# (below it: behind the cloth); and its share of the light. The rest is sky.
SUNS = {
    "day": (125.0, 50.0, 0.7),
    "raking": (125.0, 12.0, 0.7),
    "overcast": (125.0, 50.0, 0.0),
    "back": (90.0, -60.0, 0.9),
}

LIGHTINGS = tuple(SUNS)
"""The lightings that `overview` knows by name."""

PIXELS_PER_YARN = 16
SHORTEST_SIDE, LONGEST_SIDE = 512, 1024

GROUND = (0.05, 0.05, 0.05)
"""What `overview` shows through gaps: a grey ground in the shade of the cloth."""

_width = integer(1, 65536)
_cut = instance(bool)


def lighting(name: str) -> tuple[Light, ...]:
    """Return lights for cloth in the plane z = 0 that is seen from +z.

    Parameters
    ----------
    name
        "day": a sun at the upper left and a sky over the cloth; "raking": the same with a low sun,
        which shows the relief; "overcast": the sky alone; "back": a sun behind the cloth.

    Raises
    ------
    ParameterError
        If there is no such lighting; the message lists those there are.
    """
    known_name("a lighting", name, SUNS)
    azimuth, elevation, share = SUNS[name]
    sky = _sky((1.0 - share) * IRRADIANCE / math.pi)
    if share == 0.0:
        return (sky,)
    towards = _direction(math.radians(azimuth), math.radians(elevation))
    irradiance = share * IRRADIANCE / abs(towards[2])
    travels = (-towards[0], -towards[1], -towards[2])
    return DirectionalLight(travels, (irradiance,) * 3), sky


def overview(
    fabric: Fabric,
    light: str | Sequence[Emitter] = "day",
    *,
    size_mm: NumberOrNumbers | None = None,
    width: int | None = None,
    ground: NumberOrNumbers | None = GROUND,
    cut: bool = False,
) -> Scene:
    """Return the scene of a piece of cloth that fills the picture, seen straight on from afar.

    The cloth goes on beyond the picture, its pattern repeated.

    Parameters
    ----------
    fabric
        What to show.
    light
        A name that `lighting` knows, or lights of your own.
    size_mm
        Width and height of the piece in millimetres, or one number for a square. None: one repeat,
        as a whole draft.
    width
        Of the picture in pixels; its height follows from the piece's. None: 16 pixels per yarn,
        but at least 512 and at most 1024 pixels along the longer side.
    ground
        What is seen through gaps in the cloth, linear RGB. It lights nothing. None: the lights
        that stand there, if any; the named ones leave gaps black.
    cut
        Whether the cloth ends where the picture does, so that light enters by its cut edge.

    Raises
    ------
    ParameterError
        If a value lies outside its range, or there is no such lighting.
    TypeError
        If `light` is neither a name nor lights, or another value is not of the kind named.
    """
    swatch = Swatch(fabric, size_mm)
    shown = swatch if _cut("cut", cut) else swatch.extended()
    width_mm, height_mm = swatch.extent_mm
    pixels = _default_width(swatch) if width is None else _width("width", width)
    # Rounded down: what lies beside the swatch must not be seen.
    rows = max(1, int(pixels * height_mm / width_mm))
    if rows > 65536:
        raise ParameterError(f"width must be less for a swatch so tall: {pixels} give {rows} rows")
    camera = OrthographicCamera(
        origin=(0.0, 0.0, 2.0 * max(width_mm, height_mm)),
        target=(0.0, 0.0, 0.0),
        width_mm=width_mm,
        resolution=(pixels, rows),
    )
    lights = lighting(light) if isinstance(light, str) else checked_lights("light", light)
    return Scene(shown, camera, lights, ground)


def _default_width(swatch: Swatch) -> int:
    width_mm, height_mm = swatch.extent_mm
    longest = max(width_mm, height_mm)
    wanted = PIXELS_PER_YARN * longest / swatch.fabric.unit_mm
    side = min(max(wanted, SHORTEST_SIDE), LONGEST_SIDE)
    return max(1, round(side * width_mm / longest))


def _direction(azimuth: float, elevation: float) -> tuple[float, float, float]:
    across = math.cos(elevation)
    return across * math.cos(azimuth), across * math.sin(azimuth), math.sin(elevation)


def _sky(radiance: float) -> EnvironmentLight:
    """Return a sky over the face of the cloth alone, so that its back gets none."""
    # Columns run from -z over +x to +z in the middle: the inner two of four face the cloth.
    face = np.array([0.0, radiance, radiance, 0.0])
    return EnvironmentLight(np.repeat(face[None, :, None], 3, axis=2))
