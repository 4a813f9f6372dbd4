"""Cameras: from where, and how large, the cloth is seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from plycloth._check import (
    POSITIVE,
    Direction,
    Numbers,
    ParameterError,
    Point,
    Range,
    Vector,
    integer,
    number,
    vector,
)
from plycloth._value import Description

Resolution = Annotated[tuple[int, int], vector(2, integer(1, 65536))]
Angle = Annotated[float, number(Range(0.0, 180.0, exclusive=True))]
Length = Annotated[float, number(POSITIVE)]

# The sine of the smallest angle between `up` and the view that still tells which way is up.
MIN_SINE_TO_UP = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class PerspectiveCamera(Description):
    """A pinhole camera.

    Parameters
    ----------
    origin
        Position of the pinhole, millimetres.
    target
        Point in the middle of the picture, millimetres; differs from `origin`.
    up
        Direction that points upwards in the picture; not parallel to the view.
    fov
        Horizontal field of view in degrees, in (0, 180).
    resolution
        Width and height of the picture in pixels, each in [1, 65536].

    Raises
    ------
    ParameterError
        If a value lies outside its range, or the view has no direction or no upright.
    TypeError
        If a value is not of the kind named.
    """

    origin: Point
    target: Point
    up: Direction = (0.0, 1.0, 0.0)
    fov: Angle = 40.0
    resolution: Resolution = (512, 512)

    if TYPE_CHECKING:

        def __init__(
            self,
            origin: Numbers,
            target: Numbers,
            up: Numbers = ...,
            fov: float = ...,
            resolution: Sequence[int] = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_view(type(self).__name__, self.origin, self.target, self.up)


@dataclass(frozen=True, eq=False, repr=False)
class OrthographicCamera(Description):
    """A camera whose rays are parallel, so that lengths do not shrink with distance.

    Parameters
    ----------
    origin
        Middle of the plane from which the rays start, millimetres.
    target
        Point in the middle of the picture, millimetres; differs from `origin`.
    up
        Direction that points upwards in the picture; not parallel to the view.
    width_mm
        Width of what the picture shows, millimetres, greater than 0.
    resolution
        Width and height of the picture in pixels, each in [1, 65536]. Pixels are square.

    Raises
    ------
    ParameterError
        If a value lies outside its range, or the view has no direction or no upright.
    TypeError
        If a value is not of the kind named.
    """

    origin: Point
    target: Point
    up: Direction = (0.0, 1.0, 0.0)
    width_mm: Length = 1.0
    resolution: Resolution = (512, 512)

    if TYPE_CHECKING:

        def __init__(
            self,
            origin: Numbers,
            target: Numbers,
            up: Numbers = ...,
            width_mm: float = ...,
            resolution: Sequence[int] = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_view(type(self).__name__, self.origin, self.target, self.up)


Camera = PerspectiveCamera | OrthographicCamera


def _check_view(camera: str, origin: Vector, target: Vector, up: Vector) -> None:
    view = np.subtract(target, origin)
    if not view.any():
        raise ParameterError(f"{camera}.target must differ from {camera}.origin {origin}")
    sine = np.linalg.norm(np.cross(_unit(view), _unit(np.asarray(up))))
    if sine < MIN_SINE_TO_UP:
        raise ParameterError(
            f"{camera}.up must not be parallel to the view from {origin} to {target}, not {up}"
        )


def _unit(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    # Divided by the largest component first: squares of tiny or huge ones leave a float's range.
    vector = vector / np.abs(vector).max()
    return np.asarray(vector / np.linalg.norm(vector))
