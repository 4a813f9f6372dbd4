"""Fits: hidden parameters come back, gradients are those of the objective, bad input is named."""

from dataclasses import replace
from functools import cache

import numpy as np
import plycloth as pc
import pytest
from plycloth.cells import cell_averages
from plycloth.fit import _Point, _Problem, _Space
from plycloth.lens import Lens
from plycloth.unknowns import EXPOSURE, FALLOFF, OPTICAL, lens_unknowns, unknowns, with_values
from samples import TINTED, plain_fabric

# Whether its yarns fit side by side is all the same to a fit.
pytestmark = pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")

SIDES = ("front", "back")
FRONT = ("front",)
HIDDEN = replace(TINTED, body_reflection=0.6)


def scenes(bsdf, sides=SIDES):
    yarn = pc.RoundYarn(0.11, bsdf, plies=1)
    fabric = plain_fabric(warp=yarn, weft=yarn, weft_spacing_mm=0.25)
    return [pc.photo_rig(fabric, side, resolution=(64, 64)) for side in sides]


def pictures(bsdf, spp=256, sides=SIDES):
    return [
        pc.render(scene, spp=spp, seed=11, both_sides=True, progress=False)
        for scene in scenes(bsdf, sides)
    ]


@cache
def told():
    """A fit to renders with another seed, and what they hide."""
    start = replace(HIDDEN, base_color=0.5, roughness=(0.35, 0.35), eta=1.6, extinction=8.0)
    result = pc.fit(
        scenes(start),
        pictures(HIDDEN, spp=4096),
        free=["base_color", "roughness", "eta", "extinction"],
        tie=True,
        paths=8192,
        rounds=8,
        progress=False,
    )
    hidden = [HIDDEN.eta, *HIDDEN.base_color, HIDDEN.extinction, *HIDDEN.roughness]
    return result, hidden


@pytest.mark.slow
def test_what_the_pictures_tell_is_found_within_5_percent():
    """`benches/recovery.py` looks for all parameters of a cloth."""
    result, hidden = told()
    for estimate, value in zip(result.estimates, hidden, strict=True):
        assert estimate.identifiable
        assert estimate.value == pytest.approx(value, rel=0.05), estimate.label
        # Not too sure of itself.
        assert abs(estimate.value - value) < 4.0 * estimate.uncertainty, estimate.label
    assert result.fabric.warp.bsdf == result.fabric.weft.bsdf == result.bsdfs[0]
    assert "<table>" in result._repr_html_()


@pytest.mark.slow
@pytest.mark.xfail(
    strict=True,
    reason="just over 3% is stated for the roughness across, which trades with eta, because of the"
    " noise of paths that pass from ply to ply",
)
def test_what_the_pictures_tell_is_known_to_3_percent():
    result, hidden = told()
    for estimate, value in zip(result.estimates, hidden, strict=True):
        assert estimate.uncertainty < 0.03 * value, estimate.label


def test_what_trades_with_what_is_said():
    """Light through a ply is tinted by k_x^S k_y^S: with the mirrored light black, one number."""
    black = replace(HIDDEN, base_color=0.0, transmitted_color=0.0)
    result = pc.fit(
        scenes(black, ("back",)),
        pictures(black, spp=16, sides=("back",)),
        free=["warp.specular_tint", "warp.transmission_tint"],
        paths=64,
        rounds=1,
        progress=False,
    )
    (red,) = (e for e in result.estimates if e.label == "warp.specular_tint.red")
    assert "warp.transmission_tint.red" in red.partners
    assert red.doubt.startswith("±") == red.identifiable


@pytest.mark.parametrize(
    "changes",
    [
        {"free": ["eta"], "tie": True},
        {"free": ["warp.extinction"], "objective": "average"},
        {"free": ["warp.body_reflection"], "cells": 1},
        {"free": [], "exposure": True},
        {"free": [], "falloff": "shared", "objective": "average"},
        {"free": None, "objective": "average"},
    ],
    ids=lambda changes: ", ".join(map(str, changes.values())),
)
def test_any_number_of_unknowns_may_be_looked_for(changes):
    """One alone; and 38 where one picture's average has three numbers."""
    front = scenes(HIDDEN, FRONT)
    image = pictures(replace(HIDDEN, base_color=0.4), spp=16, sides=FRONT)
    given = {"cells": 4, "paths": 16, "rounds": 3, "evaluations": 2, "progress": False}
    result = pc.fit(front, image, **given | changes)
    assert len(result.estimates) == (38 if changes["free"] is None else 1)
    assert np.isfinite([(e.value, e.uncertainty) for e in result.estimates]).all()


def test_one_unknown_is_found():
    result = pc.fit(
        scenes(HIDDEN, FRONT),
        [2.0 * pictures(HIDDEN, spp=1024, sides=FRONT)[0].pixels],
        free=[],
        exposure=True,
        paths=256,
        rounds=6,
        progress=False,
    )
    (exposure,) = result.estimates
    assert abs(exposure.value - 2.0) < 4.0 * exposure.uncertainty
    assert exposure.identifiable
    assert exposure.uncertainty < 0.02


def test_an_unknown_that_no_picture_shows_is_said_not_to_be_told():
    """The part of a body's light that comes back, where none does."""
    black = replace(HIDDEN, base_color=0.0, transmitted_color=0.0)
    result = pc.fit(
        scenes(black, FRONT),
        pictures(black, spp=16, sides=FRONT),
        free=["body_reflection"],
        bounds={"body_reflection": (0.2, 0.8)},
        tie=True,
        paths=16,
        rounds=2,
        progress=False,
    )
    (reflection,) = result.estimates
    assert not reflection.identifiable
    assert reflection.uncertainty == pytest.approx(0.6)


def problem(lenses):
    """A problem with all unknowns free, recorded at its start."""
    start = _Point([HIDDEN, replace(HIDDEN, eta=1.6)], lenses)
    everything = _Problem(
        scenes=scenes(HIDDEN),
        targets=[np.full((4, 4, 3), 0.3), np.full((4, 4, 3), 0.2)],
        space=_Space(
            start, unknowns(None, tie=False, bounds={}), lens_unknowns(True, "each", range(2))
        ),
        paths=64,
        max_depth=5,
        weights=[1.0, 0.4],
        threads=None,
    )
    u = everything.space.encode(start)
    # The fabric has one BSDF in its scenes; the recording sees those of the start.
    return everything, u, everything.record(u, 5)


def test_the_gradient_is_that_of_the_objective():
    everything, start, tapes = problem([Lens(1.3, 0.4), Lens(1.3, 0.2)])
    assert start.size == 2 * 19 + 3
    u = np.clip(start + 0.02 * np.sin(np.arange(start.size)), 0.01, 0.99)
    gradient = everything.model(tapes, u).gradient
    for i, label in enumerate(everything.space.labels):
        if label.endswith(".eta"):
            # What comes over the horizon of microfacets shows in pictures alone (tests/tape.rs).
            continue
        step = np.zeros_like(u)
        step[i] = 1e-6
        plus, minus = (everything.model(tapes, u + sign * step).value for sign in (1, -1))
        expected = (plus - minus) / 2e-6
        scale = max(abs(expected), 1e-3 * np.abs(gradient).max())
        assert abs(gradient[i] - expected) < 1e-4 * scale, (label, gradient[i], expected)


def test_averages_at_the_start_are_those_of_the_picture():
    everything, u, _ = problem([Lens(), Lens()])
    everything = replace(everything, paths=4096, max_depth=None)
    tapes = everything.record(u, 9)
    rendered = [
        pc.render(s, spp=64, seed=2, both_sides=True, progress=False)
        for s in (s.with_bsdfs(*everything.space.decode(u).bsdfs) for s in everything.scenes)
    ]
    for i, (tape, picture) in enumerate(zip(tapes, rendered, strict=True)):
        cells, _ = everything.cells(tape[0], i, u)
        expected = cell_averages(picture.pixels.astype(float), 4)
        assert abs(cells.mean() / expected.mean() - 1.0) < 0.03


@pytest.mark.parametrize("parameter", [*OPTICAL, EXPOSURE, FALLOFF], ids=lambda p: p.name)
def test_units_map_to_ranges_and_back(parameter):
    for u in np.linspace(0.0, 1.0, 11):
        value = parameter.from_unit(u)
        assert parameter.low <= value <= parameter.high
        assert abs(parameter.to_unit(value) - u) < 1e-12
        if 0.05 < u < 0.95:
            slope = (parameter.from_unit(u + 1e-6) - parameter.from_unit(u - 1e-6)) / 2e-6
            assert abs(parameter.slope(value) / slope - 1.0) < 1e-6


def test_values_go_where_their_labels_say():
    free = unknowns(["warp.eta", "roughness"], tie=False, bounds={})
    assert [u.label for u in free] == [
        "warp.eta",
        "warp.roughness.along",
        "warp.roughness.across",
        "weft.roughness.along",
        "weft.roughness.across",
    ]
    warp, weft = with_values([HIDDEN, HIDDEN], free, [1.7, 0.1, 0.2, 0.3, 0.4])
    assert warp == replace(HIDDEN, eta=1.7, roughness=(0.1, 0.2))
    assert weft == replace(HIDDEN, roughness=(0.3, 0.4))


def test_the_lens_darkens_corners():
    gain, slope = Lens(2.0, 0.5).gain((16, 16))
    assert gain[8, 8, 0] == pytest.approx(2.0, abs=0.01)
    assert gain[0, 0, 0] == pytest.approx(2.0 * np.exp(-0.5 * (15 / 16) ** 2), rel=0.01)
    brighter, darker = (Lens(2.0, falloff).gain((16, 16))[0] for falloff in (0.499, 0.501))
    difference = (darker - brighter) / 0.002
    assert np.allclose(slope, difference, rtol=1e-5)


def test_a_picture_whose_lens_is_known_tells_brightness_from_exposure():
    """Both pictures are three times as bright as the start; of one, the exposure is known."""
    start = replace(HIDDEN, base_color=0.2, transmitted_color=0.2, specular_tint=0.2)
    brighter = [pc.Image(3.0 * image.pixels) for image in pictures(start, spp=16, sides=FRONT)]
    options = {"free": [], "exposure": True, "falloff": "each", "paths": 32, "rounds": 4}
    found = pc.fit(
        scenes(start, FRONT) * 2,
        brighter * 2,
        lenses=[Lens(), Lens(2.0, 0.1)],
        fixed_lenses=[1],
        cells=[8, 4],
        bounds={"exposure": (0.5, 5.0)},
        progress=False,
        **options,
    )
    assert found.lenses[0].exposure == pytest.approx(3.0, rel=0.1)
    assert found.lenses[1] == Lens(2.0, 0.1)
    assert [estimate.label for estimate in found.estimates] == ["exposure", "falloff.1"]
    assert [match.target.shape for match in found.matches] == [(8, 8, 3), (4, 4, 3)]
    bounded = pc.fit(
        scenes(start, FRONT), brighter, bounds={"exposure": (0.5, 2.0)}, progress=False, **options
    )
    assert bounded.lenses[0].exposure == pytest.approx(2.0, rel=0.01)


def test_cell_averages_keep_the_mean_and_the_places():
    pixels = np.arange(6 * 4 * 3, dtype=float).reshape(6, 4, 3)
    cells = cell_averages(pixels, 2)
    assert np.allclose(cells[0, 1], pixels[:3, 2:].mean((0, 1)))
    assert cells.mean() == pytest.approx(pixels.mean())


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"free": ["etta"]}, "free parameter must be one of .*'eta'"),
        ({"free": ["warp.etta"]}, "nearest is 'eta'"),
        ({"free": ["warps.eta"]}, "nearest is 'warp'"),
        ({"free": ["eta", "warp.eta"]}, "twice"),
        ({"free": ["warp.eta"], "tie": True}, "tie=True"),
        ({"free": []}, "at least one parameter"),
        ({"bounds": {"eta": (2.0, 1.5)}}, "low < high"),
        ({"bounds": {"roughness": (0.0, 1.0)}}, "bounds of roughness"),
        ({"bounds": {"shine": (0.0, 1.0)}}, "bounded parameter"),
        ({"bounds": {"eta": (0.5, 1.5)}}, r"PlyBsdf.eta must be in \[1.01, 3\], not 0.5"),
        ({"bounds": {"eta": (1.2, np.nan)}}, r"bounds of eta\[1\] must be finite"),
        ({"bounds": {"exposure": (2.0, 1.0)}}, "bounds of exposure must be .* 0 < low < high"),
        ({"bounds": {"exposure": (0.0, 1.0)}}, "bounds of exposure must be .* 0 < low < high"),
        ({"fixed_lenses": [1]}, r"fixed_lenses\[0\] must be in \[0, 0\], not 1"),
        ({"cells": [4, 4]}, "cells must be 1 numbers, not 2"),
        ({"falloff": "both"}, "falloff"),
        ({"lenses": [Lens(), Lens()]}, "lenses must be one per scene: 1, not 2"),
        ({"threads": 0}, "threads"),
        ({"weights": [1.0, 1.0]}, "weights must be 1 numbers, not 2"),
        ({"weights": [0.0]}, r"weights\[0\] must be finite and greater than 0"),
        ({"objective": "mean"}, "objective"),
        ({"paths": 0}, "paths"),
        ({"cells": 0}, "cells"),
        ({"cells": 33}, "at least 33 rows"),
        ({"rounds": 0}, "rounds"),
        ({"images": np.ones((32, 32))}, r"H x W x 3"),
        ({"images": np.ones((8, 8, 3))}, "at least 16 rows"),
        ({"images": np.full((32, 32, 3), np.nan)}, "finite"),
        ({"images": np.full((32, 32, 3), -1.0)}, "at least 0"),
        ({"images": np.zeros((32, 32, 3))}, "black"),
        ({"images": [np.ones((32, 32, 3))] * 2}, "one per scene"),
        ({"scenes": []}, "at least one scene"),
    ],
)
def test_bad_input_is_named(changes, message):
    given = {"scenes": scenes(HIDDEN, FRONT), "images": [np.ones((32, 32, 3))], "progress": False}
    with pytest.raises(pc.ParameterError, match=message):
        pc.fit(**(given | changes))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"scenes": "front"}, "scenes must be a Scene or a list"),
        ({"scenes": [1]}, "scenes must be a Scene or a list"),
        ({"images": ["front.png"]}, r"images\[0\] must be an Image or an array"),
        ({"free": "eta"}, "free must be a list of names"),
        ({"free": [1]}, "free must be a list of names"),
        ({"bounds": [("eta", 1)]}, "bounds must be a dict"),
        ({"bounds": {"eta": 1.5}}, "bounds of eta must be 2 numbers"),
        ({"lenses": [(1.0, 0.0)]}, "lenses must be a list of Lens"),
        ({"fixed_lenses": 0}, "fixed_lenses must be a list of numbers of pictures"),
        ({"threads": "all"}, "threads must be an integer"),
    ],
)
def test_input_of_the_wrong_kind_is_named(changes, message):
    given = {"scenes": scenes(HIDDEN, FRONT), "images": [np.ones((32, 32, 3))], "progress": False}
    with pytest.raises(TypeError, match=message):
        pc.fit(**(given | changes))


def test_scenes_must_show_one_fabric_of_plies():
    images = [np.ones((32, 32, 3))] * 2
    two = [scenes(HIDDEN)[0], scenes(replace(HIDDEN, eta=1.7))[1]]
    with pytest.raises(pc.ParameterError, match="same fabric"):
        pc.fit(two, images, progress=False)
    diffuse = scenes(HIDDEN, FRONT)[0]
    yarn = pc.RoundYarn(0.1, pc.DiffuseBsdf())
    fabric = plain_fabric(warp=yarn)
    with pytest.raises(pc.ParameterError, match="PlyBsdf"):
        pc.fit(replace(diffuse, swatch=pc.Swatch(fabric)), images[0], progress=False)
    colored = plain_fabric(warp_colors=np.ones((2, 3)))
    with pytest.raises(pc.ParameterError, match="warp_colors"):
        pc.fit(replace(diffuse, swatch=pc.Swatch(colored)), images[0], progress=False)
