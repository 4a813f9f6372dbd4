import math
from dataclasses import replace

import numpy as np
import plycloth as pc
import pytest
from plycloth import _plycloth
from plycloth.overview import IRRADIANCE, lighting
from plycloth.shared_cloth import compiled_scene
from samples import plain_fabric


@pytest.mark.parametrize("name", ["day", "raking", "overcast"])
def test_lightings_bring_the_same_irradiance_to_the_face(name):
    """The sun's share is E cos(theta); a sky of radiance L over a plane brings pi L."""
    total = 0.0
    for light in lighting(name):
        if isinstance(light, pc.DirectionalLight):
            direction = np.asarray(light.direction)
            total += light.irradiance[0] * -direction[2] / np.linalg.norm(direction)
        else:
            total += math.pi * light.image.max()
    assert total == pytest.approx(IRRADIANCE, rel=1e-6)


def test_sky_is_seen_from_the_face_alone():
    # A swatch far aside: the camera looks past it, from both sides.
    swatch = pc.Swatch(plain_fabric(), (0.1, 0.1))
    (sky,) = lighting("overcast")
    for z, seen in ((5.0, 0.0), (-5.0, sky.image.max())):
        camera = pc.OrthographicCamera((9, 0, z), (9, 0, 0), resolution=(2, 2))
        image = pc.render(pc.Scene(swatch, camera, (sky,)), spp=4, progress=False)
        assert np.allclose(image.pixels, seen)


def test_the_sun_of_back_lies_behind_the_cloth():
    (sun, _), (day, _) = lighting("back"), lighting("day")
    assert sun.direction[2] > 0 > day.direction[2]
    assert day.direction[0] > 0 > day.direction[1]  # from the upper left


def bright_satin():
    """A cloth in which light spreads as far as in any: 0.5 mm from yarn to yarn."""
    bsdf = pc.PlyBsdf(base_color=0.98, transmitted_color=0.98, extinction=1.0, body_reflection=0.2)
    yarn = pc.RoundYarn(0.23, bsdf, plies=1)
    return pc.Fabric(pc.WeavePattern.satin(5, 2), yarn, yarn, 0.5, 0.5).fitted()


def rows(scene, swatch, count=10):
    """Brightness of so many rows of yarns at the picture's top, each with so many pixels."""
    image = pc.render(replace(scene, swatch=swatch), spp=16, progress=False)
    return image.pixels.mean((1, 2)).reshape(count, -1).mean(1)


@pytest.mark.parametrize("light", ["raking", "back"])
def test_no_light_enters_by_an_edge_of_the_cloth(light):
    """The same paths, and so the same picture, as of cloth that goes on three times as far."""
    scene = pc.overview(bright_satin(), light, size_mm=5, width=60)
    endless = rows(scene, scene.swatch.extended().extended())
    assert rows(scene, scene.swatch) == pytest.approx(endless, rel=1e-3)


def test_light_enters_where_the_cloth_is_cut():
    scene = pc.overview(bright_satin(), "raking", size_mm=5, width=60, cut=True)
    assert scene.swatch == pc.Swatch(bright_satin(), 5)
    outermost, *_ = rows(scene, scene.swatch) / rows(scene, scene.swatch.extended())
    assert outermost > 2.0


def test_outer_rows_are_as_bright_as_the_rest():
    yarn = pc.RoundYarn(0.2, pc.DiffuseBsdf(0.8), plies=1)
    fabric = pc.Fabric(pc.WeavePattern.plain(), yarn, yarn, 0.5, 0.5).fitted()
    scene = pc.overview(fabric, "raking", size_mm=4, width=64)
    pixels = pc.render(scene, spp=64, progress=False).pixels.mean(2)
    for outer in (pixels[:16], pixels[-16:], pixels[:, :16], pixels[:, -16:]):
        assert outer.mean() == pytest.approx(pixels[16:-16, 16:-16].mean(), rel=0.03)


@pytest.mark.parametrize("lamp", ["front", "back"])
def test_the_rig_shows_no_edge(lamp):
    scene = pc.photo_rig(bright_satin(), lamp, resolution=(80, 80))
    image = pc.render(scene, spp=4, progress=False)
    further = replace(scene, swatch=scene.swatch.extended())
    endless = pc.render(further, spp=4, progress=False)
    assert image.pixels.mean((1, 2)) == pytest.approx(endless.pixels.mean((1, 2)), rel=1e-3)


def test_cloth_goes_on_by_whole_repeats():
    """So that the picture begins with the first end and the first pick."""
    fabric = plain_fabric()  # one repeat of 0.5 x 1 mm, yarns 0.375 mm apart
    assert pc.Swatch(fabric, (3, 2)).extended().size_mm == (3 + 2 * 6, 2 + 2 * 6)


def open_fabric():
    yarn = pc.RoundYarn(0.05, pc.DiffuseBsdf(0.5), plies=1)
    return pc.Fabric(pc.WeavePattern.plain(), yarn, yarn, 0.5, 0.5)


def test_the_ground_is_seen_through_gaps_and_lights_nothing():
    color = (0.6, 0.3, 0.1)
    pictures = [
        pc.render(pc.overview(open_fabric(), width=32, ground=ground), spp=16, progress=False)
        for ground in (color, None)
    ]
    added = pictures[0].pixels - pictures[1].pixels
    gap = added[..., 0] / color[0]
    assert added == pytest.approx(gap[..., None] * color, abs=1e-6)
    assert np.array_equal(np.unique(np.round(gap, 3) == 1.0), [False, True])
    # Two yarns of a fifth of the spacing cover 1 - 0.8^2 of it.
    assert gap.mean() == pytest.approx(0.8**2, abs=0.01)
    assert pictures[1].pixels[gap > 0.999].max() == 0.0


def test_gaps_are_not_black_by_default():
    assert pc.overview(open_fabric()).background == (0.05, 0.05, 0.05)
    assert pc.photo_rig(open_fabric(), "back").background is None


def test_a_fit_sees_the_same_ground():
    yarn = pc.RoundYarn(0.05, pc.PlyBsdf(), plies=1)
    fabric = pc.Fabric(pc.WeavePattern.plain(), yarn, yarn, 0.5, 0.5)
    seen = []
    for ground in (0.0, 1.0):
        compiled = compiled_scene(pc.overview(fabric, "overcast", ground=ground))
        seen.append(compiled.cell_averages((2, 2), 512, 0, None))
        tape = _plycloth.CompiledTape(compiled, (2, 2), 512, 0, None)
        assert tape.evaluate([yarn.bsdf] * 2)[0] == pytest.approx(seen[-1], rel=1e-4)
    assert (seen[1] - seen[0]).mean() == pytest.approx(0.8**2, abs=0.02)


def test_a_background_is_in_the_place_of_surroundings():
    camera = pc.OrthographicCamera((9, 0, 5), (9, 0, 0), resolution=(2, 2))
    swatch = pc.Swatch(open_fabric(), 0.1)
    scene = pc.Scene(swatch, camera, [pc.ConstantLight(2.0)], 0.25)
    assert np.allclose(pc.render(scene, spp=1, progress=False).pixels, 0.25)
    # A rectangle is an object that is seen.
    lamp = pc.RectangleLight((9, 0, 1), (4, 0, 0), (0, 4, 0), 3.0)
    scene = replace(scene, lights=[lamp])
    assert np.allclose(pc.render(scene, spp=1, progress=False).pixels, 3.0)


def test_a_cloth_turned_over_is_what_is_seen_from_behind():
    """Left goes to the right; a camera and a sun that go round the cloth see the same."""
    pattern = pc.WeavePattern.from_rows(["###.", "##.#", "#.##"])
    yarn = pc.RoundYarn(0.2, pc.DiffuseBsdf(0.8), plies=1)
    spacing = [0.4, 0.5, 0.6, 0.5]
    colors = {"warp_colors": [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], "weft_colors": None}
    fabric = pc.Fabric(pattern, yarn, yarn, spacing, 0.5, **colors).fitted()
    turned = fabric.turned_over()
    assert np.array_equal(turned.warp_spacing_mm, spacing[::-1])
    assert np.array_equal(turned.warp_colors, fabric.warp_colors[::-1])
    assert turned.turned_over() == fabric
    width, height = fabric.repeat_mm
    pictures = []
    for shown, side in ((turned, 1), (fabric, -1)):
        camera = pc.OrthographicCamera((0, 0, 9 * side), (0, 0, 0), (0, 1, 0), width, (32, 24))
        sun = pc.DirectionalLight((side, -1, -2 * side), 3.0)
        swatch = pc.Swatch(shown, (width, height)).extended()
        scene = pc.Scene(swatch, camera, [sun])
        pictures.append(pc.render(scene, spp=64, progress=False))
    z = pictures[0].z_scores(pictures[1])
    assert pictures[0].pixels.mean() > 0.1
    assert (z**2).mean() < 1.1


def test_a_draft_is_shown_once_and_fills_the_picture():
    fabric = plain_fabric()  # one repeat of 0.5 x 1 mm
    scene = pc.overview(fabric)
    assert scene.swatch == pc.Swatch(fabric).extended()
    assert scene.camera.width_mm == 0.5
    assert scene.camera.resolution == (256, 512)


def test_size_and_width_are_the_users():
    scene = pc.overview(plain_fabric(), [pc.ConstantLight(1)], size_mm=(3, 2), width=100)
    assert scene.camera.resolution == (100, 66)  # rounded down: no edge is seen
    assert scene.swatch == pc.Swatch(plain_fabric(), (3, 2)).extended()
    assert scene.lights == (pc.ConstantLight(1),)


@pytest.mark.parametrize(("size", "longest"), [((1, 1), 512), ((15, 7.5), 640), ((40, 20), 1024)])
def test_resolution_follows_the_yarns_within_limits(size, longest):
    assert max(pc.overview(plain_fabric(), size_mm=size).camera.resolution) == longest


def test_colors_keep_their_order():
    """White, grey and black ends come out in this order, none brighter than white light allows."""
    fabric = plain_fabric(
        pattern=pc.WeavePattern(np.ones((1, 3))),
        warp_colors=np.repeat([[1.0], [0.2], [0.0]], 3, axis=1),
        warp_spacing_mm=0.25,
    )
    image = pc.render(pc.overview(fabric, "overcast", width=60), spp=16, progress=False)
    white, grey, black = (image.pixels[:, i * 20 + 4 : i * 20 + 16].mean() for i in range(3))
    assert 1.0 > white > 1.5 * grey > 1.5 * black


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"light": "dya"}, "the nearest is 'day'"),
        ({"light": "missing.hdr"}, r"must be one of 'day', .*, not 'missing\.hdr'$"),
        ({"light": []}, "at least one light"),
        ({"width": 0}, "width"),
        ({"width": 2.5}, "width"),
        ({"size_mm": (1, -1)}, "size_mm"),
        ({"size_mm": (0.001, 1000), "width": 500}, "width must be less"),
        ({"ground": "red"}, "background must be a number or 3 numbers"),
        ({"ground": -1}, "background must be in"),
        ({"cut": 1}, "cut must be a bool"),
    ],
)
def test_bad_input(given, message):
    with pytest.raises((ValueError, TypeError), match=message):
        pc.overview(plain_fabric(), **given)
