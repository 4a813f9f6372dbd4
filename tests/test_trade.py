"""Counts of the trade, against figures of textile books, and the yarns and cloth made of them."""

import math
from dataclasses import replace

import numpy as np
import plycloth as pc
import pytest
from plycloth import trade

COTTON = 1.52
BSDF = pc.PlyBsdf()
INCH = 25.4


@pytest.mark.parametrize(
    ("size", "unit", "tex", "within"),
    [
        # The conversions of textile handbooks: 590.5 / Ne, 1000 / Nm, denier / 9; Ne = 5315 / den.
        (1, "Ne", 590.5, 1e-4),
        (30, "Ne", 19.68, 1e-3),
        (10, "Ne", 59.05, 1e-4),
        (5315, "denier", 590.5, 1e-4),
        (1, "Nm", 1000, 1e-15),
        (1.6934, "Nm", 590.5, 1e-4),
        (60, "Nm", 16.667, 1e-4),
        (150, "denier", 16.667, 1e-4),
        (9, "denier", 1, 1e-15),
        (167, "dtex", 16.7, 1e-15),
        (20, "tex", 20, 1e-15),
    ],
)
def test_sizes_in_tex_are_those_of_handbooks(size, unit, tex, within):
    assert trade.to_tex(size, unit) == pytest.approx(tex, rel=within)
    assert trade.from_tex(tex, unit) == pytest.approx(size, rel=within)


@pytest.mark.parametrize("unit", trade.UNITS)
def test_sizes_survive_the_way_there_and_back(unit):
    sizes = np.array([[0.1, 1, 7], [33, 150, 1e4]])
    tex = trade.to_tex(sizes, unit)
    assert tex.shape == sizes.shape
    assert trade.from_tex(tex, unit) == pytest.approx(sizes, rel=1e-14)


def test_the_count_of_cotton_is_840_yards_in_a_pound():
    grams_per_metre = 453.59237 / (840 * 0.9144)
    assert trade.to_tex(1, "Ne") == pytest.approx(1000 * grams_per_metre, rel=1e-15)


@pytest.mark.parametrize("count", [10, 30, 60, 120])
def test_cotton_is_as_thick_as_peirce_says(count):
    """His 1/(28 sqrt(Ne)) inches, of 1.1 cm3/g."""
    diameter = trade.diameter_mm(trade.to_tex(count, "Ne"), "cotton")
    assert diameter == pytest.approx(INCH / (28 * math.sqrt(count)), rel=5e-3)


def test_a_worked_example_of_cotton_with_its_density():
    """Ne 10 of 0.91 g/cm3, fibers and air together, is 0.2874 mm thick."""
    assert trade.diameter_mm(59.05, 0.91, packing=1.0) == pytest.approx(0.2874, abs=5e-5)


def test_a_filament_that_is_solid():
    """A polyester filament of 1 denier is 10.1 micrometres thick."""
    tex = trade.to_tex(1, "denier")
    assert 1e3 * trade.diameter_mm(tex, "polyester", 1.0) == pytest.approx(10.1, abs=0.05)


@pytest.mark.parametrize("material", trade.DENSITIES)
def test_diameters_survive_the_way_there_and_back(material):
    tex = np.geomspace(1, 1000, 7)
    diameter = trade.diameter_mm(tex, material, 0.5)
    assert trade.tex_of_diameter(diameter, material, 0.5) == pytest.approx(tex, rel=1e-14)


def test_lighter_materials_make_thicker_yarns():
    assert trade.diameter_mm(20, "nylon") / trade.diameter_mm(20, "cotton") == pytest.approx(
        math.sqrt(1.52 / 1.14)
    )


@pytest.mark.parametrize(
    ("threads", "per", "mm"),
    [(25.4, "inch", 1), (60, "inch", 0.42333), (24, "cm", 0.41667), (10, "cm", 1)],
)
def test_threads_per_length(threads, per, mm):
    assert trade.spacing_mm(threads, per) == pytest.approx(mm, rel=1e-4)
    assert trade.threads_per(mm, per) == pytest.approx(threads, rel=1e-4)


def test_threads_per_length_are_arrays_too():
    counts = np.array([10.0, 20.0, 50.0])
    spacing = trade.spacing_mm(counts, "cm")
    assert spacing.tolist() == [1.0, 0.5, 0.2]
    assert trade.threads_per(spacing, "cm") == pytest.approx(counts, rel=1e-15)


NE_30, NM_28, NM_60 = 590.5412 / 30, 1000 / 28, 1000 / 60


@pytest.mark.parametrize(
    ("text", "single", "plies"),
    [
        ("20 tex", 20, 1),
        ("20tex", 20, 1),
        ("Tex 20", 20, 1),
        ("7.4 tex", 7.4, 1),
        ("167 dtex", 16.7, 1),
        ("150 denier", 150 / 9, 1),
        ("150 den", 150 / 9, 1),
        ("150D", 150 / 9, 1),
        ("30 Ne", NE_30, 1),
        ("Ne 30", NE_30, 1),
        ("ne30", NE_30, 1),
        ("28 Nm", NM_28, 1),
        ("30/1 Ne", NE_30, 1),
        ("30/2 Ne", NE_30, 2),
        ("Ne 30/2", NE_30, 2),
        ("30 Ne/2", NE_30, 2),
        (" 30 / 2  NE ", NE_30, 2),
        ("2/28 Nm", NM_28, 2),
        ("Nm 2/28", NM_28, 2),
        ("Nm 60/2", NM_60, 2),
        ("3/2 Ne", 590.5412 / 3, 2),
        ("20 tex x 2", 20, 2),
        ("20 tex \u00d7 2", 20, 2),
        ("2 x 20 tex", 20, 2),
        ("tex 20 x 2", 20, 2),
        ("8 tex x 12", 8, 12),
        ("150 den x 3", 150 / 9, 3),
        ("30 Ne x 2", NE_30, 2),
    ],
)
def test_sizes_as_they_are_written(text, single, plies):
    size = trade.YarnSize.parse(text)
    assert size.single_tex == pytest.approx(single, rel=1e-6)
    assert size.plies == plies
    assert size.tex == pytest.approx(plies * single, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "must be such as '20 tex', .*, not ''"),
        ("20", "must be such as"),
        ("tex", "must be such as"),
        ("20 tex den", "must be such as"),
        ("20,5 tex", "must be such as"),
        ("-20 tex", "must be such as"),
        ("20 tex 2", "must be such as"),
        ("20 2 tex x", "must be such as"),
        ("30/2/3 Ne", "must be such as"),
        ("20 x 2", "must be such as"),
        ("20/2", "must be such as"),
        ("R 40 tex/2", "must be such as"),
        ("20 tex;", "must be such as"),
        ("0 tex", r"size must be in \[1e-12, 1e\+12\], not 0\.0, as in '0 tex'"),
        ("30/0 Ne", "plies of a yarn must be a whole number"),
        ("30/1.5 Ne", "plies of a yarn must be a whole number"),
        ("20 tex x 0", "plies of a yarn must be a whole number"),
        ("30 Nw", "must be one of tex, dtex, denier, Nm, Ne, not 'nw'"),
        ("30s", "must be one of tex, dtex, denier, Nm, Ne, not 's'"),
        ("150/48 den", "in denier must not have a stroke, .* '20 denier x 2'"),
        ("20/22 den", "in denier must not have a stroke"),
        ("20 tex/2", "in tex must not have a stroke"),
        ("9" * 400 + " tex", r"size must be in \[1e-12, 1e\+12\], not inf, as in '9999"),
    ],
)
def test_what_is_no_size(text, message):
    with pytest.raises(pc.ParameterError, match=message) as caught:
        trade.YarnSize.parse(text)
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: trade.to_tex(1, "lea"), "unit must be one of 'tex', .*'Ne', not 'lea'"),
        (lambda: trade.from_tex(0, "Ne"), r"tex must be in \[1e-12, 1e\+12\]"),
        (lambda: trade.to_tex([1, -1], "Ne"), r"size\[1\] must be in \[1e-12"),
        (lambda: trade.spacing_mm(60, "foot"), "per must be one of 'inch', 'cm', not 'foot'"),
        (lambda: trade.spacing_mm(0, "cm"), r"threads must be in \[1e-12"),
        (lambda: trade.threads_per(math.nan, "cm"), r"spacing_mm must be in \[1e-12"),
        (lambda: trade.diameter_mm(20, "coton"), "material must be .*; the nearest is 'cotton'"),
        (lambda: trade.diameter_mm(20, "steel"), "material must be one of 'cotton', .*'silk'"),
        (lambda: trade.diameter_mm(20, 0.0), r"material must be in \[0.01, 100\], not 0"),
        (lambda: trade.diameter_mm(20, 1.5, 1.2), r"packing must be in \[0.01, 1\], not 1.2"),
        (lambda: pc.RoundYarn.of_size("20 tex x 13", BSDF, material=1.5), r"plies.* \[1, 12\]"),
        (lambda: draft().with_sett(ends=-1), "ends must be finite and greater than 0"),
        (lambda: draft().with_sett(picks=9, per="mm"), "per must be one of 'inch', 'cm'"),
    ],
)
def test_what_is_out_of_range(call, message):
    with pytest.raises(pc.ParameterError, match=message):
        call()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: trade.YarnSize.parse(20), "must be a text such as '20 tex'"),
        (lambda: trade.to_tex("20", "tex"), "size must hold real numbers"),
        (lambda: trade.diameter_mm(20, None), r"material must be a name \(cotton, .*, not None"),
        (lambda: pc.RoundYarn.of_size("20 tex", "red", material="silk"), "bsdf must be a PlyBsdf"),
        (lambda: draft().with_sett(ends="60"), "ends must be a number"),
    ],
)
def test_what_is_of_another_kind(call, message):
    with pytest.raises(TypeError, match=message):
        call()


def test_a_single_yarn_is_one_ply_as_thick_as_its_weight_says():
    yarn = pc.RoundYarn.of_size("30 Ne", BSDF, material="cotton")
    assert yarn.plies == 1
    assert 2 * yarn.radius_mm == trade.diameter_mm(trade.to_tex(30, "Ne"), "cotton")
    assert yarn == pc.RoundYarn(yarn.radius_mm, BSDF, 1)


@pytest.mark.parametrize("size", ["30/2 Ne", "2/28 Nm", "20 tex x 3", "50 den x 12"])
@pytest.mark.parametrize("packing", [0.4, 0.7])
def test_the_plies_of_a_folded_yarn_weigh_what_its_size_says(size, packing):
    yarn = pc.RoundYarn.of_size(size, BSDF, material="wool", packing=packing)
    area = yarn.plies * math.pi * yarn.ply_radius**2
    assert 1e3 * area * packing * 1.31 == pytest.approx(trade.YarnSize.parse(size).tex, rel=1e-12)
    assert replace(yarn, pitch_mm=None) == yarn


def test_two_folded_singles_are_about_twice_as_wide_as_one():
    single, folded = (
        pc.RoundYarn.of_size(size, BSDF, material="cotton") for size in ("30 Ne", "30/2 Ne")
    )
    assert folded.radius_mm / single.radius_mm == pytest.approx(2, rel=0.02)


def test_a_ribbon_has_the_cross_section_of_its_weight():
    ribbon = pc.FlatYarn.of_size("150 denier", BSDF, material="silk", packing=0.7)
    tex = 1e3 * ribbon.width_mm * ribbon.thickness * 0.7 * trade.DENSITIES["silk"]
    assert tex == pytest.approx(150 / 9)
    assert ribbon.thickness == 0.1 * ribbon.width_mm


def draft():
    return pc.Draft.from_pattern(
        pc.WeavePattern.twill(2, 2), warp_spacing=[1, 1, 1, 2], weft_spacing=0.5
    )


def test_drafts_are_set_by_the_inch_or_centimetre():
    old = draft()
    new = old.with_sett(ends=60, picks=20, per="inch")
    assert new.warp_spacing.mean() == pytest.approx(INCH / 60)
    assert new.warp_spacing / new.warp_spacing[0] == pytest.approx(old.warp_spacing)
    assert new.weft_spacing == pytest.approx(INCH / 20)
    assert new.warp_thickness / new.warp_spacing == pytest.approx(0.8)
    assert old.with_sett(picks=8, per="cm").weft_spacing == pytest.approx(1.25)
    assert replace(old.with_sett(picks=8, per="cm"), weft_spacing=0.5, weft_thickness=0.4) == old
    assert old.with_sett() == old


def test_fabrics_are_set_by_the_inch_or_centimetre():
    pattern = pc.WeavePattern.twill(2, 1)
    yarn = pc.RoundYarn.of_size("30/2 Ne", BSDF, material="cotton")
    colors = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    fabric = pc.Fabric.of_sett(
        pattern, yarn, yarn, ends=60, picks=[40, 50, 60], per="inch", warp_colors=colors
    )
    assert fabric == pc.Fabric(
        pattern, yarn, yarn, INCH / 60, INCH / np.array([40, 50, 60]), warp_colors=colors
    )
    metric = pc.Fabric.of_sett(pattern, yarn, yarn, ends=20, picks=25, per="cm")
    assert (metric.warp_spacing_mm, metric.weft_spacing_mm) == (0.5, 0.4)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"ends": 0}, "ends must be finite and greater than 0"),
        ({"picks": [20, -1]}, r"picks\[1\] must be finite and greater than 0"),
        ({"ends": [20, 20, 20]}, "one row for each of the pattern's 2 ends, not 3"),
        ({"per": "yard"}, "per must be one of 'inch', 'cm', not 'yard'"),
    ],
)
def test_setts_that_cannot_be(changes, message):
    yarn = pc.RoundYarn.of_size("20 tex", BSDF, material="cotton")
    sett = {"ends": 20, "picks": 20, "per": "cm"} | changes
    with pytest.raises(pc.ParameterError, match=message):
        pc.Fabric.of_sett(pc.WeavePattern.plain(), yarn, yarn, **sett)
