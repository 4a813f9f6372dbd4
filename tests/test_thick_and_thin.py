"""Fabrics whose yarns differ from thread to thread."""

import pickle
from dataclasses import replace

import numpy as np
import plycloth as pc
import plycloth.mitsuba as to
import pytest

pytestmark = pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")

BSDF = pc.PlyBsdf()
THICK, THIN = pc.RoundYarn(0.16, BSDF), pc.RoundYarn(0.06, BSDF, plies=2, stiffness=2.0)
RIBBON = pc.FlatYarn(0.3, BSDF, thickness_mm=0.04)
PLAIN = pc.WeavePattern.plain()
WIDE = pc.WeavePattern(np.tile(PLAIN.warp_up, (1, 2)))


def fabric(warp=(THICK, THIN, THIN, RIBBON), weft=(THIN, THICK), **more):
    return pc.Fabric(WIDE, warp, weft, 0.5, 0.5, **more)


def picture(cloth, **more):
    return np.asarray(pc.render(pc.overview(cloth, width=64), spp=4, progress=False, **more))


def test_a_sequence_of_equal_yarns_is_the_cloth_of_one_bit_for_bit():
    one, each = fabric(THIN, THICK), fabric([THIN] * 4, [THICK, replace(THICK)])
    assert np.array_equal(picture(one), picture(each))
    assert one.relaxed() == each.relaxed()
    one, each = one.fitted(), each.fitted()
    assert (set(each.warp), set(each.weft)) == ({one.warp}, {one.weft})


def test_every_thread_has_the_height_of_its_own_radius():
    cloth = fabric()
    relaxed = cloth.relaxed()
    x = np.arange(4) * 2 + 1
    apart = np.abs(relaxed.warp_height[:, 1::2].T - relaxed.weft_height[:, x]) * cloth.unit_mm
    radii = np.array([0.16, 0.06, 0.06, 0.02])
    assert apart == pytest.approx(np.array([[0.06], [0.16]]) + radii, rel=2e-2)


def test_a_picture_shows_every_thread_as_wide_as_it_is():
    black = pc.DiffuseBsdf(0.0)
    thick, thin = pc.RoundYarn(0.2, black, plies=1), pc.RoundYarn(0.05, black, plies=1)
    thread = pc.RoundYarn(0.01, black, plies=1)
    up = pc.WeavePattern(np.ones((1, 3), bool))
    cloth = pc.Fabric(up, [thick, thin, thick], thread, 0.5, 5.0)
    # Where no pick is.
    camera = pc.OrthographicCamera((0, 1, 9), (0, 1, 0), width_mm=1.5, resolution=(300, 4))
    scene = pc.Scene(pc.Swatch(cloth, (1.5, 5.0)), camera, [pc.ConstantLight(1.0)])
    row = np.asarray(pc.render(scene, spp=16, progress=False)).mean(axis=(0, 2))
    seen = [np.count_nonzero(third < 0.5) * 0.005 for third in np.split(row, 3)]
    assert seen == pytest.approx([0.4, 0.1, 0.4], abs=0.011)


def test_the_last_pick_of_a_sequence_lies_at_the_bottom():
    black, white = pc.DiffuseBsdf(0.0), pc.DiffuseBsdf(0.9)
    thread = pc.RoundYarn(0.01, black, plies=1)
    down = pc.WeavePattern(np.zeros((2, 1), bool))
    weft = [pc.FlatYarn(0.5, white), pc.FlatYarn(0.5, black)]
    cloth = pc.Fabric(down, thread, weft, 0.5, 0.5)
    seen = np.asarray(pc.render(pc.overview(cloth, width=16), spp=8, progress=False))
    assert seen[:8].mean() > 10 * seen[-8:].mean()


def test_fitted_yarns_do_not_overlap_and_stay_of_their_kinds():
    cloth = fabric()
    fitted = cloth.fitted()
    assert cloth.overlaps().worst > 0.05
    assert fitted.overlaps().worst < 0.021
    assert fitted.warp[1] is fitted.warp[2]
    assert isinstance(fitted.warp[3], pc.FlatYarn)
    assert fitted.warp[0].half_width > fitted.warp[1].half_width
    assert fitted.fitted() == fitted


def test_a_thick_yarn_may_be_wider_than_half_the_distance_to_a_thin_one():
    thick, thin = pc.RoundYarn(0.35, BSDF), pc.RoundYarn(0.1, BSDF)
    cloth = pc.Fabric(PLAIN, [thick, thin], thin, 0.5, 1.0)
    assert cloth.fitted().warp[0].radius_mm == 0.35
    crowded = pc.Fabric(PLAIN, [thick, pc.RoundYarn(0.25, BSDF)], thin, 0.5, 1.0).fitted()
    assert crowded.warp[0].radius_mm + crowded.warp[1].radius_mm == pytest.approx(0.5)


def test_neighbours_overlap_by_what_both_are_too_wide():
    wide, narrow = pc.RoundYarn(0.4, BSDF), pc.RoundYarn(0.2, BSDF)
    thread = pc.RoundYarn(0.001, BSDF)
    up = pc.WeavePattern(np.ones((1, 2), bool))
    depth = pc.Fabric(up, [wide, narrow], thread, 0.5, 9.0).overlaps().depth_mm
    # Both lie on the thread: the wide one's centre is higher by the difference of their radii.
    expected = 0.6 - np.hypot(0.5, 0.2)
    assert depth == pytest.approx(np.full((1, 2), expected), rel=1e-3)


def test_a_draft_makes_every_thread_as_thick_as_it_says():
    thickness = np.array([0.1, 0.3, 0.1, 0.2])
    draft = pc.Draft.from_pattern(
        WIDE, warp_spacing=1.0, weft_spacing=1.0, warp_thickness=thickness, weft_thickness=0.2
    )
    cloth = pc.Fabric.from_draft(draft)
    assert [2 * yarn.radius_mm for yarn in cloth.warp] == pytest.approx(thickness)
    assert isinstance(cloth.weft, pc.RoundYarn)


def test_one_very_thick_thread_of_a_draft_is_narrowed():
    draft = pc.Draft.from_pattern(WIDE, warp_thickness=[0.5, 50.0, 0.5, 0.5])
    assert pc.Fabric.from_draft(draft).overlaps().worst < 0.021


def test_a_thin_yarn_in_an_open_sett_needs_no_pitch():
    thin = pc.RoundYarn(0.01, BSDF)
    cloth = pc.Fabric(PLAIN, thin, thin, 5.0, 5.0)
    assert cloth.warp_kinds[0].pitch == 5.0 / 8
    assert np.isfinite(picture(cloth)).all()
    with pytest.raises(pc.ParameterError, match=r"Fabric\.warp must have a pitch of at least"):
        pc.Fabric(PLAIN, replace(thin, pitch_mm=0.08), thin, 5.0, 5.0)


def test_a_fabric_of_several_yarns_is_a_value(tmp_path):
    cloth = fabric()
    cloth.save(tmp_path / "fabric.json")
    text = (tmp_path / "fabric.json").read_text("utf-8")
    assert text.count('"RoundYarn"') == 4
    assert '"order": [0, 1, 1, 2]' in text
    for twin in (pickle.loads(pickle.dumps(cloth)), pc.Fabric.load(tmp_path / "fabric.json")):
        assert twin == cloth
        assert hash(twin) == hash(cloth)
        assert twin.warp[1] is twin.warp[2]
    assert cloth != fabric(warp=(THICK, THIN, RIBBON, THIN))
    long = pc.Fabric(pc.WeavePattern(np.tile(PLAIN.warp_up, 9)), [THICK, THIN] * 9, THIN, 1, 1)
    assert "warp=<18 values, 2 different>" in repr(long)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[0, 1, 1, 2]", "[0, 1, 1, 3]", r"order\[3\]: must be a whole number from 0 to 2, not 3"),
        ("[0, 1, 1, 2]", "7", "yarns and order must be lists"),
        ('"order"', '"ordre"', "Yarns has no key 'ordre'"),
    ],
)
def test_a_spoilt_file_names_the_place(tmp_path, old, new, message):
    file = tmp_path / "fabric.json"
    fabric().save(file)
    file.write_text(file.read_text("utf-8").replace(old, new), "utf-8")
    with pytest.raises(pc.FormatError, match=message):
        pc.load(file)


@pytest.mark.parametrize(
    ("warp", "error", "message"),
    [
        ([THICK] * 3, pc.ParameterError, "one yarn for each of the pattern's 4 ends, not 3"),
        ([THICK, THIN, THIN, 7], TypeError, r"Fabric\.warp\[3\] must be a RoundYarn or FlatYarn"),
        ("wool", TypeError, r"Fabric\.warp must be a RoundYarn or FlatYarn"),
        ([THIN, THIN, pc.RoundYarn(3.0, BSDF), THIN], pc.ParameterError, r"Fabric\.warp\[2\] must"),
    ],
)
def test_bad_sequences_are_named(warp, error, message):
    with pytest.raises(error, match=message):
        fabric(warp)


def test_a_fit_needs_one_bsdf_of_a_set_but_no_one_shape():
    cloth = fabric()
    scene = pc.overview(cloth, width=16)
    target = pc.render(scene, spp=16, seed=1, progress=False)
    options = {"free": ["base_color"], "cells": 4, "paths": 8, "rounds": 1, "progress": False}
    found = pc.fit(scene, target, **options)
    assert [yarn.half_width for yarn in found.fabric.warp] == [y.half_width for y in cloth.warp]
    assert {yarn.bsdf for yarn in found.fabric.warp} == {found.bsdfs[0]}
    mixed = fabric((THICK, THIN, THIN, replace(THIN, bsdf=pc.PlyBsdf(eta=1.3))))
    with pytest.raises(pc.ParameterError, match="one BSDF for all yarns of its warp"):
        pc.fit(pc.overview(mixed, width=16), target, **options)


ROUND = pc.RoundYarn(0.1, BSDF, plies=2)
WIDE_RIBBON = pc.FlatYarn(0.25, BSDF)


@pytest.mark.parametrize(
    ("pattern", "warp", "weft"),
    [
        (PLAIN, [ROUND, WIDE_RIBBON], ROUND),
        (PLAIN, [WIDE_RIBBON, ROUND], [ROUND, WIDE_RIBBON]),
        (pc.WeavePattern.satin(5, 2), [ROUND, WIDE_RIBBON, ROUND, ROUND, WIDE_RIBBON], WIDE_RIBBON),
    ],
)
def test_thick_yarns_beside_ribbons_are_fitted_and_do_not_vanish(pattern, warp, weft):
    fitted = pc.Fabric(pattern, warp, weft, 0.3, 0.3).fitted()
    assert fitted.overlaps().worst < 0.021
    for yarn in (*fitted.warp_kinds, *fitted.weft_kinds):
        given = ROUND if isinstance(yarn, pc.RoundYarn) else WIDE_RIBBON
        assert 0.4 * given.half_width < yarn.half_width < given.half_width


def test_curves_are_those_of_each_kind():
    swatch = pc.Swatch(fabric((THICK, THIN, THIN, THICK), THIN))
    first, second = (pc.ply_curves(swatch, "warp", kind=kind) for kind in (0, 1))
    assert (first.points.shape[:2], second.points.shape[:2]) == ((2, 3), (2, 2))
    assert (first.radii_mm[0], second.radii_mm[0]) == (THICK.ply_radius, THIN.ply_radius)
    middles = [curves.points.mean(axis=(1, 2))[:, 0] for curves in (first, second)]
    assert middles[0] == pytest.approx([-0.75, 0.75], abs=0.02)
    assert middles[1] == pytest.approx([-0.25, 0.25], abs=0.02)
    assert len(pc.ply_curves(swatch, "weft").points) == 2
    with pytest.raises(pc.ParameterError, match="which of the fabric's 2 different yarns in its w"):
        pc.ply_curves(swatch, "warp")
    with pytest.raises(pc.ParameterError, match=r"kind must be in \[0, 1\], not 2"):
        pc.ply_curves(swatch, "warp", kind=2)


def test_mitsuba_gets_a_shape_for_each_kind(tmp_path):
    mitsuba = pytest.importorskip("mitsuba")
    mitsuba.set_variant("scalar_rgb")
    thick, thin = (replace(yarn, bsdf=pc.DiffuseBsdf()) for yarn in (THICK, THIN))
    cloth = fabric((thick, thin, thin, thick), thin)
    plugin = to.to_mitsuba(pc.overview(cloth, width=8, ground=None), tmp_path)
    files = {name: part["filename"] for name, part in plugin.items() if "filename" in part}
    assert set(files) == {"warp_0", "warp_1", "weft"}
    radii = {name: np.loadtxt(file)[0, 3] for name, file in files.items()}
    expected = {"warp_0": thick.ply_radius, "warp_1": thin.ply_radius, "weft": thin.ply_radius}
    assert radii == pytest.approx(expected)


def test_cloth_turned_over_has_its_threads_in_the_other_order():
    assert fabric().turned_over().warp == (RIBBON, THIN, THIN, THICK)


def test_no_yarns_are_not_those_of_the_draft():
    draft = pc.Draft.from_pattern(WIDE)
    with pytest.raises(pc.ParameterError, match="one yarn for each of the pattern's 4 ends, not 0"):
        pc.Fabric.from_draft(draft, warp=[])
