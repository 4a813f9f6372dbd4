"""What a type checker and `help` say of plycloth: the documents' code passes, names are short."""

import ast
import dataclasses
import inspect
import re
import subprocess
import sys
import textwrap
from pathlib import Path

import plycloth as pc
import pytest

ROOT = Path(__file__).parents[1]
DOCUMENTS = ("README.md", "docs/guide.md")

# What the documents have no room for.
MORE = """\
import numpy as np
import plycloth as pc

yarn = pc.RoundYarn(0.2, pc.PlyBsdf(base_color=0.5, roughness=0.3))
pc.Fabric(pc.WeavePattern.plain(), yarn, yarn, [0.4, 0.5], 0.5, warp_colors=[[1, 0, 0], [0, 0, 1]])
pc.Draft(pc.WeavePattern.plain(), (1, 0, 0), (0, 0, 1), 1, 1, 0.8, 0.8)
pc.PointLight(np.zeros(3), intensity=1)
pc.RectangleLight([0, 0, 2], (1, 0, 0), (0, 1, 0), radiance=[1, 1, 0.9])
pc.EnvironmentLight(np.ones((2, 4, 3)))
pc.Image([[[0.5, 0.5, 0.5]]])
width: float = pc.PointLight((0, 0, 1), 1).intensity[0]
"""

MISTAKES = """\
import plycloth as pc

pc.ConstantLight("bright")
pc.PlyBsdf(base_colour=0.5)
pc.PerspectiveCamera(1, 2)
"""


def program(document):
    text = (ROOT / document).read_text(encoding="utf-8")
    return "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))


def test_code_of_the_documents_passes_a_strict_type_checker(tmp_path):
    programs = {Path(name).stem.lower(): program(name) for name in DOCUMENTS}
    for name, text in {**programs, "more": MORE, "mistakes": MISTAKES}.items():
        (tmp_path / f"{name}.py").write_text(text, encoding="utf-8")
    # The settings are plycloth's own: they say which libraries have no types.
    command = [sys.executable, "-m", "mypy", "--strict", "--config-file", "pyproject.toml"]
    result = subprocess.run(
        [*command, *tmp_path.glob("*.py")], cwd=ROOT, capture_output=True, text=True, check=False
    )
    errors = [line for line in result.stdout.splitlines() if ": error: " in line]
    places = [re.match(r"(.*?):(\d+):", Path(error).name).groups() for error in errors]
    assert [f"{file}:{line}" for file, line in places] == [
        "mistakes.py:3", "mistakes.py:4", "mistakes.py:5", "mistakes.py:5"
    ], result.stdout + result.stderr  # fmt: skip


def public():
    """Every public class and function, and every public method."""
    for name in pc.__all__:
        value = getattr(pc, name)
        if inspect.isfunction(value):
            yield pytest.param(value, id=name)
        elif inspect.isclass(value) and not issubclass(value, Exception):
            yield pytest.param(value, id=name)
            for method in vars(value):
                if not method.startswith("_") and callable(getattr(value, method)):
                    yield pytest.param(getattr(value, method), id=f"{name}.{method}")


@pytest.mark.parametrize("value", list(public()))
def test_signatures_that_help_shows_are_readable(value):
    signature = inspect.signature(value)
    assert not re.search(r"<|\bat 0x|\b(typing|numpy|plycloth)\b", str(signature))
    for parameter in signature.parameters.values():
        assert len(inspect.formatannotation(parameter.annotation)) <= 44, parameter


def declared(kind):
    """The constructor that a description declares to type checkers, if it does so."""
    (tree,) = ast.parse(textwrap.dedent(inspect.getsource(kind))).body
    blocks = [node for node in tree.body if isinstance(node, ast.If)]
    return next((block.body[0].args for block in blocks), None)


@pytest.mark.parametrize(
    "kind", [value for value in vars(pc).values() if dataclasses.is_dataclass(value)]
)
def test_declared_constructors_are_those_of_the_fields(kind):
    arguments = declared(kind)
    if arguments is None:
        return
    fields = dataclasses.fields(kind)
    assert [each.arg for each in arguments.args] == ["self", *(each.name for each in fields)]
    optional = [each for each in fields if each.default is not dataclasses.MISSING]
    assert len(arguments.defaults) == len(optional)
