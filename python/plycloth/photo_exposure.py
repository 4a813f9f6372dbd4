"""How bright a cloth really is: exposure and albedo trade, so that something must hold one of them.

A photograph shows the product of both. The exposure may be known, or follow from a card of known
reflectance that lay where the cloth does. If neither is said, the fit gets one picture more: that
which `overview` makes of the cloth, which is to have the photograph's mean colours.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np
from numpy.typing import NDArray

from plycloth._check import NumberOrNumbers, Range, Rgb, number, rgb
from plycloth._value import Description
from plycloth.fabric import Fabric
from plycloth.overview import IRRADIANCE, overview
from plycloth.rig import PhotoRig
from plycloth.scene import Scene

FloatArray = NDArray[np.float64]

# The lighting of `overview` that is like the rig's lamp on a side.
LIGHTS = {"front": "day", "back": "back"}
# Alike all over, it needs few cells.
LOOK_CELLS = 4
CardLight = Annotated[Rgb, rgb(Range(1e-6, 1e6))]
Reflectance = Annotated[float, number(Range(1e-3, 1.0))]
GREY = 0.18
"""The reflectance of a grey card."""


@dataclass(frozen=True, eq=False, repr=False)
class GreyCard(Description):
    """A card of known reflectance, photographed in place of the cloth and lit from the front.

    Parameters
    ----------
    light
        What its middle shows in the photograph, in linear light: one number, or RGB, of which the
        mean counts, since a photograph's white balance is left as it is.
    reflectance
        Its albedo, in [0.001, 1]: 0.18 for a grey card, about 0.9 for white ones.

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not a number.
    """

    light: CardLight
    reflectance: Reflectance = GREY

    if TYPE_CHECKING:

        def __init__(self, light: NumberOrNumbers, reflectance: float = GREY) -> None: ...

    def exposure(self, rig: PhotoRig) -> float:
        """Return the exposure with which the rig's camera sees the card so."""
        return float(np.mean(self.light)) / (self.reflectance * rig.irradiance("front") / np.pi)


@dataclass(frozen=True, eq=False)
class Look:
    """How `overview` is to show the cloth: the mean colour of the photograph, in its scale.

    Parameters
    ----------
    side
        Which photograph.
    color
        Its mean, in linear light.
    size_mm
        Width and height of the piece of cloth that it shows.
    width
        Of the photograph, in pixels.
    """

    side: str
    color: FloatArray
    size_mm: tuple[float, float]
    width: int

    def scene(self, fabric: Fabric) -> Scene:
        """Return the scene of the cloth by itself."""
        return overview(fabric, LIGHTS[self.side], size_mm=self.size_mm, width=self.width)

    @property
    def target(self) -> FloatArray:
        """The picture to fit to: the colour all over."""
        return np.broadcast_to(self.color, (LOOK_CELLS, LOOK_CELLS, 3)).copy()

    def error(self, fitted: FloatArray) -> float:
        """Return by what part the mean of cells is off, in the channel where it is most."""
        return float(np.abs(fitted.mean((0, 1)) / np.maximum(self.color, 1e-3) - 1.0).max())


def likely_exposure(rig: PhotoRig, side: str) -> float:
    """Return the exposure that makes a lamp of the rig as bright as the lights of `overview`."""
    return IRRADIANCE / rig.irradiance(side)
