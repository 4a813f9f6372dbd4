"""The scattering models of a ply by themselves, for arrays of directions.

Local frame: z is the outward normal, x runs along the fibers. All directions are unit vectors that
point away from the surface; `eval` includes the cosine of `wi`, as Mitsuba's does. Arrays of
directions (their last axis holds the three components) and of numbers are broadcast against each
other as numpy does it, and results have the shape that this gives. Values over many directions are
computed in parallel.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plycloth import _plycloth
from plycloth._check import (
    FINITE,
    POSITIVE,
    UNIT,
    NumberOrNumbers,
    ParameterError,
    Range,
    arrays,
    choice,
    instance,
    integer,
    number,
    rgb,
)
from plycloth._value import Description
from plycloth.bsdf import Eta, PlyBsdf, Roughness

Array = NDArray[np.float64]
Shape = tuple[int, ...]
AnyPlyBsdf = Annotated[PlyBsdf, instance(PlyBsdf)]
Length = Annotated[float, number(POSITIVE)]

ETA = Range(1.01, 3.0)

# How far the length of a direction may be from 1: about what single precision leaves.
LENGTH_TOLERANCE = 1e-5

_eta = number(ETA)
_color = rgb(UNIT)
_body = choice("conserving", "printed")
_seed = integer(0, 2**64 - 1)
_passages = integer(1, 2**32 - 1)
_vectors = arrays((3,), FINITE)
_cosines = arrays((), Range(1e-12, 1.0))
_samples = arrays((3,), UNIT)


@dataclass(frozen=True, eq=False, repr=False)
class Interface(Description):
    """A rough dielectric interface: the specular lobes at x and at y.

    Walter, Marschner, Li and Torrance 2007, "Microfacet Models for Refraction through Rough
    Surfaces", with anisotropic GGX, Smith's masking (separable) and the visible normals of Heitz
    2018; Eqs. 8 to 10 of Montazeri et al. 2020 without their tints. Light may come from either
    side. Refraction is in the form that keeps energy: radiance in Mitsuba's transport mode is
    1/eta^2 of it for `wo` outside, eta^2 for `wo` inside.

    Parameters
    ----------
    eta
        Index of refraction inside (z < 0) over that outside, in [1.01, 3].
    roughness
        GGX widths along x and along y, each in [0.001, 1]; one number for both.

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not of the kind named.
    """

    eta: Eta = 1.5
    roughness: Roughness = (0.2, 0.3)

    if TYPE_CHECKING:

        def __init__(self, eta: float = ..., roughness: NumberOrNumbers = ...) -> None: ...

    def eval(self, wo: ArrayLike, wi: ArrayLike) -> Array:
        """Scattering from `wo` into `wi`, with the cosine of `wi`.

        Parameters
        ----------
        wo, wi
            Unit vectors, (..., 3). On one side of the interface they give the reflection, on
            different sides the refraction.

        Returns
        -------
        ndarray
            Values per steradian, one per pair (...).

        Raises
        ------
        ParameterError
            If an array is not (..., 3), holds NaN, a vector's length is not 1, or the two cannot
            be broadcast against each other.
        TypeError
            If an array does not hold real numbers.
        """
        shape, pairs = _direction_pairs(wo, wi)
        return _shaped(self._compiled.eval(*pairs), shape)

    def pdf(self, wo: ArrayLike, wi: ArrayLike) -> Array:
        """Density of `sample` per steradian. Arguments and shape are those of `eval`."""
        shape, pairs = _direction_pairs(wo, wi)
        return _shaped(self._compiled.pdf(*pairs), shape)

    def sample(self, wo: ArrayLike, u: ArrayLike) -> tuple[Array, Array]:
        """Choose directions by visible normals, reflected or refracted as Fresnel's equations say.

        Parameters
        ----------
        wo
            Unit vectors, (..., 3).
        u
            Uniform random numbers, (..., 3), in [0, 1].

        Returns
        -------
        wi, pdf
            Directions, (..., 3), and their densities, (...). Both are zero where the light would
            meet the interface a second time, which the model leaves out.

        Raises
        ------
        ParameterError
            If an array is not (..., 3), holds NaN, a vector's length is not 1, or the two cannot
            be broadcast against each other.
        TypeError
            If an array does not hold real numbers.
        """
        directions, numbers = _directions("wo", wo), _samples("u", u)
        shape, pairs = _broadcast(wo=directions, u=numbers)
        wi, pdf = self._compiled.sample(*pairs)
        return _shaped(wi, shape, 3), _shaped(pdf, shape)

    @cached_property
    def _compiled(self) -> _plycloth.CompiledInterface:
        return _plycloth.CompiledInterface(self.eta, self.roughness)


def body_reflection(
    base_color: Any,
    cos_o: ArrayLike,
    cos_i: ArrayLike,
    *,
    eta: float = 1.5,
    body: str = "conserving",
) -> Array:
    """Reflection by the body of a ply, Eq. 12 of Montazeri et al. 2020 without r, B and G_f.

    Parameters
    ----------
    base_color
        k_x^B in linear RGB, or one number for a grey, each in [0, 1].
    cos_o, cos_i
        Cosines of the two directions with the normal, (...), in (0, 1].
    eta
        Index of refraction, in [1.01, 3]; only the printed form depends on it.
    body
        "conserving": an isotropic half-space (Chandrasekhar 1960, "Radiative Transfer", chapter
        III) whose hemispherical albedo is `base_color`; "printed": the bracket of Eq. 12.

    Returns
    -------
    ndarray
        Values per steradian, (..., 3), without a cosine.

    Raises
    ------
    ParameterError
        If a value lies outside its range, or the cosines cannot be broadcast against each other.
    TypeError
        If a value is not of the kind named.
    """
    outgoing, incoming = _cosines("cos_o", cos_o), _cosines("cos_i", cos_i)
    shape, pairs = _broadcast(cos_o=outgoing[..., None], cos_i=incoming[..., None])
    color, index, form = _color("base_color", base_color), _eta("eta", eta), _body("body", body)
    cos_out, cos_in = (pair[:, 0] for pair in pairs)
    values = _plycloth.body_reflection(color, cos_out, cos_in, index, form)
    return _shaped(values, shape, 3)


@dataclass(frozen=True, eq=False, repr=False)
class PlyLobes(Description):
    """The lobes of a ply, and all of them together as the BSDF of a ribbon.

    On a round ply light enters at x and leaves at another point y, which depends on the cloth. On
    a ribbon both are one point (section 4.3), so the whole model is a function of two directions.
    What it lets through depends on the way inside (Eq. 11), which is random: `eval` and `pdf`
    average over such passages.

    Parameters
    ----------
    bsdf
        The ply's optical parameters.
    thickness_mm
        h of Eq. 15, the thickness of the ribbon in millimetres, greater than 0.

    Raises
    ------
    ParameterError
        If a value lies outside its range.
    TypeError
        If a value is not of the kind named.
    """

    bsdf: AnyPlyBsdf
    thickness_mm: Length = 0.1

    @property
    def entry(self) -> Interface:
        """The interface at x (Eqs. 8 and 9), without tints."""
        return Interface(self.bsdf.eta, self.bsdf.roughness)

    @property
    def exit(self) -> Interface:
        """The interface at y (Eq. 10), without tints; light that leaves has `wo` inside (z < 0)."""
        return Interface(self.bsdf.eta, self.bsdf.exit_roughness)

    def eval(self, wo: ArrayLike, wi: ArrayLike, *, passages: int = 256, seed: int = 0) -> Array:
        """Scattering of the ribbon from `wo` into `wi`, with the cosine of `wi`.

        The expectation over passages is estimated without bias: its standard error falls as
        1/sqrt(passages), and grows as the interfaces become smoother.

        Parameters
        ----------
        wo, wi
            Unit vectors, (..., 3), on either side of the ribbon, which looks the same from both.
        passages
            Random passages to average over, at least 1.
        seed
            Pairs with the same number (in the order of the result) and seed share their random
            numbers; 0 to 2^64 - 1.

        Returns
        -------
        ndarray
            Values per steradian, (..., 3), linear RGB.

        Raises
        ------
        ParameterError
            If an array is not (..., 3), holds NaN, a vector's length is not 1, the two cannot be
            broadcast against each other, or a number lies outside its range.
        TypeError
            If an array does not hold real numbers, or a number is not whole.
        """
        shape, (values, _) = self._averages(wo, wi, passages, seed)
        return _shaped(values, shape, 3)

    def pdf(self, wo: ArrayLike, wi: ArrayLike, *, passages: int = 256, seed: int = 0) -> Array:
        """Density of `sample` per steradian, (...). Arguments are those of `eval`."""
        shape, (_, densities) = self._averages(wo, wi, passages, seed)
        return _shaped(densities, shape)

    def sample(self, wo: ArrayLike, *, seed: int = 0) -> tuple[Array, Array]:
        """Choose directions, each after a random passage.

        Parameters
        ----------
        wo
            Unit vectors, (..., 3).
        seed
            Directions with the same number and seed are sampled alike; 0 to 2^64 - 1.

        Returns
        -------
        wi, weight
            Directions and linear RGB weights, (..., 3): value over density, given the passage.
            Both are zero where the light is lost. The mean weight is the ribbon's albedo.

        Raises
        ------
        ParameterError
            If `wo` is not (..., 3), holds NaN, or a vector's length is not 1.
        TypeError
            If an array does not hold real numbers, or the seed is not whole.
        """
        directions = _directions("wo", wo)
        wi, weight = self._compiled.sample(directions.reshape(-1, 3), _seed("seed", seed))
        return wi.reshape(directions.shape), weight.reshape(directions.shape)

    def _averages(
        self, wo: ArrayLike, wi: ArrayLike, passages: int, seed: int
    ) -> tuple[Shape, tuple[Array, Array]]:
        shape, pairs = _direction_pairs(wo, wi)
        count, number = _passages("passages", passages), _seed("seed", seed)
        return shape, self._compiled.eval(*pairs, count, number)

    @cached_property
    def _compiled(self) -> _plycloth.CompiledRibbon:
        return _plycloth.CompiledRibbon(self.bsdf, self.thickness_mm)


def _directions(name: str, value: ArrayLike) -> Array:
    vectors: Array = _vectors(name, value)
    lengths = np.asarray(np.linalg.norm(vectors, axis=-1))
    if (wrong := np.abs(lengths - 1.0) > LENGTH_TOLERANCE).any():
        where = tuple(int(i) for i in np.argwhere(wrong)[0])
        index = f"[{', '.join(map(str, where))}]" if where else ""
        raise ParameterError(f"{name}{index} must have length 1, not {lengths[where]:g}")
    return np.asarray(vectors / lengths[..., None])


def _direction_pairs(wo: ArrayLike, wi: ArrayLike) -> tuple[Shape, tuple[Array, Array]]:
    return _broadcast(wo=_directions("wo", wo), wi=_directions("wi", wi))


def _broadcast(**arrays: Array) -> tuple[Shape, tuple[Array, Array]]:
    """Return the shape that two arrays of vectors have together, and the rows of each in it."""
    try:
        shape = np.broadcast_shapes(*(each.shape[:-1] for each in arrays.values()))
    except ValueError:
        (first, one), (second, other) = arrays.items()
        raise ParameterError(
            f"{second} must broadcast with {first}, whose shape is {one.shape[:-1]}, but has the"
            f" shape {other.shape[:-1]} (without the components)"
        ) from None
    wide = (np.broadcast_to(each, (*shape, each.shape[-1])) for each in arrays.values())
    a, b = (each.reshape(-1, each.shape[-1]) for each in wide)
    return shape, (a, b)


def _shaped(rows: Array, shape: Shape, *components: int) -> Array:
    shaped: Array = rows.reshape((*shape, *components))
    return shaped
