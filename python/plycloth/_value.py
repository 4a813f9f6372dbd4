"""What all descriptions have in common: they are values."""

from dataclasses import MISSING, Field, dataclass, fields
from functools import cache
from typing import Any, get_type_hints

import numpy as np

from plycloth._check import Check

# Longer sequences are counted in a printed form, not listed.
LONGEST_SHOWN = 8


@dataclass(frozen=True, eq=False, repr=False)
class Description:
    """A frozen value: checked when made, compared and hashed by content, picklable.

    A subclass is a dataclass whose fields are annotated with a check each:
    `eta: Annotated[float, number(Range(1.01, 3.0))] = 1.5`. Its printed form names the fields
    that differ from their defaults.
    """

    def __post_init__(self) -> None:
        kind: Any = type(self)
        for name, check in _checks(kind).items():
            stored = check(f"{kind.__name__}.{name}", getattr(self, name))
            object.__setattr__(self, name, stored)

    def __eq__(self, other: object) -> bool:
        if type(self) is not type(other):
            return NotImplemented
        return all(_same(getattr(self, name), getattr(other, name)) for name in self._compared())

    def __hash__(self) -> int:
        content = (_hashable(getattr(self, name)) for name in self._compared())
        return hash((type(self), *content))

    def __repr__(self) -> str:
        shown = (
            f"{each.name}={_short(value)}"
            for each in fields(self)
            if each.repr and not _is_default(each, value := getattr(self, each.name))
        )
        return f"{type(self).__name__}({', '.join(shown)})"

    def __reduce__(self) -> tuple[Any, ...]:
        # Made anew, a copy is checked again and its arrays are read-only again.
        return type(self), tuple(getattr(self, each.name) for each in fields(self))

    def _compared(self) -> list[str]:
        return [each.name for each in fields(self) if each.compare]


@cache
def _checks(kind: type[Description]) -> dict[str, Check]:
    hints = get_type_hints(kind, include_extras=True)
    return {each.name: hints[each.name].__metadata__[0] for each in fields(kind)}


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return type(a) is type(b) and np.array_equal(a, b)
    return bool(a == b)


def _hashable(value: Any) -> Any:
    return (value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value


def _is_default(each: "Field[Any]", value: Any) -> bool:
    return each.default is not MISSING and _same(value, each.default)


def _short(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"<{' x '.join(map(str, value.shape))} array>"
    if isinstance(value, tuple) and len(value) > LONGEST_SHOWN:
        return f"<{len(value)} values, {len(set(value))} different>"
    return repr(value)
