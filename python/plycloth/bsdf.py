"""How a ply scatters light: the parameters of the ply BSDF and of a diffuse surface.

The ply BSDF is that of Montazeri, Gammelmark, Zhao and Jensen 2020, "A Practical Ply-Based
Appearance Model of Woven Fabrics", section 4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from plycloth._check import UNIT, NumberOrNumbers, Range, Rgb, choice, number, pair, rgb
from plycloth._value import Description

Color = Annotated[Rgb, rgb(UNIT)]
Fraction = Annotated[float, number(UNIT)]
Roughness = Annotated[tuple[float, float], pair(Range(0.001, 1.0))]
Eta = Annotated[float, number(Range(1.01, 3.0))]
Extinction = Annotated[float, number(Range(0.0, 1e6))]
Body = Annotated[str, choice("conserving", "printed")]


@dataclass(frozen=True, eq=False, repr=False)
class PlyBsdf(Description):
    """The ply BSDF: light meets a ply at x, crosses it, and leaves it at y.

    Colours are linear RGB; a single number stands for a grey, and a single roughness for an
    isotropic one.

    Parameters
    ----------
    eta
        Index of refraction of the ply against air, in [1.01, 3].
    specular_tint
        k_x^S of Eq. 8: factor on the specular lobes where light enters, each in [0, 1].
    transmission_tint
        k_y^S of Eq. 10: factor on the specular lobe where light leaves, each in [0, 1].
    base_color
        k_x^B, the albedo of the body reflection of Eq. 12, each in [0, 1].
    transmitted_color
        k_y of Eq. 13, the albedo of the body transmission, each in [0, 1].
    body_reflection
        r of Eqs. 12 and 13: the share of the body's light that is reflected, in [0, 1]. The
        rest is transmitted.
    extinction
        sigma_t of Eq. 11, per millimetre, in [0, 1e6].
    roughness
        beta_x, the GGX widths where light enters: along the fibers and across them, in [0.001, 1].
    exit_roughness
        beta_y, the same where light leaves.
    body
        "conserving" for a body reflection that never returns more than it receives of light that
        is the same from all sides (of one directional light it may: docs/conventions.md has
        figures), "printed" for Eq. 12 as the paper prints it, which can.

    Raises
    ------
    ParameterError
        If a value lies outside its range, or `body` is not one of the two names.
    TypeError
        If a value is not of the kind named.
    """

    eta: Eta = 1.5
    specular_tint: Color = (1.0, 1.0, 1.0)
    transmission_tint: Color = (1.0, 1.0, 1.0)
    base_color: Color = (0.5, 0.5, 0.5)
    transmitted_color: Color = (0.5, 0.5, 0.5)
    body_reflection: Fraction = 0.5
    extinction: Extinction = 10.0
    roughness: Roughness = (0.2, 0.3)
    exit_roughness: Roughness = (0.4, 0.5)
    body: Body = "conserving"

    if TYPE_CHECKING:

        def __init__(
            self,
            eta: float = ...,
            specular_tint: NumberOrNumbers = ...,
            transmission_tint: NumberOrNumbers = ...,
            base_color: NumberOrNumbers = ...,
            transmitted_color: NumberOrNumbers = ...,
            body_reflection: float = ...,
            extinction: float = ...,
            roughness: NumberOrNumbers = ...,
            exit_roughness: NumberOrNumbers = ...,
            body: str = ...,
        ) -> None: ...


@dataclass(frozen=True, eq=False, repr=False)
class DiffuseBsdf(Description):
    """An opaque Lambertian surface, for comparisons and tests.

    Parameters
    ----------
    reflectance
        Albedo in linear RGB (or one number for a grey), each in [0, 1].

    Raises
    ------
    ParameterError
        If a value lies outside [0, 1].
    TypeError
        If the reflectance is neither a number nor three of them.
    """

    reflectance: Color = (0.5, 0.5, 0.5)

    if TYPE_CHECKING:

        def __init__(self, reflectance: NumberOrNumbers = ...) -> None: ...


Bsdf = PlyBsdf | DiffuseBsdf
