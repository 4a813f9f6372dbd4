"""Checks of what a user passes to a description.

A check is a function of a field's name and the value given for it. It returns the value in the
form that the description stores, or raises an error that names the field and what it may be.
"""

import difflib
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from numbers import Integral, Real
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

Check = Callable[[str, Any], Any]
Rgb = tuple[float, float, float]
Vector = tuple[float, float, float]

# What may be given for fields that store such tuples: for type checkers, in the constructors that
# descriptions declare to them. A dataclass's own would take only what its fields hold.
Numbers = Sequence[float] | NDArray[Any]
NumberOrNumbers = float | Numbers


class ParameterError(ValueError):
    """A parameter lies outside its valid range, or names nothing that exists."""


@dataclass(frozen=True)
class Range:
    """The finite numbers from `low` to `high`; `exclusive` leaves out the two ends."""

    low: float = -math.inf
    high: float = math.inf
    exclusive: bool = False

    def holds(self, values: float | NDArray[Any]) -> NDArray[np.bool_]:
        """Tell for each value whether it lies in the range; NaN and infinities never do."""
        if self.exclusive:
            inside = np.greater(values, self.low) & np.less(values, self.high)
        else:
            inside = np.greater_equal(values, self.low) & np.less_equal(values, self.high)
        return np.asarray(inside & np.isfinite(values))

    def __str__(self) -> str:
        if math.isfinite(self.high):
            ends = f"{self.low:g}, {self.high:g}"
            return f"in ({ends})" if self.exclusive else f"in [{ends}]"
        if math.isfinite(self.low):
            bound = "greater than" if self.exclusive else "at least"
            return f"finite and {bound} {self.low:g}"
        return "finite"


FINITE = Range()
POSITIVE = Range(low=0.0, exclusive=True)
NON_NEGATIVE = Range(low=0.0)
UNIT = Range(0.0, 1.0)
# Of positions in millimetres: differences of such numbers, and their squares, stay finite.
COORDINATE = Range(-1e9, 1e9)
# Of light: pictures are single precision, their variances too.
RADIOMETRIC = Range(0.0, 1e15)

# How alike two names are at least (2 x the letters that match / all letters) for one to be taken
# for a slip in the other.
SLIP = 0.6
# Names that a message lists, where there may be any number.
MOST_LISTED = 12

# Characters of a user's text that a message quotes.
MOST_QUOTED = 80


def quoted(value: object) -> str:
    """Return a user's text in quotes, or another value as it is printed, in 80 characters."""
    # No escape is shorter than its character.
    shown = repr(value[: MOST_QUOTED + 1] if isinstance(value, str) else value)
    return shown if len(shown) <= MOST_QUOTED else f"{shown[: MOST_QUOTED - 4]}...{shown[-1]}"


def nearest(name: str, choices: Iterable[str]) -> str | None:
    """Return the choice that `name` is a slip in, whatever its case; None: it is like none."""
    by_lower_case = {choice.lower(): choice for choice in reversed(list(choices))}
    near = difflib.get_close_matches(name.lower(), by_lower_case, n=1, cutoff=SLIP)
    return by_lower_case[near[0]] if near else None


def hint(name: str, choices: Iterable[str]) -> str:
    """Return what may have been meant, "the nearest is ..."; or what there is if none is near."""
    choices = list(choices)
    if (near := nearest(name, choices)) is not None:
        return f"the nearest is {near!r}"
    if not choices:
        return "there are none"
    shown = _list(choices[:MOST_LISTED])
    left = len(choices) - MOST_LISTED
    return f"there are {shown}" + (f" and {left} more" if left > 0 else "")


def number(valid: Range) -> Check:
    """Check for one number within `valid`; stores a float."""

    def check(name: str, value: Any) -> float:
        value = _unwrap_scalar(value)
        if not _is_real(value):
            raise TypeError(f"{name} must be a number, not {_describe(value)}")
        return _in_range(name, value, valid)

    return check


def integer(low: int, high: int) -> Check:
    """Check for a whole number from `low` to `high`; stores an int."""

    def check(name: str, value: Any) -> int:
        value = _unwrap_scalar(value)
        if isinstance(value, bool) or not isinstance(value, Integral):
            raise TypeError(f"{name} must be an integer, not {_describe(value)}")
        stored = int(value)
        if not low <= stored <= high:
            raise ParameterError(f"{name} must be in [{low}, {high}], not {quoted(stored)}")
        return stored

    return check


def vector(count: int, component: Check) -> Check:
    """Check for exactly `count` components; stores a tuple."""

    def check(name: str, value: Any) -> tuple[Any, ...]:
        components = _components(name, value, f"{count} numbers")
        if len(components) != count:
            raise ParameterError(f"{name} must be {count} numbers, not {len(components)}")
        return tuple(component(f"{name}[{i}]", part) for i, part in enumerate(components))

    return check


def number_or_vector(count: int, valid: Range) -> Check:
    """Check for `count` numbers, or one that stands for all of them; stores a tuple of floats."""
    one = number(valid)
    several = vector(count, one)

    def check(name: str, value: Any) -> tuple[float, ...]:
        value = _unwrap_scalar(value)
        if _is_real(value):
            return (one(name, value),) * count
        if not isinstance(value, Sequence | np.ndarray) or isinstance(value, str):
            raise TypeError(f"{name} must be a number or {count} numbers, not {_describe(value)}")
        components: tuple[float, ...] = several(name, value)
        return components

    return check


def rgb(valid: Range) -> Check:
    """Check for an RGB triple, or a number that stands for a grey; stores 3 floats."""
    return number_or_vector(3, valid)


def pair(valid: Range) -> Check:
    """Check for two numbers, or one that stands for both; stores 2 floats."""
    return number_or_vector(2, valid)


def direction(name: str, value: Any) -> tuple[float, ...]:
    """Check for a vector of 3 finite numbers that are not all zero; stores 3 floats.

    One so long or short that its square would be no number is stored at another length.
    """
    components: tuple[float, ...] = vector(3, number(FINITE))(name, value)
    longest = max(map(abs, components))
    if longest == 0.0:
        raise ParameterError(f"{name} must have a length greater than 0, not {components}")
    if 1e-100 < longest < 1e100:
        return components
    return tuple(component / longest for component in components)


Direction = Annotated[Vector, direction]
Point = Annotated[Vector, vector(3, number(COORDINATE))]


def choice(*options: str) -> Check:
    """Check for one of several names; stores the name."""

    def check(name: str, value: Any) -> str:
        if not isinstance(value, str):
            raise TypeError(f"{name} must be a name ({_list(options)}), not {_describe(value)}")
        return known_name(name, value, options)

    return check


def known_name(what: str, name: str, options: Iterable[str]) -> str:
    """Return `name` if it is one of the options, else raise an error that lists them."""
    options = list(options)
    if name not in options:
        near = nearest(name, options)
        meant = "" if near is None else f"; the nearest is {near!r}"
        raise ParameterError(f"{what} must be one of {_list(options)}, not {quoted(name)}{meant}")
    return name


def instance(*types: type) -> Check:
    """Check for an instance of one of the types; stores it as it is."""

    def check(name: str, value: Any) -> Any:
        if not isinstance(value, types):
            names = " or ".join(kind.__name__ for kind in types)
            raise TypeError(f"{name} must be a {names}, not {_describe(value)}")
        return value

    return check


def optional(check: Check) -> Check:
    """Check that lets None pass."""

    def check_unless_none(name: str, value: Any) -> Any:
        return None if value is None else check(name, value)

    return check_unless_none


def number_or_array(valid: Range) -> Check:
    """Check for one number, or an array of one per thread; stores a float or a float64 array."""
    one = number(valid)
    several = array((None,), valid)

    def check(name: str, value: Any) -> Any:
        value = _unwrap_scalar(value)
        return one(name, value) if _is_real(value) else several(name, value)

    return check


def array(shape: tuple[int | None, ...], valid: Range, dtype: type = np.float64) -> Check:
    """Check for an array of a shape (None: any positive length); stores a read-only copy."""
    wanted = " x ".join("n" if length is None else str(length) for length in shape) + " numbers"

    def check(name: str, value: Any) -> NDArray[Any]:
        stored = _float_array(name, value, dtype)
        fits = stored.ndim == len(shape) and all(
            length > 0 if wish is None else length == wish
            for length, wish in zip(stored.shape, shape, strict=True)
        )
        if not fits:
            raise ParameterError(f"{name} must be an array of {wanted}, not {_size(stored)}")
        _check_values(name, stored, valid)
        return stored

    return check


def arrays(core: tuple[int, ...], valid: Range) -> Check:
    """Check for an array of any shape that ends in `core`; stores a read-only float64 copy."""
    wanted = " x ".join(["...", *map(str, core)]) + " numbers"

    def check(name: str, value: Any) -> NDArray[Any]:
        stored = _float_array(name, value, np.float64)
        if stored.shape[stored.ndim - len(core) :] != core:
            raise ParameterError(f"{name} must be an array of {wanted}, not {_size(stored)}")
        _check_values(name, stored, valid)
        return stored

    return check


def _check_values(name: str, values: NDArray[Any], valid: Range) -> None:
    if not (held := valid.holds(values)).all():
        where = tuple(int(i) for i in np.argwhere(~held)[0])
        index = f"[{', '.join(map(str, where))}]" if where else ""
        raise ParameterError(f"{name}{index} must be {valid}, not {values[where]}")


def real_array(name: str, value: Any, *, kinds: str = "fiu") -> NDArray[Any]:
    """Return what is given as an array, if its type is of one of the kinds (numpy's letters)."""
    try:
        given = np.asarray(value)
    except ValueError:
        raise ParameterError(f"{name} must be an array, but its rows differ in length") from None
    if given.dtype.kind not in kinds:
        raise TypeError(f"{name} must hold real numbers, not {_describe(value)}")
    return given


def _float_array(name: str, value: Any, dtype: type) -> NDArray[Any]:
    given = real_array(name, value)
    # Adding 0 turns -0 into 0, so that equal arrays have equal bytes and thus equal hashes.
    with np.errstate(over="ignore"):
        stored: NDArray[Any] = np.array(given, dtype, order="C")
        stored += dtype(0)
    stored.flags.writeable = False
    return stored


def _in_range(name: str, value: Real, valid: Range) -> float:
    try:
        stored = float(value)
    except OverflowError:
        stored = math.inf
    if not valid.holds(stored):
        raise ParameterError(f"{name} must be {valid}, not {stored!r}")
    return stored


def _components(name: str, value: Any, wanted: str) -> list[Any]:
    if isinstance(value, np.ndarray) and value.ndim == 1:
        return list(value)
    if isinstance(value, Sequence) and not isinstance(value, str):
        return list(value)
    raise TypeError(f"{name} must be {wanted}, not {_describe(value)}")


def _unwrap_scalar(value: Any) -> Any:
    is_scalar = isinstance(value, np.generic | np.ndarray) and value.ndim == 0
    return value.item() if is_scalar else value


def _is_real(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _describe(value: Any) -> str:
    kind = type(value).__name__
    if isinstance(value, np.ndarray):
        return f"a {value.dtype} array of {_size(value)}"
    if value is None or isinstance(value, bool):
        return repr(value)
    if isinstance(value, str):
        return f"{quoted(value)} ({kind})"
    return f"{value!r} ({kind})" if isinstance(value, complex) else f"a value of type {kind}"


def _size(values: NDArray[Any]) -> str:
    return " x ".join(map(str, values.shape)) or "no dimension"


def _list(options: Iterable[str]) -> str:
    return ", ".join(map(repr, options))
