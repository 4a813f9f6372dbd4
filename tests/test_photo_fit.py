"""The photo rig, and the search around the optical fit."""

import html
import json
from dataclasses import replace
from functools import cache

import numpy as np
import plycloth as pc
import pytest
from plycloth import photo_search
from plycloth.cells import cell_averages
from plycloth.photo_geometry import COVERS
from plycloth.photo_guess import find_threads, guess_geometries, usual_width, width_of
from plycloth.photo_input import Lit
from plycloth.photo_placement import Placement, find_placement
from plycloth.photo_search import Effort
from plycloth.photo_task import Known, make_task

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


SMALL = Effort(cells=8, paths=8, rounds=1, evaluations=3, judging_paths=8)


@cache
def photograph(side):
    return picture(side)


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


def test_threads_per_length_tell_the_width():
    y, x = np.mgrid[:256, :256]
    lines = 0.5 + 0.2 * np.cos(2 * np.pi * x / 8) + 0.2 * np.cos(2 * np.pi * y / 4)
    threads = find_threads({"front": np.repeat(lines[..., None], 3, axis=2)})
    # 32 ends and 64 picks in the picture.
    assert width_of(threads, 256, (0.5, None)) == pytest.approx(16.0, rel=0.03)
    assert width_of(threads, 256, (None, 0.5)) == pytest.approx(32.0, rel=0.03)
    assert width_of(threads, 256, (0.5, 0.25)) == pytest.approx(16.0, rel=0.03)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"ends": 30, "width_mm": 80}, "width_mm must not be given with ends"),
        ({"picks": 30, "geometries": [SATIN]}, "geometries must not be given with picks"),
        ({"ends": 0}, r"ends must be in \[0.1, 10000\]"),
        ({"ends": 30, "per": "foot"}, "per must be one of 'inch', 'cm'"),
    ],
)
def test_counts_that_cannot_be_are_refused(given, message):
    with pytest.raises(pc.ParameterError, match=message):
        pc.fit_photographs(None, **given)


def test_counts_that_contradict_the_picture_are_doubted():
    y, x = np.mgrid[:256, :256]
    lines = 0.5 + 0.2 * np.cos(2 * np.pi * x / 8) + 0.2 * np.cos(2 * np.pi * y / 4)
    picture = Lit("twill.png", np.repeat(lines[..., None], 3, axis=2))
    known = Known(None, 30.0, 60.0, "inch", 1.0, SATIN.pattern, COVERS, None, pc.PhotoRig())
    assert not any("were given" in doubt for doubt in make_task({"front": picture}, known).doubts)
    turned = replace(known, ends=60.0, picks=30.0)
    (doubt,) = (d for d in make_task({"front": picture}, turned).doubts if "were given" in d)
    assert "twill.png: there are 0.5 times as many ends as picks" in doubt
    assert "but 2 times as many were given" in doubt


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


@pytest.fixture
def efforts(monkeypatch):
    """Makes searches short; sets another effort if called with one."""

    def set_all(effort):
        for name in ("SKETCH", "DRAWING", "PAINTING"):
            monkeypatch.setattr(photo_search, name, effort)
            monkeypatch.setattr(photo_search, f"QUICK_{name}", effort)

    set_all(SMALL)
    return set_all


@pytest.fixture
def stop_after(monkeypatch):
    """Lets a fit raise an exception once so many have been made."""

    def stop(count, exception):
        calls, fit = [], photo_search.fit

        def stopping(*arguments, **options):
            calls.append(options)
            if len(calls) > count:
                raise exception
            return fit(*arguments, **options)

        monkeypatch.setattr(photo_search, "fit", stopping)
        return calls

    return stop


def test_a_small_search_from_end_to_end(efforts):
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
    image = photograph("front")
    with pytest.raises(pc.ParameterError, match="must not both be None"):
        pc.fit_photographs(None, None)
    with pytest.raises(TypeError, match="list of at least one Geometry"):
        pc.fit_photographs(image, image, geometries=["satin"])
    with pytest.raises(pc.ParameterError, match="threads"):
        pc.fit_photographs(image, image, threads=-1)
    with pytest.raises(pc.ParameterError, match="the same size"):
        pc.fit_photographs(image, pc.Image(np.ones((32, 16, 3), np.float32)))
    for options, message in (
        ({"width_mm": 0}, r"width_mm must be in \[0\.001, 1e\+06\], not 0"),
        ({"exposure": -1}, "exposure must be finite and greater than 0, not -1"),
        ({"covers": (0.9, 0.5)}, "covers must be the lower one first, not 0.9, 0.5"),
        ({"covers": (0.5, 9)}, r"covers\[1\] must be in \[0.01, 1.5\], not 9"),
        ({"seconds": 0}, "seconds must be finite and greater than 0, not 0"),
    ):
        with pytest.raises(pc.ParameterError, match=message):
            pc.fit_photographs(image, **options)
    with pytest.raises(FileNotFoundError):
        pc.fit_photographs(tmp_path / "none.png", image)


def test_an_enlarged_rig_sees_the_same():
    """All lengths grow, light arrives alike, and a longer way through yarns absorbs alike."""
    rig = pc.PhotoRig()
    large = rig.scaled(80.0)
    scale = 80.0 / rig.picture_width
    assert large.picture_width == pytest.approx(80.0)
    for side in ("front", "back"):
        assert large.irradiance(side) == pytest.approx(rig.irradiance(side))
    bsdf = replace(SHINY, extinction=SHINY.extinction / scale)
    geometry = replace(SATIN, warp_spacing_mm=0.05 * scale, weft_spacing_mm=0.05 * scale)
    scene = pc.photo_rig(geometry.fabric((bsdf, bsdf)), "front", rig=large, resolution=(32, 32))
    seen = pc.render(scene, spp=64, both_sides=True, progress=False).pixels
    assert seen.mean() == pytest.approx(photograph("front").pixels.mean(), rel=0.01)


def test_a_grey_card_tells_the_exposure():
    """A card that the camera sees as the rig's light has it was taken with an exposure of 1."""
    rig = pc.PhotoRig()
    card = pc.FlatYarn(0.05, pc.DiffuseBsdf(0.18), thickness_mm=1e-4)
    fabric = pc.Fabric(pc.WeavePattern.plain(), card, card, 0.05, 0.05)
    scene = pc.photo_rig(fabric, "front", rig=rig, resolution=(33, 33))
    middle = pc.render(scene, spp=64, progress=False).pixels[15:18, 15:18].mean((0, 1))
    assert pc.GreyCard(middle).exposure(rig) == pytest.approx(1.0, rel=0.03)
    assert pc.GreyCard(3 * middle, reflectance=0.54).exposure(rig) == pytest.approx(1.0, rel=0.03)
    assert pc.GreyCard(2 * middle).exposure(rig) == pytest.approx(2.0, rel=0.03)
    with pytest.raises(pc.ParameterError, match=r"GreyCard.reflectance must be in \[0.001, 1\]"):
        pc.GreyCard(0.5, reflectance=18)


def test_an_exposure_that_is_known_is_kept(efforts):
    card = pc.GreyCard(0.3)
    for exposure, value in ((2.5, 2.5), (card, card.exposure(pc.PhotoRig()))):
        found = pc.fit_photographs(
            photograph("front"), geometries=[SATIN], exposure=exposure, seconds=1e-3, progress=False
        )
        assert found.lenses["front"].exposure == pytest.approx(value)
        assert "exposure" not in [estimate.label for estimate in found.result.estimates]
        assert any("exposure" in said and f"{value:.4g}" in said for said in found.assumptions)


def test_the_fitted_cloth_by_itself_has_the_colours_of_the_photograph(efforts):
    """The rig's units and light have nothing to do with those of `overview`."""
    efforts(Effort(cells=4, paths=1024, rounds=4, evaluations=3, judging_paths=64))
    color = np.array([0.7, 0.35, 0.2])
    matte = pc.PlyBsdf(1.3, base_color=color, transmitted_color=color, roughness=0.6)
    scene = pc.photo_rig(SATIN.fabric((matte, matte)), "front", resolution=(32, 32))
    dark = pc.Image(2.0 * pc.render(scene, spp=16, both_sides=True, progress=False).pixels)
    found = pc.fit_photographs(
        dark, geometries=[SATIN], width_mm=80.0, quick=True, seconds=600, progress=False
    )
    assert found.stopped is None
    assert found.rig.picture_width == pytest.approx(80.0)
    assert "The pictures show 80 mm of cloth from left to right, as given." in found.assumptions
    scene = pc.overview(found.fabric, size_mm=(80.0, 80.0), width=32)
    seen = pc.render(scene, spp=16, progress=False).pixels.mean((0, 1))
    assert seen == pytest.approx(dark.pixels.mean((0, 1)), rel=0.15)


@pytest.mark.parametrize("covers", [(0.5, 0.95), (0.7, 0.8)])
def test_yarns_fill_their_room_and_never_overlap(covers):
    blank = find_threads({"front": np.full((64, 64, 3), 0.5)})
    # Ends that lie close, and picks that do not, as in twills.
    spacing = replace(
        blank.spacing, warp_px=1.3, weft_px=2.7, warp_confidence=1.0, weft_confidence=1.0
    )
    guesses = [
        guess
        for repeat, step in ((2, 1), (3, 1), (4, 3), (5, 2))
        for guess in guess_geometries(
            replace(blank, spacing=replace(spacing, repeat=repeat, step=step)), 64, covers=covers
        )
    ]
    tried = guesses + [g for each in guesses for g in each.variations(covers, cross_sections=True)]
    assert len({str(g) for g in tried}) > len(guesses)
    for geometry in tried:
        fabric = geometry.fabric((SHINY, SHINY))
        assert fabric.warp.bsdf == SHINY
        assert fabric.overlaps().count == 0, geometry
        for yarn, spacing in (
            (fabric.warp, fabric.warp_spacing_mm),
            (fabric.weft, fabric.weft_spacing_mm),
        ):
            assert covers[0] - 1e-9 <= 2.0 * yarn.half_width / spacing <= covers[1] + 1e-9, geometry


def test_yarns_without_room_are_refused():
    """A wide round warp, closely crossed by ribbons, could only be narrowed to nothing."""
    crammed = pc.Geometry(
        "twill",
        pc.WeavePattern.twill(2, 1),
        pc.YarnGuess(flat=False, cover=0.9),
        pc.YarnGuess(flat=True, cover=0.9),
        0.2,
        0.42,
    )
    assert not crammed.has_room(0.5)
    assert replace(crammed, warp=pc.YarnGuess(flat=False, cover=0.5)).has_room(0.5)
    message = "the yarns of twill, warp round 0.9, weft flat 0.9 have no room"
    with pytest.raises(pc.ParameterError, match=message):
        pc.fit_photographs(photograph("front"), geometries=[crammed])


def test_what_was_assumed_is_said_everywhere(efforts):
    found = pc.fit_photographs(photograph("back"), geometries=[SATIN], seconds=1e-3, progress=False)
    assert any("no photograph lit from behind" in said for said in found.assumptions)
    assert any("of overview" in said for said in found.assumptions)
    for said in found.assumptions:
        assert said in html.unescape(found._repr_html_())
        assert said in found.notes
    assert found.summary()["assumptions"] == list(found.assumptions)


def test_threads_that_are_hardly_told_are_a_warning(efforts, tmp_path):
    noise = np.random.default_rng(2).uniform(0.2, 0.6, (64, 64, 3)).astype(np.float32)
    pc.Image(noise).save(tmp_path / "noise.exr")
    with pytest.warns(pc.ConfidenceWarning, match=r"noise.exr: threads are hardly told"):
        found = pc.fit_photographs(tmp_path / "noise.exr", seconds=1e-3, progress=False)
    (doubt,) = found.doubts
    assert "warp: none, weft: none" in doubt
    assert f"Warning: {doubt}." in html.unescape(found._repr_html_())
    assert found.summary()["doubts"] == [doubt]
    assert "Warning: threads are hardly told" in pc.estimate_spacing(noise)._repr_html_()


def test_time_that_has_passed_leaves_the_best_so_far(efforts, stop_after):
    calls = stop_after(99, AssertionError)
    found = pc.fit_photographs(
        photograph("front"), geometries=[SATIN], seconds=1e-3, progress=False
    )
    # One fit is made in any case.
    assert len(calls) == 1
    assert found.stopped == "out of time"
    assert found.summary()["stopped"] == "out of time"
    assert "stopped (out of time)" in repr(found)
    assert "The search was stopped (out of time)" in found._repr_html_()


def test_ctrl_c_leaves_the_best_so_far(efforts, stop_after):
    stop_after(2, KeyboardInterrupt())
    found = pc.fit_photographs(photograph("front"), geometries=[SATIN], progress=False)
    assert found.stopped == "interrupted"
    assert len(found.candidates) == 1


def test_ctrl_c_before_the_first_fit_goes_through(efforts, stop_after):
    stop_after(0, KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        pc.fit_photographs(photograph("front"), geometries=[SATIN], progress=False)


def test_a_quick_search_makes_fewer_fits():
    quick, whole = photo_search.plan(quick=True), photo_search.plan()
    assert quick.most_steps(16) < whole.most_steps(16)
    assert quick.painting.paths < whole.painting.paths
