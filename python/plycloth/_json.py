"""Descriptions to and from readable JSON files.

A file holds one object. Its key "plycloth" is the version of the format; every object's key "type"
is the name of a class, and its other keys are all the fields of that class. A weave pattern is
written as its rows from the top, '#' where the warp is on the face and '.' where the weft is; a
fabric's yarns that differ as the type "Yarns": each different one, and their order.
"""

from __future__ import annotations

import json
from dataclasses import fields
from os import PathLike
from pathlib import Path
from typing import Any, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from plycloth._check import hint, quoted
from plycloth._value import Description
from plycloth.bsdf import Bsdf
from plycloth.camera import Camera
from plycloth.fabric import Fabric
from plycloth.light import EnvironmentLight, Light
from plycloth.relax import Relaxed
from plycloth.rig import PhotoRig
from plycloth.scene import Scene, Swatch
from plycloth.weave import WeavePattern
from plycloth.yarn import Yarn
from plycloth.yarn_set import kinds_of

FORMAT = 1
MAX_EMBEDDED_PIXELS = 64
YARNS = "Yarns"

_KINDS: dict[str, type[Any]] = {
    kind.__name__: kind
    for kind in (
        WeavePattern,
        *get_args(Bsdf),
        *get_args(Yarn),
        Relaxed,
        Fabric,
        Swatch,
        *get_args(Camera),
        *get_args(Light),
        Scene,
        PhotoRig,
    )
}

# Keys that files of earlier versions lack; their fields then have their defaults.
_ADDED = {
    ("RoundYarn", "thickness_mm"),
    ("RoundYarn", "collision_radius_mm"),
    ("Fabric", "heights"),
    ("Scene", "background"),
}

T = TypeVar("T")


class FormatError(ValueError):
    """A file does not hold what it should, or a value cannot be written to a file."""


def save(value: Description | WeavePattern, path: str | PathLike[str]) -> None:
    """Write a pattern, BSDF, yarn, fabric, swatch, camera, light, scene or rig to a JSON file.

    Parameters
    ----------
    value
        What to write. An environment light that `EnvironmentLight.load` made names its image
        file, relative to the JSON file if it lies beside or below it; another one's image is
        written out if it has at most 64 x 64 pixels.
    path
        The file; one that exists is replaced.

    Raises
    ------
    TypeError
        If the value is nothing that can be saved.
    FormatError
        If an environment image is too large and in no file.
    OSError
        If the file cannot be written.
    """
    path = Path(path)
    _check_kind(value)
    document = {"plycloth": FORMAT, **_encode(value, path.parent)}
    path.write_text(_layout(document) + "\n", encoding="utf-8")


def load(path: str | PathLike[str]) -> Any:
    """Read what `save` wrote.

    Raises
    ------
    FormatError
        If the file holds no such value; the message names the file and the key.
    OSError
        If it cannot be opened.
    """
    return _Reader(Path(path)).read()


def load_as(kind: type[T], path: str | PathLike[str]) -> T:
    """Read what `save` wrote, and see that it is of this kind."""
    value = load(path)
    if not isinstance(value, kind):
        raise FormatError(f"{path}: holds a {type(value).__name__}, not a {kind.__name__}")
    return value


def _check_kind(value: Any) -> None:
    """See that `load` will know the type: a class that extends a known one is not known itself."""
    kind = type(value)
    if _KINDS.get(kind.__name__) is not kind:
        raise TypeError(
            f"save takes one of {', '.join(_KINDS)}, not a value of type {kind.__name__}"
        )


def _encode(value: Any, folder: Path) -> Any:
    if isinstance(value, WeavePattern):
        return {"type": "WeavePattern", "rows": _encode_rows(value.warp_up)}
    if isinstance(value, EnvironmentLight):
        image = _encode_image(value, folder)
        return {**_encode_fields(value, folder), "image": image}
    if isinstance(value, Description):
        return _encode_fields(value, folder)
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, tuple) and value and isinstance(value[0], get_args(Yarn)):
        kinds, order = kinds_of(value, len(value))
        yarns = [_encode(yarn, folder) for yarn in kinds]
        return {"type": YARNS, "yarns": yarns, "order": order.tolist()}
    if isinstance(value, tuple):
        return [_encode(part, folder) for part in value]
    return value


def _encode_fields(value: Description, folder: Path) -> dict[str, Any]:
    _check_kind(value)
    content = {name: _encode(getattr(value, name), folder) for name in _keys(type(value))}
    return {"type": type(value).__name__, **content}


def _keys(kind: type[Any]) -> list[str]:
    if kind is WeavePattern:
        return ["rows"]
    return [each.name for each in fields(kind) if each.compare]


def _encode_rows(warp_up: NDArray[np.bool_]) -> list[str]:
    return [row.tobytes().decode() for row in np.where(warp_up, b"#", b".")]


def _encode_image(light: EnvironmentLight, folder: Path) -> Any:
    if (path := light.current_file()) is not None:
        file, folder = path.resolve(), folder.resolve()
        inside = file.is_relative_to(folder)
        return {"file": (file.relative_to(folder) if inside else file).as_posix()}
    height, width, _ = light.image.shape
    if max(height, width) > MAX_EMBEDDED_PIXELS:
        raise FormatError(
            f"EnvironmentLight.image has {width} x {height} pixels, too many to write into JSON (at"
            f" most {MAX_EMBEDDED_PIXELS} x {MAX_EMBEDDED_PIXELS}), and is in no file: save the"
            " image first and make the light with EnvironmentLight.load"
        )
    # The shortest decimals that a float32 is read back from, not those of its float64.
    shortest = light.image.astype(str).astype(np.float64)
    return shortest.tolist()


def _layout(node: Any, indent: str = "") -> str:
    """Write JSON with a line for each key and each row, but vectors on one line."""
    inner = indent + "  "
    if isinstance(node, dict):
        lines = [f"{json.dumps(key)}: {_layout(value, inner)}" for key, value in node.items()]
        opening, closing = "{}"
    elif isinstance(node, list) and any(isinstance(part, list | dict | str) for part in node):
        lines = [_layout(part, inner) for part in node]
        opening, closing = "[]"
    else:
        return json.dumps(node, allow_nan=False)
    return f"{opening}\n{inner}" + f",\n{inner}".join(lines) + f"\n{indent}{closing}"


class _Reader:
    """Reads one file and remembers its name for the errors."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def read(self) -> Any:
        try:
            document = json.loads(self.path.read_bytes())
        except (ValueError, RecursionError) as error:
            raise self._error("", f"is not JSON: {error}") from error
        if not isinstance(document, dict) or "plycloth" not in document:
            raise self._error("", "is not a plycloth file: it has no key 'plycloth'")
        if (version := document.pop("plycloth")) != FORMAT:
            raise self._error("plycloth", f"must be the format {FORMAT}, not {quoted(version)}")
        return self._object(document, "")

    def _decode(self, node: Any, where: str) -> Any:
        if isinstance(node, dict):
            return self._object(node, where)
        if isinstance(node, list) and any(isinstance(part, dict) for part in node):
            return [self._decode(part, f"{where}[{i}]") for i, part in enumerate(node)]
        return node

    def _object(self, node: dict[str, Any], where: str) -> Any:
        if node.get("type") == YARNS:
            return self._yarns(node, where)
        kind = self._kind(node, where)
        content = {key: value for key, value in node.items() if key != "type"}
        self._check_keys(content, _keys(kind), kind.__name__, where)
        if kind is WeavePattern:
            return self._pattern(content["rows"], where)
        if kind is EnvironmentLight and isinstance(content["image"], dict):
            return self._environment(content, where)
        values = {key: self._decode(value, _join(where, key)) for key, value in content.items()}
        try:
            return kind(**values)
        except (ValueError, TypeError) as error:
            raise self._error(where, str(error)) from error

    def _yarns(self, node: dict[str, Any], where: str) -> list[Any]:
        self._check_keys(node, ["type", "yarns", "order"], YARNS, where)
        yarns, order = node["yarns"], node["order"]
        if not isinstance(yarns, list) or not isinstance(order, list):
            raise self._error(where, "yarns and order must be lists")
        kinds = self._decode(yarns, _join(where, "yarns"))
        for i, number in enumerate(order):
            if type(number) is not int or not 0 <= number < len(kinds):
                problem = f"must be a whole number from 0 to {len(kinds) - 1}, not {quoted(number)}"
                raise self._error(_join(where, f"order[{i}]"), problem)
        return [kinds[number] for number in order]

    def _kind(self, node: dict[str, Any], where: str) -> type[Any]:
        name = node.get("type")
        if not isinstance(name, str):
            raise self._error(where, f"needs a key 'type', one of {', '.join(_KINDS)}")
        if name not in _KINDS:
            problem = f"{quoted(name)} is unknown; {hint(name, _KINDS)}"
            raise self._error(_join(where, "type"), problem)
        return _KINDS[name]

    def _check_keys(self, node: dict[str, Any], keys: list[str], kind: str, where: str) -> None:
        for key in node:
            if key not in keys:
                raise self._error(where, f"{kind} has no key {quoted(key)}; {hint(key, keys)}")
        for key in keys:
            if key not in node and (kind, key) not in _ADDED:
                raise self._error(where, f"{kind} lacks the key {key!r}")

    def _pattern(self, rows: Any, where: str) -> WeavePattern:
        if isinstance(rows, str):
            raise self._error(where, "rows must be a list of rows such as '#.#.', not a text")
        try:
            return WeavePattern.from_rows(rows)
        except ValueError as error:
            raise self._error(where, str(error)) from error

    def _environment(self, content: dict[str, Any], where: str) -> EnvironmentLight:
        image = _join(where, "image")
        self._check_keys(content["image"], ["file"], "an image", image)
        file = content["image"]["file"]
        if not isinstance(file, str):
            raise self._error(
                _join(image, "file"), f"must be the name of a file, not {quoted(file)}"
            )
        try:
            return EnvironmentLight.load(
                self.path.parent / file, scale=content["scale"], rotation=content["rotation"]
            )
        except OSError as error:
            raise self._error(image, str(error)) from error
        except (ValueError, TypeError) as error:
            raise self._error(where, str(error)) from error

    def _error(self, where: str, message: str) -> FormatError:
        place = f"{self.path}: {where}" if where else f"{self.path}"
        return FormatError(f"{place}: {message}")


def _join(where: str, key: str) -> str:
    return f"{where}.{key}" if where else key
