"""Plies that touch or overlap: what is opaque lets nothing through, however deep they press."""

from dataclasses import replace

import numpy as np
import plycloth as pc
import pytest

pytestmark = pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")

BLACK = pc.PlyBsdf(specular_tint=0, transmission_tint=0, base_color=0, transmitted_color=0,
                   extinction=1e5)  # fmt: skip
# Nothing but light that goes straight through: no lobe leads around what lies below.
CLEAR = pc.PlyBsdf(base_color=0, transmitted_color=0, extinction=0.0, roughness=0.02,
                   exit_roughness=0.02)  # fmt: skip
# So large that any path that goes down straight meets it.
LAMP = pc.RectangleLight((0.0, 0.0, -4.0), (8.0, 0.0, 0.0), (0.0, 8.0, 0.0), 1.0)


def yarn(kind, radius, bsdf, plies=1):
    if kind == "round":
        return pc.RoundYarn(radius, bsdf, plies=plies)
    return pc.FlatYarn(2 * radius, bsdf, thickness_mm=0.02)


def transmitted(warp, weft, stiffness=1.0):
    """What comes up through the middle of a crossing at which the warp is on the face."""
    pattern = pc.WeavePattern([[True, False], [False, True]])
    fabric = pc.Fabric(pattern, warp, weft, 1.0, 1.0, collision_stiffness=stiffness)
    swatch = pc.Swatch(fabric, (4.0, 4.0))
    # The first end lies at x = -1.5 and the first pick at y = 1.5.
    assert pattern.warp_up[1, 1]
    middle = (-0.5, 0.5, 0.0)
    camera = pc.OrthographicCamera((-0.5, 0.5, 3.0), middle, (0, 1, 0), 0.01, (4, 4))
    picture = pc.render(pc.Scene(swatch, camera, [LAMP]), spp=4096, progress=False)
    return float(np.asarray(picture, float).mean())


@pytest.mark.parametrize("radius", [0.1, 0.2, 0.3, 0.4])
@pytest.mark.parametrize("kinds", [("round", "round"), ("flat", "round")])
def test_nothing_comes_through_an_opaque_weft_below_a_clear_warp(kinds, radius):
    warp, weft = yarn(kinds[0], radius, CLEAR), yarn(kinds[1], radius, BLACK)
    assert transmitted(warp, weft) < 5e-4


@pytest.mark.parametrize("radius", [0.1, 0.2, 0.3, 0.4])
def test_nothing_comes_through_an_opaque_warp_above_a_clear_weft(radius):
    assert transmitted(yarn("round", radius, BLACK), yarn("round", radius, CLEAR)) < 5e-4


@pytest.mark.parametrize("radius", [0.1, 0.2, 0.3])
def test_light_comes_through_clear_plies(radius):
    """So that the others do not pass because no light is there at all."""
    clear = yarn("round", radius, CLEAR)
    assert 0.5 < transmitted(clear, clear) <= 1.001


@pytest.mark.parametrize("extinction", [1.0, 3.0, 8.0])
def test_pressed_plies_absorb_no_less_than_their_thickness(extinction):
    """What a crossing's middle transmits, as a thickness: -ln(light / interfaces) / extinction."""
    bsdf = replace(CLEAR, extinction=extinction)

    def thickness(ply_radius, interfaces):
        thread = pc.RoundYarn(0.25, bsdf, plies=1, ply_radius_mm=ply_radius)
        return -np.log(transmitted(thread, thread) / 0.96**interfaces) / extinction

    # A tenth thinner they lie apart. Bent plies are a little higher than wide where pieces meet.
    apart = thickness(0.225, 4)
    assert apart == pytest.approx(4 * 0.225, rel=0.04)
    # Pressed together they are one: as thick as both without the overlap, with two interfaces.
    pressed = thickness(0.25, 2)
    assert 0.85 < pressed < 1.03, pressed


@pytest.mark.parametrize("height", [60.0, -60.0])
def test_lamps_that_light_inside_is_aimed_at_are_worth_as_much(height):
    """A small rectangle is found by connections alone, too, but nothing aims at it."""
    bsdf = pc.PlyBsdf(base_color=0.9, transmitted_color=0.9, body_reflection=0.6, extinction=3.0,
                      roughness=(0.25, 0.4), exit_roughness=(0.3, 0.6))  # fmt: skip
    thread = pc.RoundYarn(0.25, bsdf, plies=1)
    swatch = pc.Swatch(pc.Fabric(pc.WeavePattern.plain(), thread, thread, 1.0, 1.0), (4.0, 4.0))
    camera = pc.OrthographicCamera((0.4, -0.8, 3.0), (0, 0, 0), (0, 1, 0), 1.0, (8, 8))
    place, area, radiance = (10.0, 5.0, height), 4.0, 3000.0
    edges = [(2.0, 0.0, 0.0), (0.0, 2.0, 0.0)]
    means, variances = [], []
    for lamp in (
        pc.PointLight(place, radiance * area * abs(height) / np.linalg.norm(place)),
        pc.RectangleLight(place, *(edges if height < 0 else edges[::-1]), radiance),
    ):
        scene = pc.Scene(swatch, camera, [lamp])
        picture = pc.render(scene, spp=8192, both_sides=True, progress=False)
        means.append(picture.pixels.mean((0, 1), dtype=float))
        variances.append(picture.variance.sum((0, 1), dtype=float) / 64**2)
    # Of what is left beside the noise, the rectangle's extent makes less than a thousandth.
    allowed = 3.5 * np.sqrt(np.sum(variances, 0)) + 1e-3 * means[1]
    assert allowed.max() < 0.02 * means[1].max()
    assert (np.abs(means[0] - means[1]) < allowed).all(), (means, np.sqrt(variances))
