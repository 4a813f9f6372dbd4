"""Values and gradients of cell averages: those of the core, by name, and those of renders."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import plycloth as pc
import pytest
from plycloth import _plycloth
from plycloth.cells import cell_averages
from plycloth.shared_cloth import compiled_scene
from samples import TINTED, plain_fabric

# Whether its yarns fit side by side is all the same to a gradient.
pytestmark = pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")

WARP = TINTED
WEFT = replace(WARP, base_color=(0.2, 0.5, 0.6), roughness=(0.4, 0.3))
SMOOTH = ("base_color", "transmitted_color", "extinction", "roughness", "body_reflection")


def scene(warp=WARP, weft=WEFT):
    yarns = [pc.RoundYarn(0.11, bsdf, plies=1) for bsdf in (warp, weft)]
    fabric = plain_fabric(warp=yarns[0], weft=yarns[1], weft_spacing_mm=0.25)
    return pc.photo_rig(fabric, "front", resolution=(64, 48))


def shifted(bsdf, field, part, step):
    parts = np.array(np.ravel(getattr(bsdf, field)))
    parts[part] += step
    return replace(bsdf, **{field: tuple(parts) if parts.size > 1 else float(parts[0])})


@pytest.mark.parametrize("field", SMOOTH)
def test_derivatives_stand_under_their_names(field):
    """Beside differences of averages along the same paths, whose error is of the second order."""
    _, gradient = pc.value_and_gradient(scene(), cells=(2, 3), paths=64, seed=5)
    tape = _plycloth.CompiledTape(compiled_scene(scene()), (3, 2), 64, 5, None)
    for yarns, name in enumerate(("warp", "weft")):
        ours = gradient[f"{name}.{field}"].reshape(2, 3, 3, -1)
        for part in range(ours.shape[-1]):
            ends = []
            for step in (1e-4, -1e-4):
                bsdfs = [WARP, WEFT]
                bsdfs[yarns] = shifted(bsdfs[yarns], field, part, step)
                ends.append(tape.evaluate(bsdfs)[0])
            expected = (ends[0] - ends[1]) / 2e-4
            np.testing.assert_allclose(ours[..., part], expected, rtol=1e-4, atol=1e-7)


def test_values_and_gradients_are_those_of_renders():
    """Of the mean picture by the base colour, from renders with 10% more and less of it."""
    values, gradient = pc.value_and_gradient(scene(), ["base_color"], cells=1, paths=8192)

    def mean(factor, seed):
        bsdfs = [
            replace(bsdf, base_color=tuple(factor * c for c in bsdf.base_color))
            for bsdf in (WARP, WEFT)
        ]
        image = pc.render(scene(*bsdfs), spp=64, seed=seed, progress=False)
        error = np.sqrt(image.variance.sum(axis=(0, 1), dtype=float)) / (64 * 48)
        return cell_averages(image.pixels, 1)[0, 0], error

    (here, noise), (more, up), (less, down) = mean(1.0, 1), mean(1.1, 2), mean(0.9, 3)
    # The averages' own noise is below that of the render, which has 24 times the paths, twice.
    assert (np.abs(values[0, 0] - here) < 5 * 5 * noise).all()
    colors = np.array([WARP.base_color, WEFT.base_color])
    _, each = pc.value_and_gradient(
        scene(), ["warp.base_color", "weft.base_color"], cells=1, paths=8192
    )
    slope = sum(
        each[f"{name}.base_color"][0, 0] @ color
        for name, color in zip(("warp", "weft"), colors, strict=True)
    )
    error = np.hypot(up, down) / 0.2
    assert (np.abs(slope - (more - less) / 0.2) < 4 * error + 0.05 * np.abs(slope)).all()
    np.testing.assert_allclose(gradient["base_color"], sum(each.values()), rtol=1e-12)


def test_shapes_are_those_of_grid_and_parameter():
    values, gradient = pc.value_and_gradient(scene(), cells=(2, 3), paths=8)
    assert values.shape == (2, 3, 3)
    assert len(gradient) == 18
    assert gradient["warp.eta"].shape == (2, 3, 3)
    assert gradient["weft.base_color"].shape == (2, 3, 3, 3)
    assert gradient["weft.roughness"].shape == (2, 3, 3, 2)
    # The red of a picture depends on the red of a colour alone.
    assert not gradient["warp.base_color"][..., 0, 1].any()
    assert pc.value_and_gradient(scene(), [], cells=2, paths=8)[1] == {}


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"by": ["color"]}, "a free parameter must be one of .* not 'color'"),
        ({"by": ["wrap.eta"]}, "a set of yarns .* the nearest is 'warp'"),
        ({"by": "eta"}, "by must be a list of names"),
        ({"cells": 0}, r"cells\[0\] must be in \[1, 4096\]"),
        ({"cells": (2, 3, 4)}, "cells must be 2 numbers"),
        ({"paths": 2**20}, r"paths must be in \[1, 65536\]"),
        ({"seed": -1}, "seed must be in"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises((pc.ParameterError, TypeError), match=message):
        pc.value_and_gradient(scene(), **options)


def test_other_scenes_are_refused():
    with pytest.raises(TypeError, match="scene must be a Scene, not Fabric"):
        pc.value_and_gradient(plain_fabric())
    with pytest.raises(pc.ParameterError, match="PlyBsdf on warp and weft"):
        pc.value_and_gradient(scene(weft=pc.DiffuseBsdf()))


class Tensor(np.ndarray):
    """As much of a tensor as the example's own function needs."""

    def detach(self):
        return self


def test_the_example_for_pytorch_passes_gradients_on(monkeypatch):
    """With numpy in the place of PyTorch: its two ways give the slope of a loss."""
    fake = type(sys)("torch")
    fake.autograd = type("autograd", (), {"Function": object})
    fake.from_numpy = np.asarray
    fake.tensordot = lambda a, b, dims: np.tensordot(a, b, dims)
    monkeypatch.setitem(sys.modules, "torch", fake)
    names = {"__name__": "example"}
    source = Path(__file__).parents[1] / "examples" / "pytorch_fit.py"
    exec(compile(source.read_text(encoding="utf-8"), str(source), "exec"), names)
    context = type("Context", (), {})()
    color = np.array([0.5, 0.4, 0.3]).view(Tensor)
    values = names["Cells"].forward(context, color, names["cloth"](0.5), 3)
    slope, *others = names["Cells"].backward(context, 2 * values)
    _, gradient = pc.value_and_gradient(
        names["cloth"](tuple(color)), ["base_color"], cells=8, paths=64, seed=3
    )
    np.testing.assert_allclose(
        slope, np.einsum("ijk,ijkl->l", 2 * values, gradient["base_color"]), rtol=1e-12
    )
    assert others == [None, None]


def test_the_example_says_what_it_needs():
    command = [sys.executable, "-c", "import sys; sys.modules['torch'] = None; import pytorch_fit"]
    folder = Path(__file__).parents[1] / "examples"
    result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "needs PyTorch" in result.stderr
