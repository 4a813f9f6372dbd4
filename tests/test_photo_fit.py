"""The photo rig, and the search around the optical fit."""

import json

import numpy as np
import plycloth as pc
import pytest
from plycloth import photo_fit
from plycloth.cells import cell_averages
from plycloth.photo_fit import Effort, Placement, guess_geometries
from plycloth.photo_geometry import weaves

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


def test_unknown_lamps_are_named():
    with pytest.raises(pc.ParameterError, match="nearest is 'front'"):
        pc.photo_rig(SATIN.fabric((SHINY, SHINY)), "fronts")


def test_weaves_for_every_repeat():
    for repeat in (None, *range(1, 13)):
        for name, pattern in weaves(repeat):
            assert isinstance(pattern, pc.WeavePattern), name
            if repeat is not None and repeat > 2 and repeat != 6:
                assert repeat in (pattern.ends, pattern.picks)


def test_guesses_follow_a_known_weave_and_the_pitch():
    y, x = np.mgrid[:256, :256]
    lines = 0.5 + 0.2 * np.cos(2 * np.pi * x / 5) + 0.2 * np.cos(2 * np.pi * y / 4)
    image = np.repeat(lines[..., None], 3, axis=2)
    guesses = guess_geometries({"front": image}, SATIN.pattern)
    assert {g.pattern for g in guesses} == {SATIN.pattern}
    assert guesses[0].warp_spacing_mm / guesses[0].weft_spacing_mm == pytest.approx(5 / 4, rel=0.03)


def test_a_small_search_from_end_to_end(monkeypatch):
    for name in ("SKETCH", "DRAWING", "PAINTING"):
        monkeypatch.setattr(photo_fit, name, Effort(8, 2, 4))
    monkeypatch.setattr(photo_fit, "CALIBRATION_PATHS", 4)
    monkeypatch.setattr(photo_fit, "COVER_FACTORS", ())
    monkeypatch.setattr(Placement, "FINEST", 1.0)
    seen = []
    found = pc.fit_photographs(
        picture("front"),
        picture("back"),
        geometries=[SATIN],
        progress=lambda done, total: seen.append((done, total)),
    )
    assert seen[-1][0] == seen[-1][1]
    assert found.fabric.pattern == SATIN.pattern
    assert len(found.result.errors) == 2
    assert json.loads(json.dumps(found.summary()))["geometry"] == str(SATIN)
    pictures = found.pictures(spp=1, progress=False)
    assert {side: image.pixels.shape for side, image in pictures.items()} == {
        "front": (32, 32, 3),
        "back": (32, 32, 3),
    }


def test_bad_photographs_are_named(tmp_path):
    image = pc.Image(np.ones((32, 32, 3), np.float32))
    with pytest.raises(pc.ParameterError, match="must not both be None"):
        pc.fit_photographs(None, None)
    with pytest.raises(pc.ParameterError, match="the same size"):
        pc.fit_photographs(image, pc.Image(np.ones((32, 16, 3), np.float32)))
    with pytest.raises(FileNotFoundError):
        pc.fit_photographs(tmp_path / "none.png", image)
