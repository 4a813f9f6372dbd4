"""The unknowns of a fit: optical parameters as a vector of numbers between 0 and 1."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plycloth._check import FINITE, ParameterError, known_name, number, quoted, vector
from plycloth.bsdf import PlyBsdf
from plycloth.lens import Lens

FloatArray = NDArray[np.float64]

SETS = ("warp", "weft")
CHANNELS = ("red", "green", "blue")
DIRECTIONS = ("along", "across")


_range = vector(2, number(FINITE))


@dataclass(frozen=True)
class Parameter:
    """One field of a PlyBsdf, or an unknown of the camera: its parts, range, scale and unit."""

    name: str
    low: float
    high: float
    parts: tuple[str, ...] = ("",)
    logarithmic: bool = False
    unit: str = ""

    def to_unit(self, value: float) -> float:
        """Map a value from [low, high] to [0, 1]."""
        if self.logarithmic:
            return float(np.log(value / self.low) / np.log(self.high / self.low))
        return (value - self.low) / (self.high - self.low)

    def from_unit(self, u: float) -> float:
        """Undo `to_unit`."""
        u = min(max(float(u), 0.0), 1.0)
        if self.logarithmic:
            value = self.low * float(np.exp(u * np.log(self.high / self.low)))
        else:
            value = self.low + u * (self.high - self.low)
        return min(max(value, self.low), self.high)

    def slope(self, value: float) -> float:
        """Return d value / d u."""
        if self.logarithmic:
            return value * float(np.log(self.high / self.low))
        return self.high - self.low


# In the order of the core's parameter rows (src/render/tape.rs). The ranges are those a fit looks
# in unless told otherwise: narrower than the model's where its ends do not occur in cloth.
OPTICAL = (
    Parameter("eta", 1.05, 2.0),
    Parameter("specular_tint", 0.0, 1.0, CHANNELS),
    Parameter("transmission_tint", 0.0, 1.0, CHANNELS),
    Parameter("base_color", 0.0, 1.0, CHANNELS),
    Parameter("transmitted_color", 0.0, 1.0, CHANNELS),
    Parameter("body_reflection", 0.0, 1.0),
    Parameter("extinction", 0.1, 1000.0, logarithmic=True, unit="1/mm"),
    Parameter("roughness", 0.05, 1.0, DIRECTIONS, logarithmic=True),
    Parameter("exit_roughness", 0.05, 1.0, DIRECTIONS, logarithmic=True),
)
EXPOSURE = Parameter("exposure", 0.02, 50.0, logarithmic=True)
FALLOFF = Parameter("falloff", 0.0, 3.0)
FALLOFFS = ("shared", "each")

NAMES = tuple(parameter.name for parameter in OPTICAL)
_FIRST = dict(zip(NAMES, np.cumsum([0] + [len(p.parts) for p in OPTICAL[:-1]]), strict=True))


def columns_of(field: str) -> slice:
    """Return where the numbers of a field stand in a row of the core's parameters."""
    first = int(_FIRST[field])
    return slice(first, first + len(OPTICAL[NAMES.index(field)].parts))


@dataclass(frozen=True)
class Unknown:
    """One number that is looked for: where it stands, and for which yarns."""

    parameter: Parameter
    part: int
    sets: tuple[int, ...]

    @property
    def column(self) -> int:
        """Where the number stands in a row of the core's parameters."""
        return int(columns_of(self.parameter.name).start) + self.part

    @property
    def label(self) -> str:
        """For example "warp.base_color.red"; without the set if it is both yarns'."""
        sets = SETS[self.sets[0]] if len(self.sets) == 1 else ""
        part = self.parameter.parts[self.part]
        return ".".join(word for word in (sets, self.parameter.name, part) if word)

    def value(self, bsdfs: Sequence[PlyBsdf]) -> float:
        """Return the number in the (first) BSDF that it stands for."""
        field = getattr(bsdfs[self.sets[0]], self.parameter.name)
        return float(np.ravel(field)[self.part])


@dataclass(frozen=True)
class LensUnknown:
    """One number of the camera that is looked for, and the pictures that it is for."""

    parameter: Parameter
    pictures: tuple[int, ...]
    of_all: bool

    @property
    def label(self) -> str:
        """For example "exposure", or "falloff.2" of the second picture alone."""
        return self.parameter.name if self.of_all else f"falloff.{self.pictures[0] + 1}"

    def value(self, lenses: Sequence[Lens]) -> float:
        """Return the number in the (first) lens that it stands for."""
        return float(getattr(lenses[self.pictures[0]], self.parameter.name))


def lens_unknowns(
    exposure: bool,
    falloff: str | None,
    pictures: Sequence[int],
    exposure_bounds: tuple[float, float] | None = None,
) -> list[LensUnknown]:
    """List the camera's unknowns: one exposure, and a falloff that pictures share or not."""
    every = tuple(pictures)
    low, high = exposure_bounds or (EXPOSURE.low, EXPOSURE.high)
    bounded = replace(EXPOSURE, low=low, high=high)
    found = [LensUnknown(bounded, every, of_all=True)] if exposure and every else []
    if falloff == "shared" and every:
        found.append(LensUnknown(FALLOFF, every, of_all=True))
    elif falloff == "each":
        found += [LensUnknown(FALLOFF, (picture,), of_all=False) for picture in every]
    return found


def with_lens_values(
    lenses: Sequence[Lens], where: Sequence[LensUnknown], values: Sequence[float]
) -> list[Lens]:
    """Return the lenses with the unknowns set to `values`."""
    changed = list(lenses)
    for unknown, value in zip(where, values, strict=True):
        for picture in unknown.pictures:
            change: dict[str, float] = {unknown.parameter.name: value}
            changed[picture] = replace(changed[picture], **change)
    return changed


def unknowns(
    free: Iterable[str] | None,
    *,
    tie: bool,
    bounds: Mapping[str, tuple[float, float]],
) -> list[Unknown]:
    """List the unknowns that names stand for.

    Parameters
    ----------
    free
        Names such as "eta" (both yarns) or "warp.base_color"; None: all.
    tie
        Whether warp and weft share their values.
    bounds
        Narrower or wider ranges for some names (without a set).

    Raises
    ------
    ParameterError
        If a name is unknown, twice there, a yarn's own though tied, or a range is empty.
    """
    limits = {name: _limits(name, bounds[name]) for name in bounds}
    wanted = list(NAMES) if free is None else name_list("free", free)
    found: list[Unknown] = []
    for name in wanted:
        sets, field = split_name(name, tie=tie)
        parameter = OPTICAL[NAMES.index(field)]
        low, high = limits.get(field, (parameter.low, parameter.high))
        parameter = replace(parameter, low=low, high=high)
        groups = [sets] if tie else [(s,) for s in sets]
        found += [Unknown(parameter, i, g) for g in groups for i in range(len(parameter.parts))]
    places = [(u.column, s) for u in found for s in u.sets]
    if len(set(places)) < len(places):
        raise ParameterError(f"free names a parameter twice: {', '.join(wanted)}")
    return sorted(found, key=lambda u: (u.sets, u.column))


def split_bounds(
    bounds: Mapping[str, tuple[float, float]],
) -> tuple[dict[str, tuple[float, float]], tuple[float, float] | None]:
    """Part the ranges of optical parameters from that of the exposure, if it is among them."""
    if not isinstance(bounds, Mapping):
        raise TypeError(f"bounds must be a dict of names and ranges, not {quoted(bounds)}")
    optical = {name: limits for name, limits in bounds.items() if name != EXPOSURE.name}
    if EXPOSURE.name not in bounds:
        return optical, None
    low, high = _range("bounds of exposure", bounds[EXPOSURE.name])
    if not 0.0 < low < high:
        raise ParameterError(
            f"bounds of exposure must be (low, high) with 0 < low < high, not ({low}, {high})"
        )
    return optical, (low, high)


def name_list(argument: str, names: object) -> list[str]:
    """Return names of parameters, seen to be texts."""
    if isinstance(names, Iterable) and not isinstance(names, str | bytes):
        found = list(names)
        if all(isinstance(name, str) for name in found):
            return found
    raise TypeError(f"{argument} must be a list of names of parameters, not {quoted(names)}")


def split_name(name: str, *, tie: bool = False) -> tuple[tuple[int, ...], str]:
    """Return the sets and the field that "eta" (both sets) or "warp.base_color" stands for."""
    yarns, _, field = name.rpartition(".")
    known_name("a free parameter", field, NAMES)
    if not yarns:
        return (0, 1), field
    known_name("a set of yarns", yarns, SETS)
    if tie:
        raise ParameterError(f"free names {name}, but tie=True lets warp and weft share all values")
    return (SETS.index(yarns),), field


def _limits(name: str, limits: object) -> tuple[float, float]:
    known_name("a bounded parameter", name, NAMES)
    parameter = OPTICAL[NAMES.index(name)]
    low, high = _range(f"bounds of {name}", limits)
    if not low < high or (parameter.logarithmic and low <= 0.0):
        raise ParameterError(
            f"bounds of {name} must be (low, high) with low < high, not ({low}, {high})"
        )
    for end in (low, high):
        value: dict[str, Any] = {name: end}
        replace(PlyBsdf(), **value)  # raises if the model has no such value
    return low, high


def with_values(
    bsdfs: Sequence[PlyBsdf], where: Sequence[Unknown], values: Sequence[float]
) -> list[PlyBsdf]:
    """Return the BSDFs of warp and weft with the unknowns set to `values`."""
    changes: list[dict[str, list[float]]] = [{}, {}]
    for unknown, value in zip(where, values, strict=True):
        for s in unknown.sets:
            name = unknown.parameter.name
            field = changes[s].setdefault(name, list(np.ravel(getattr(bsdfs[s], name))))
            field[unknown.part] = value
    fields: list[dict[str, Any]] = [
        {name: tuple(parts) if len(parts) > 1 else parts[0] for name, parts in change.items()}
        for change in changes
    ]
    return [replace(bsdf, **change) for bsdf, change in zip(bsdfs, fields, strict=True)]
