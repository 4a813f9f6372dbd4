"""The floors of the core: which module of src/ may use which, read from the sources."""

import re
from pathlib import Path

import pytest

SRC = Path(__file__).parents[1] / "src"

# From the bottom up; modules on one line are neighbours and do not use each other. The ground
# (errors, the stop flag, picture files) may be used from every floor and uses none of them.
GROUND = {"control", "error", "image", "memory"}
FLOORS = [{"math", "sampling"}, {"accel"}, {"weave", "scatter"}, {"cloth"}, {"render"}, {"python"}]
LEVEL = {name: level for level, names in enumerate(FLOORS, start=1) for name in names}

SOURCES = sorted(path.relative_to(SRC).as_posix() for path in SRC.rglob("*.rs"))

COMMENT = re.compile(r"//[^\n]*")
# A path into the crate, `crate::render::path` or `crate::{error, math::rng}`, in a use or in code.
CRATE_PATH = re.compile(r"\bcrate::(\{(?:[^{}]|\{[^{}]*\})*\}|\w+)")
SUPER_PATH = re.compile(r"\b((?:super::)+)(\w+)")


def module_of(source):
    """The module path of a source file, `weave/relax/strain.rs` being weave, relax, strain."""
    parts = Path(source).with_suffix("").parts
    return parts[:-1] if parts[-1] == "mod" else parts


def used_modules(source, text):
    """The top-level modules that a source file names, its own among them."""
    code = COMMENT.sub("", text)
    used = set()
    for names in CRATE_PATH.findall(code):
        inside = re.sub(r"::\{[^{}]*\}", "", names.strip("{}"))
        used |= {name.split("::")[0].strip() for name in inside.split(",")} - {""}
    for supers, name in SUPER_PATH.findall(code):
        # As many as lead to the crate's root; an inline `mod tests` is one deeper than its file.
        if supers.count("super") == len(module_of(source)):
            used.add(name)
    return used & {path.stem if path.is_file() else path.name for path in SRC.iterdir()}


def violations(source, text):
    """The modules that a source file uses although they are not below it."""
    own = module_of(source)[0]
    if own == "lib":
        return set()
    own_level = LEVEL.get(own, 0)
    return {m for m in used_modules(source, text) - {own} - GROUND if LEVEL[m] >= own_level}


def test_every_module_has_a_floor():
    modules = {module_of(source)[0] for source in SOURCES} - {"lib"}
    assert modules == GROUND | set(LEVEL)


@pytest.mark.parametrize("source", SOURCES)
def test_floors_import_only_downwards(source):
    assert violations(source, (SRC / source).read_text(encoding="utf-8")) == set()


@pytest.mark.parametrize("source", [s for s in SOURCES if not s.startswith("python/")])
def test_only_the_bindings_name_python(source):
    assert not re.search(r"\b(pyo3|numpy)\b", (SRC / source).read_text(encoding="utf-8"))


@pytest.mark.parametrize("source", [s for s in SOURCES if s != "accel/bvh.rs"])
def test_only_one_file_names_obvhs(source):
    assert "obvhs" not in (SRC / source).read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("source", "text", "found"),
    [
        ("cloth/swatch.rs", "use crate::render::scene::Scene;", {"render"}),
        ("cloth/swatch.rs", "use crate::accel::ray::Ray;", set()),
        ("weave/curve.rs", "use crate::scatter::ggx::Ggx;", {"scatter"}),
        (
            "math/rng.rs",
            "use crate::{error::Result, accel::{ray, bvh}, cloth};",
            {"accel", "cloth"},
        ),
        ("accel/ray.rs", "let scene = crate::render::scene::Scene::new();", {"render"}),
        ("accel/ray.rs", "use super::super::cloth::grid::walk;", {"cloth"}),
        ("accel/ray.rs", "// As crate::render does.\nuse super::bvh::Bvh;", set()),
        ("error.rs", "use crate::math::color::Rgb;", {"math"}),
        ("image.rs", "use crate::error::Error;", set()),
    ],
)
def test_a_breach_is_seen(source, text, found):
    assert violations(source, text) == found
