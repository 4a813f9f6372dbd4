import math

import numpy as np
import plycloth as pc
import pytest
from plycloth.overview import IRRADIANCE, lighting
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


def test_a_draft_is_shown_once_and_fills_the_picture():
    fabric = plain_fabric()  # one repeat of 0.5 x 1 mm
    scene = pc.overview(fabric)
    assert scene.swatch == pc.Swatch(fabric)
    assert scene.camera.width_mm == 0.5
    assert scene.camera.resolution == (256, 512)


def test_size_and_width_are_the_users():
    scene = pc.overview(plain_fabric(), [pc.ConstantLight(1)], size_mm=(3, 2), width=100)
    assert scene.camera.resolution == (100, 66)  # rounded down: no edge is seen
    assert scene.swatch.size_mm == (3, 2)
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
        ({"light": []}, "at least one light"),
        ({"width": 0}, "width"),
        ({"width": 2.5}, "width"),
        ({"size_mm": (1, -1)}, "size_mm"),
        ({"size_mm": (0.001, 1000), "width": 500}, "width must be less"),
    ],
)
def test_bad_input(given, message):
    with pytest.raises((ValueError, TypeError), match=message):
        pc.overview(plain_fabric(), **given)
