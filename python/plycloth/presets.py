"""Yarns measured by others, by name.

The geometry of the nine procedural yarns that Zhao, Luan and Bala fitted to micro-CT scans: 2016,
"Fitting Procedural Yarn Models for Realistic Cloth Rendering", ACM Transactions on Graphics 35 (4).
Their plies are ellipses of fibers that overlap a little; here they are circles that touch. The
optical parameters are the defaults of `PlyBsdf`, which nobody measured.
"""

from __future__ import annotations

from plycloth._check import choice
from plycloth.bsdf import PlyBsdf
from plycloth.yarn import RoundYarn

# Number of plies, yarn radius and pitch in millimetres; negative where the yarn turns clockwise.
_GEOMETRY = {
    "cotton1": (3, 0.0378238, 0.452737),
    "cotton2": (3, 0.0330434, 0.336314),
    "polyester1": (2, 0.0287052, 0.370407),
    "rayon1": (2, 0.0507064, -0.639347),
    "rayon2": (2, 0.0286676, 0.37229),
    "rayon3": (2, 0.0418471, -0.63839),
    "rayon4": (2, 0.045217, -0.49778),
    "silk1": (3, 0.037619, 0.525528),
    "silk2": (3, 0.0450518, 0.701703),
}


def presets() -> tuple[str, ...]:
    """Return the names that `preset` knows."""
    return tuple(_GEOMETRY)


def preset(name: str) -> RoundYarn:
    """Return a measured yarn.

    Parameters
    ----------
    name
        One of `presets()`, such as "cotton1".

    Raises
    ------
    ParameterError
        If there is no such yarn; the message lists those there are.
    TypeError
        If the name is not a string.
    """
    plies, radius, pitch = _GEOMETRY[choice(*_GEOMETRY)("the preset", name)]
    return RoundYarn(radius_mm=radius, bsdf=PlyBsdf(), plies=plies, pitch_mm=pitch)
