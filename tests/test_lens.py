"""What a lens does to pictures, and how its blur is found."""

import numpy as np
import plycloth as pc
import pytest
from plycloth.lens import Lens, blurred, contrast, matching_blur


def test_a_blurred_point_is_a_gaussian_and_keeps_its_light():
    point = np.zeros((41, 41, 3))
    point[20, 20] = 1.0
    spread = blurred(point, 1.5)
    assert spread.sum() == pytest.approx(3.0)
    offsets = np.arange(41) - 20
    for axis in (0, 1):
        profile = spread[..., 0].sum(axis=axis)
        assert (profile * offsets**2).sum() == pytest.approx(1.5**2, rel=0.01)
    assert np.array_equal(blurred(point, 0.0), point)


def test_a_grey_picture_stays_as_it_is_up_to_its_edges():
    grey = np.full((9, 30, 3), 0.4)
    assert np.allclose(blurred(grey, 2.0), grey, atol=1e-15)


def test_contrast_is_the_relative_deviation_within_squares():
    rng = np.random.default_rng(1)
    ramp = np.linspace(1.0, 3.0, 128)[:, None, None]
    grain = np.repeat(1.0 + 0.1 * rng.standard_normal((128, 128, 1)), 3, axis=2)
    assert contrast(grain) == pytest.approx(0.1, rel=0.03)
    assert contrast(ramp * grain) == pytest.approx(0.1, rel=0.1)
    assert contrast(grain, noise=0.08) == pytest.approx(0.06, rel=0.1)
    assert contrast(np.zeros((32, 32, 3))) == 0.0


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_the_blur_of_a_photograph_is_found_whatever_the_noise(noise):
    y, x = np.mgrid[:128, :128]
    cloth = 1.0 + 0.5 * np.sin(2 * np.pi * x / 4.3) * np.sin(2 * np.pi * y / 5.1)
    cloth = np.repeat(cloth[..., None], 3, axis=2)
    grains = noise * np.random.default_rng(2).standard_normal((128, 128, 1))
    variance = np.full(cloth.shape, noise**2, np.float32)
    render = pc.Image((cloth + grains).astype(np.float32), variance)
    assert matching_blur([render], [blurred(cloth, 0.9)]) == pytest.approx(0.9, abs=0.1)
    assert matching_blur([render], [cloth]) < 0.3


def test_a_lens_develops_pixels_and_variance():
    image = pc.Image(np.ones((4, 4, 3), np.float32), np.full((4, 4, 3), 0.5, np.float32))
    taken = Lens(2.0, 0.3).develop(image)
    corner = 2.0 * np.exp(-0.3 * 0.75**2)
    assert taken.pixels[0, 0] == pytest.approx(corner)
    assert taken.variance[0, 0] == pytest.approx(0.5 * corner**2)
    assert Lens(2.0, 0.3, 1.0).develop(image).variance is None
    assert "blur 1 pixels" in str(Lens(2.0, 0.3, 1.0))


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"exposure": 0.0}, "Lens.exposure must be finite and greater than 0"),
        ({"exposure": np.nan}, "Lens.exposure"),
        ({"falloff": -1.0}, "Lens.falloff must be finite and at least 0"),
        ({"blur": np.inf}, "Lens.blur"),
    ],
)
def test_bad_lenses_are_named(given, message):
    with pytest.raises(pc.ParameterError, match=message):
        pc.Lens(**given)
