"""Overlaps of yarns against solids of points, and the remedy against the overlaps."""

import warnings
from dataclasses import replace

import numpy as np
import plycloth as pc
import pytest
from plycloth.plot import knot_positions, yarn_curve
from plycloth.weave import WeavePattern
from scipy.spatial import cKDTree


def fabric(pattern, *, warp=0.3, weft=0.3, spacing=(1.0, 1.0), **options):
    warp, weft = (
        each if isinstance(each, pc.FlatYarn) else pc.RoundYarn(each, pc.PlyBsdf())
        for each in (warp, weft)
    )
    return pc.Fabric(pattern, warp, weft, *spacing, **options)


def tube(points, slopes, half_width, half_height, *, is_warp, offset):
    """Points (n x 3) of the surface of a yarn, and of its solid."""
    angle = np.linspace(0.0, 2.0 * np.pi, 97)[:-1]
    along, height = points
    length = np.hypot(1.0, slopes)
    sections = []
    for size in np.linspace(1.0, 0.0, 9):
        out = size * half_height * np.sin(angle)
        aside = np.broadcast_to(offset + size * half_width * np.cos(angle), (len(along), 96))
        forward = along[:, None] - out * (slopes / length)[:, None]
        up = height[:, None] + out / length[:, None]
        order = (aside, forward, up) if is_warp else (forward, aside, up)
        sections.append(np.stack(order, axis=-1).reshape(-1, 3))
    return sections[0], np.concatenate(sections)


def brute_force_depth(cloth, end, pick):
    """How deep the first pick's surface reaches into an end, by the nearest of many points."""
    relaxed, unit = cloth.relaxed(), cloth.unit_mm

    def dense(spacing, heights, slopes, middle, reach):
        knots = knot_positions(spacing)
        along, height = yarn_curve(knots, heights, slopes)
        period, places = knots[-1], np.linspace(middle - reach, middle + reach, 401)
        height = np.interp(places, along, height, period=period)
        step = 1e-4
        ahead = np.interp(places + step, *yarn_curve(knots, heights, slopes), period=period)
        return (places * unit, height * unit), (ahead - height) / step

    x = (np.cumsum(relaxed.warp_spacing) - relaxed.warp_spacing / 2)[end]
    y = (np.cumsum(relaxed.weft_spacing) - relaxed.weft_spacing / 2)[pick]
    warp = dense(relaxed.weft_spacing, relaxed.warp_height[end], relaxed.warp_slope[end], y, 0.7)
    weft = dense(relaxed.warp_spacing, relaxed.weft_height[pick], relaxed.weft_slope[pick], x, 0.7)
    sizes = [(each.half_width, 0.5 * each.thickness) for each in (cloth.warp, cloth.weft)]
    shell, solid = tube(*warp, *sizes[0], is_warp=True, offset=x * unit)
    surface, _ = tube(*weft, *sizes[1], is_warp=False, offset=y * unit)
    # A point is inside if a point of the solid is nearer than those are from each other.
    inside = cKDTree(solid).query(surface)[0] < 0.03 * unit
    return cKDTree(shell).query(surface[inside])[0].max(initial=0.0)


@pytest.mark.parametrize(
    ("pattern", "radius", "thickness"),
    [
        (WeavePattern.plain(), 0.3, None),
        (WeavePattern.plain(), 0.4, 0.5),
        (WeavePattern.twill(2, 2), 0.3, 0.3),
    ],
)
def test_depths_are_those_of_many_points(pattern, radius, thickness):
    cloth = fabric(pattern, warp=radius, weft=radius)
    cloth = replace(
        cloth,
        warp=replace(cloth.warp, thickness_mm=thickness),
        weft=replace(cloth.weft, thickness_mm=thickness),
    )
    depth = cloth.overlaps().depth_mm
    assert depth.shape == (pattern.picks, pattern.ends)
    expected = brute_force_depth(cloth, 0, 0)
    assert expected > 0.02
    assert depth[0, 0] == pytest.approx(expected, rel=0.2, abs=0.01)


def test_thin_yarns_do_not_overlap():
    overlaps = fabric(WeavePattern.twill(2, 2), warp=0.05, weft=0.05).overlaps()
    assert (overlaps.count, overlaps.share) == (0, 0.0)
    assert overlaps.worst < 0.02


def test_neighbours_overlap_by_what_they_are_too_wide():
    # Ends that float side by side all the way, further apart from the picks than they reach.
    cloth = fabric(WeavePattern([[1, 1]]), warp=0.55, weft=0.1)
    np.testing.assert_allclose(cloth.overlaps().depth_mm, 0.1, atol=0.01)


def test_rows_are_picks_from_the_top():
    # The first two picks lie side by side, too close to each other; the lower one counts it.
    pattern = WeavePattern([[1, 0], [1, 0], [0, 1], [1, 0], [0, 1]])
    spacing = (1.0, np.array([0.3, 0.3, 2.0, 2.0, 2.0]))
    depth = fabric(pattern, warp=0.2, weft=0.2, spacing=spacing).overlaps().depth_mm
    np.testing.assert_allclose(depth[1], 0.1, atol=0.01)
    assert np.delete(depth, 1, axis=0).max() < 0.08


@pytest.mark.parametrize("width", [0.3, 0.5, 0.9])
@pytest.mark.parametrize(
    "pattern",
    [
        WeavePattern.plain(),
        WeavePattern.twill(3, 1),
        WeavePattern.satin(5, 2),
        WeavePattern(np.random.default_rng(1).random((12, 15)) < 0.5),
    ],
    ids=repr,
)
def test_fitted_yarns_do_not_overlap(pattern, width):
    cloth = fabric(pattern, warp=width, weft=0.8 * width)
    fitted = cloth.fitted()
    assert cloth.overlaps().worst > 0.05
    assert fitted.overlaps().worst < 0.021
    assert fitted.fitted() == fitted
    for yarn, given in ((fitted.warp, cloth.warp), (fitted.weft, cloth.weft)):
        assert 1.0 <= 2.0 * yarn.radius_mm / yarn.thickness <= 3.0 + 1e-9
        assert yarn.radius_mm <= min(0.5, given.radius_mm)
        assert (yarn.pitch, yarn.plies, yarn.bsdf) == (given.pitch, given.plies, given.bsdf)


def test_fitted_yarns_are_as_wide_and_as_round_as_fits():
    cloth = fabric(WeavePattern.plain())
    fitted = cloth.fitted()
    assert fitted.warp.radius_mm == 0.3
    rounder = replace(fitted.warp, thickness_mm=1.05 * fitted.warp.thickness)
    assert replace(fitted, warp=rounder, weft=rounder).overlaps().worst > 0.02


def test_one_crossing_among_many_decides_how_yarns_fit():
    warp_up = np.tile([[True, False], [False, True]], (40, 40))
    plain = fabric(WeavePattern(warp_up)).fitted()
    warp_up[40, 37] ^= True
    fitted = fabric(WeavePattern(warp_up)).fitted()
    assert fitted.warp.thickness < 0.99 * plain.warp.thickness
    assert fitted.overlaps().worst < 0.021


def test_yarns_that_fit_are_left_alone():
    cloth = fabric(WeavePattern.plain(), warp=0.1, weft=0.1)
    assert cloth.fitted() == cloth


def test_ribbons_keep_their_width_unless_it_exceeds_the_spacing():
    for width, expected in ((0.7, 0.7), (1.4, 1.0)):
        ribbon = pc.FlatYarn(width, pc.PlyBsdf())
        fitted = fabric(WeavePattern.plain(), warp=ribbon, weft=0.3).fitted()
        assert fitted.warp.width_mm == pytest.approx(expected)
        assert fitted.overlaps().worst < 0.021


def test_yarns_that_find_no_room_are_said_to_be_narrowed():
    """A thick round yarn among wide ribbons comes down too steeply beside them."""
    warp, ribbon = pc.RoundYarn(0.09, pc.PlyBsdf()), pc.FlatYarn(0.378, pc.PlyBsdf())
    cloth = pc.Fabric(WeavePattern.twill(2, 1), warp, ribbon, 0.2, 0.42)
    with pytest.warns(pc.OverlapWarning, match="however small they are: they stay as they are"):
        assert cloth.fitted() == cloth


def test_yarns_that_are_narrowed_to_little_are_told():
    """Of two yarns that would meet, both are narrowed by one factor."""
    thick, thin = pc.RoundYarn(2.0, pc.PlyBsdf()), pc.RoundYarn(0.1, pc.PlyBsdf())
    cloth = pc.Fabric(WeavePattern.plain(), [thick, thin], thin, 1.0, 1.0)
    with pytest.warns(pc.OverlapWarning, match=r"narrowed, to \d+\.\d% of the room"):
        cloth.fitted()


@pytest.mark.parametrize("seed", range(4))
def test_ribbons_are_never_flattened_to_nothing(seed):
    """Those whose neighbours lie at other heights pass through each other however thin they are."""
    pattern = WeavePattern(np.random.default_rng(seed).random((5, 4)) < 0.5)
    ribbon = pc.FlatYarn(0.9, pc.PlyBsdf())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", pc.OverlapWarning)
        fitted = fabric(pattern, warp=ribbon, weft=ribbon).fitted()
    assert fitted.warp.thickness > 0.01 * ribbon.thickness


def test_a_picture_of_cut_yarns_warns_once_and_names_the_remedy():
    cloth = fabric(WeavePattern.plain(), warp=0.4, weft=0.4)
    with pytest.warns(pc.OverlapWarning, match=r"4 of 4 crossings.*mm \(\d+%.*fitted") as caught:
        pc.render(pc.overview(cloth, width=2), spp=1)
    assert len(caught) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        pc.render(pc.overview(cloth.fitted(), width=2), spp=1)


def test_a_draft_makes_yarns_that_do_not_overlap():
    draft = pc.Draft.from_pattern(WeavePattern.twill(2, 2))
    assert pc.Fabric.from_draft(draft).overlaps().worst < 0.021
    thick = pc.RoundYarn(0.4, pc.PlyBsdf())
    assert pc.Fabric.from_draft(draft, thick, thick).warp == thick


def test_overlaps_show_themselves():
    overlaps = fabric(WeavePattern.plain(), warp=0.4, weft=0.4).overlaps()
    assert overlaps.worst_mm == overlaps.depth_mm.max()
    assert overlaps.worst == overlaps.worst_mm / 0.8
    assert (overlaps.count, overlaps.share) == (4, 1.0)
    html = overlaps._repr_html_()
    assert "4 of 4 crossings" in html
    assert "<svg" in html
    assert len(overlaps.plot().axes) == 2


@pytest.mark.parametrize("size", [(2, 2), (8, 8), (60, 40)])
def test_crossing_yarns_touch(size):
    rng = np.random.default_rng(3)
    pattern = WeavePattern.plain() if size == (2, 2) else WeavePattern(rng.random(size) < 0.5)
    spacing = [rng.uniform(0.7, 1.4, count) for count in (pattern.ends, pattern.picks)]
    cloth = fabric(pattern, warp=0.4, weft=0.4, spacing=spacing)
    relaxed = cloth.relaxed()
    sign = np.where(pattern.warp_up, 1.0, -1.0)
    distance = sign * (relaxed.warp_height[:, 1::2].T - relaxed.weft_height[:, 1::2])
    assert 1.0 - 1e-3 < distance.min() * cloth.unit_mm / 0.8 < 1.0
