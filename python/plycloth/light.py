"""Lights. Colours are linear RGB; a single number stands for a grey."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field, replace
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth._check import (
    FINITE,
    RADIOMETRIC,
    Direction,
    NumberOrNumbers,
    Numbers,
    ParameterError,
    Point,
    Rgb,
    array,
    instance,
    number,
    optional,
    rgb,
)
from plycloth._value import Description

Emission = Annotated[Rgb, rgb(RADIOMETRIC)]
Radiance = Annotated[NDArray[np.float32], array((None, None, 3), RADIOMETRIC, np.float32)]
Scale = Annotated[float, number(RADIOMETRIC)]
Angle = Annotated[float, number(FINITE)]
OptionalPath = Annotated[str | None, optional(instance(str))]

# The sine of the smallest angle between a rectangle's edges at which it still has an area.
MIN_SINE_OF_EDGES = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Emitter(Description):
    """What all lights are, so that type checkers know what a list of different ones holds."""


@dataclass(frozen=True, eq=False, repr=False)
class PointLight(Emitter):
    """A light that shines from one point in all directions.

    Parameters
    ----------
    position
        Where it stands, millimetres.
    intensity
        Power per solid angle, linear RGB, in [0, 1e15]. At distance d (millimetres) a surface
        that faces the light receives the irradiance intensity / d^2.

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not of the kind named.
    """

    position: Point
    intensity: Emission

    if TYPE_CHECKING:

        def __init__(self, position: Numbers, intensity: NumberOrNumbers) -> None: ...


@dataclass(frozen=True, eq=False, repr=False)
class DirectionalLight(Emitter):
    """A light so far away that its rays are parallel, as the sun's.

    Parameters
    ----------
    direction
        Direction in which the light travels; of any length but 0.
    irradiance
        What a surface that faces the light receives, linear RGB, in [0, 1e15].

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not of the kind named.
    """

    direction: Direction
    irradiance: Emission

    if TYPE_CHECKING:

        def __init__(self, direction: Numbers, irradiance: NumberOrNumbers) -> None: ...


@dataclass(frozen=True, eq=False, repr=False)
class RectangleLight(Emitter):
    """A parallelogram that shines to one side, alike in all directions.

    Parameters
    ----------
    center
        Its middle, millimetres.
    edge_u, edge_v
        Its full edges, millimetres. It shines to the side of edge_u x edge_v.
    radiance
        What it emits, linear RGB, in [0, 1e15].

    Raises
    ------
    ParameterError
        If a value lies outside its range, or the edges are parallel.
    TypeError
        If a value is not of the kind named.
    """

    center: Point
    edge_u: Point
    edge_v: Point
    radiance: Emission

    if TYPE_CHECKING:

        def __init__(
            self, center: Numbers, edge_u: Numbers, edge_v: Numbers, radiance: NumberOrNumbers
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("edge_u", "edge_v"):
            if not any(edge := getattr(self, name)):
                raise ParameterError(
                    f"RectangleLight.{name} must have a length greater than 0, not {edge}"
                )
        u, v = (np.asarray(edge) / np.abs(edge).max() for edge in (self.edge_u, self.edge_v))
        area = np.linalg.norm(np.cross(u, v))
        if area < MIN_SINE_OF_EDGES * np.linalg.norm(u) * np.linalg.norm(v):
            raise ParameterError(
                f"RectangleLight.edge_v must not be parallel to edge_u {self.edge_u},"
                f" not {self.edge_v}"
            )


@dataclass(frozen=True, eq=False, repr=False)
class ConstantLight(Emitter):
    """Surroundings that shine alike from everywhere.

    Parameters
    ----------
    radiance
        What arrives from every direction, linear RGB, in [0, 1e15].

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not of the kind named.
    """

    radiance: Emission

    if TYPE_CHECKING:

        def __init__(self, radiance: NumberOrNumbers) -> None: ...


@dataclass(frozen=True, eq=False, repr=False)
class EnvironmentLight(Emitter):
    """Surroundings that shine as an image in latitude and longitude says; up is +y.

    Two are equal if image, scale and rotation are; where the image came from does not matter.

    Parameters
    ----------
    image
        Radiance, linear RGB, H x W x 3, in [0, 1e15]; the top row is at +y. Stored as float32.
    scale
        Factor on the image; their product is in [0, 1e15].
    rotation
        Turn about the y axis in degrees.
    path
        The file that holds this image, as `load` sets it; a scene that is saved to JSON names
        the file in place of a large image.

    Raises
    ------
    ParameterError
        If a value lies outside its range, or the image is not H x W x 3.
    TypeError
        If a value is not of the kind named.
    """

    image: Radiance
    scale: Scale = 1.0
    rotation: Angle = 0.0
    path: OptionalPath = field(default=None, compare=False)

    if TYPE_CHECKING:

        def __init__(
            self,
            image: ArrayLike,
            scale: float = ...,
            rotation: float = ...,
            path: str | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        brightest = self.scale * float(self.image.max())
        if not RADIOMETRIC.holds(brightest):
            raise ParameterError(
                f"EnvironmentLight.scale times the image must be {RADIOMETRIC}, not {brightest:g}"
            )

    @classmethod
    def load(cls, path: str | PathLike[str], *, scale: float = 1.0, rotation: float = 0.0) -> Self:
        """Make a light of an image file that `read_image` can read.

        Raises
        ------
        OSError
            If the file cannot be opened.
        ValueError
            If it holds no image.

        Warns
        -----
        ImageWarning
            If some of its values are no radiance: negative ones and NaN become 0, infinite ones
            the brightest of the others.
        """
        # Not needed by the descriptions themselves, which stay quick to import.
        from plycloth.environment_map import read_environment_map
        from plycloth.image_file import ImageWarning

        read = read_environment_map(path)
        if read.replaced is not None:
            warnings.warn(ImageWarning(read.replaced), stacklevel=2)
        return cls(read.pixels, scale, rotation, path=str(Path(fspath(path)).absolute()))

    def current_file(self) -> Path | None:
        """Return the file at `path` if it still holds this image, else None."""
        from plycloth.environment_map import read_environment_map

        if self.path is None:
            return None
        try:
            held = replace(self, image=read_environment_map(self.path).pixels)
        except (OSError, ValueError):
            return None
        return Path(self.path) if held == self else None


Light = PointLight | DirectionalLight | RectangleLight | ConstantLight | EnvironmentLight
