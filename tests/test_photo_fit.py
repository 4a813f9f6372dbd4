"""The photo rig, and the search around the optical fit."""

import json

import numpy as np
import plycloth as pc
import pytest
from plycloth import photo_search
from plycloth.cells import cell_averages
from plycloth.photo_guess import find_threads, guess_geometries, usual_width
from plycloth.photo_placement import Placement, find_placement
from plycloth.photo_search import Effort

# Its cloth is what is measured or guessed, whether yarns overlap in it or not.
pytestmark = pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")

SATIN = pc.Geometry(
    "5-end satin",
    pc.WeavePattern.satin(5, 2),
    pc.YarnGuess(flat=True, cover=0.9),
    pc.YarnGuess(flat=False, cover=0.4),
    0.05,
    0.05,
)
SHINY = pc.PlyBsdf(extinction=200.0, roughness=(0.1, 0.8), exit_roughness=(0.1, 0.8))


def picture(side, **placed):
    scene = pc.photo_rig(SATIN.fabric((SHINY, SHINY)), side, resolution=(32, 32), **placed)
    return pc.render(scene, spp=64, both_sides=True, progress=False)


def test_turned_cloth_turns_its_picture():
    """The lamp behind the middle sees no other change."""
    straight, turned = (
        cell_averages(picture("back", rotation=angle).pixels.astype(float), 4)
        for angle in (0.0, 90.0)
    )
    expected = np.rot90(straight)
    difference = np.abs(turned - expected).mean() / expected.mean()
    assert difference < 0.07
    # The highlight is a band across the warp: without the turn, all is different.
    assert np.abs(turned - straight).mean() / expected.mean() > 0.15


def test_the_front_lamp_lights_the_upper_half_and_moves():
    rows = picture("front").pixels.mean((1, 2))
    assert rows[:16].mean() > 1.1 * rows[16:].mean()
    moved = picture("front", lamp_offset=(0.0, -16.0, 0.0)).pixels.mean((1, 2))
    assert moved[16:].mean() > 1.1 * moved[:16].mean()


def test_another_rig_has_other_places():
    rig = pc.PhotoRig(camera_height=300, field_of_view=20, front_lamp=(0, 100, 400), intensity=1e5)
    scene = pc.photo_rig(SATIN.fabric((SHINY, SHINY)), "front", rig=rig, resolution=(30, 40))
    assert scene.camera.origin == (0, 0, 300)
    assert scene.lights[0].position == (0, 100, 400)
    # A picture taller than wide is filled as well.
    assert scene.swatch.extent_mm[0] >= rig.picture_width * 40 / 30
    with pytest.raises(pc.ParameterError, match=r"front_lamp must have z > 0, not -1"):
        pc.PhotoRig(front_lamp=(0, 0, -1))
    with pytest.raises(pc.ParameterError, match=r"back_lamp must have z < 0, not 2"):
        pc.PhotoRig(back_lamp=(0, 0, 2))


def test_unknown_lamps_are_named():
    with pytest.raises(pc.ParameterError, match="nearest is 'front'"):
        pc.photo_rig(SATIN.fabric((SHINY, SHINY)), "fronts")


@pytest.mark.parametrize(
    ("placed", "error", "message"),
    [
        ({"rotation": np.nan}, pc.ParameterError, "rotation must be finite, not nan"),
        ({"rotation": "left"}, TypeError, "rotation must be a number, not 'left'"),
        ({"lamp_offset": (1.0, 2.0)}, pc.ParameterError, "lamp_offset must be 3 numbers, not 2"),
        ({"lamp_offset": (0, np.inf, 0)}, pc.ParameterError, r"lamp_offset\[1\] must be in"),
    ],
)
def test_placements_are_checked(placed, error, message):
    with pytest.raises(error, match=message):
        pc.photo_rig(SATIN.fabric((SHINY, SHINY)), "front", **placed)


def test_guesses_follow_a_known_weave_and_the_pitch():
    y, x = np.mgrid[:256, :256]
    lines = 0.5 + 0.2 * np.cos(2 * np.pi * x / 5) + 0.2 * np.cos(2 * np.pi * y / 4)
    image = np.repeat(lines[..., None], 3, axis=2)
    threads = find_threads({"front": image})
    rig = pc.PhotoRig().scaled(usual_width(threads, 256))
    guesses = guess_geometries(threads, 256, rig, SATIN.pattern)
    assert {g.pattern for g in guesses} == {SATIN.pattern}
    assert guesses[0].warp_spacing_mm / guesses[0].weft_spacing_mm == pytest.approx(5 / 4, rel=0.03)
    # As many threads as cloth usually has.
    assert guesses[0].warp_spacing_mm * guesses[0].weft_spacing_mm == pytest.approx((10 / 35) ** 2)


def test_a_placement_is_found_where_the_residuals_vanish():
    """Residuals that are a smooth function of where things are: five numbers for four unknowns."""
    hidden = Placement(2.5, (0.4, -0.7, 0.9))

    def numbers(placement):
        return np.array([placement.rotation / 5.0, *placement.lamp_offset])

    mixing = np.random.default_rng(6).standard_normal((5, 4))

    def residuals(placement):
        return np.sin(0.3 * mixing @ (numbers(placement) - numbers(hidden)))

    found = find_placement(Placement(), 8.0, residuals)
    assert np.abs(residuals(found)).max() < 0.1 * np.abs(residuals(Placement())).max()
    assert numbers(found) == pytest.approx(numbers(hidden), abs=0.1)


def test_placements_stay_within_their_limits():
    far = find_placement(Placement(), 8.0, lambda p: np.array([p.lamp_offset[0] - 100.0]))
    assert far.lamp_offset[0] == pytest.approx(1.5)
    assert far.rotation == 0.0


def test_a_small_search_from_end_to_end(monkeypatch):
    small = Effort(cells=8, paths=8, rounds=1, evaluations=3, judging_paths=8)
    for name in ("SKETCH", "DRAWING", "PAINTING"):
        monkeypatch.setattr(photo_search, name, small)
    seen = []
    found = pc.fit_photographs(
        picture("front"),
        picture("back"),
        geometries=[SATIN],
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen[-1][0] == seen[-1][1]
    assert found.fabric.pattern == SATIN.pattern
    # The geometry and each variation of its yarns, the best first.
    scores = [candidate.score for candidate in found.candidates]
    assert scores == sorted(scores)
    assert len(scores) > 6
    assert len(found.result.errors) == 2
    assert {side: lens.blur for side, lens in found.lenses.items()} == dict.fromkeys(
        ("front", "back"), found.lenses["front"].blur
    )
    assert json.loads(json.dumps(found.summary()))["geometry"] == str(found.geometry)
    pictures = found.pictures(spp=1, progress=False)
    assert {side: image.pixels.shape for side, image in pictures.items()} == {
        "front": (32, 32, 3),
        "back": (32, 32, 3),
    }
    with pytest.raises(pc.ParameterError, match=r"side must be one of .*nearest is 'back'"):
        found.picture("black")


def test_bad_photographs_are_named(tmp_path):
    image = pc.Image(np.ones((32, 32, 3), np.float32))
    with pytest.raises(pc.ParameterError, match="must not both be None"):
        pc.fit_photographs(None, None)
    with pytest.raises(TypeError, match="list of at least one Geometry"):
        pc.fit_photographs(image, image, geometries=["satin"])
    with pytest.raises(pc.ParameterError, match="threads"):
        pc.fit_photographs(image, image, threads=-1)
    with pytest.raises(pc.ParameterError, match="the same size"):
        pc.fit_photographs(image, pc.Image(np.ones((32, 16, 3), np.float32)))
    with pytest.raises(FileNotFoundError):
        pc.fit_photographs(tmp_path / "none.png", image)
