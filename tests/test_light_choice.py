"""Lights are chosen at random: several together are the sum of each alone, however unlike."""

from dataclasses import replace

import numpy as np
import plycloth as pc
import pytest
from scipy import stats

SIGNIFICANCE = 1e-3
PIXELS, SPP = 12, 1024


def environment(scale):
    rows, columns = np.meshgrid(np.arange(16), np.arange(32), indexing="ij")
    image = 0.2 + np.sin(0.4 * rows) ** 2 + 3.0 * ((columns - 20) ** 2 + (rows - 4) ** 2 < 12)
    return pc.EnvironmentLight(np.repeat(image[..., None], 3, axis=2), scale=scale, rotation=40.0)


# In front and behind, each kind once bright and once dim.
LIGHTS = {
    "bright point, dim rest": [
        pc.PointLight((1.5, 1.0, 3.0), (60.0, 50.0, 40.0)),
        pc.DirectionalLight((0.3, 0.2, 1.0), 0.1),
        pc.RectangleLight((0.5, 0.0, 2.5), (0.0, 1.5, 0.0), (1.5, 0.0, 0.3), 0.2),
        pc.ConstantLight((0.05, 0.04, 0.03)),
    ],
    "bright sun and sky": [
        pc.DirectionalLight((-0.5, 0.6, -1.0), 5.0),
        pc.ConstantLight(2.0),
        pc.PointLight((0.5, 1.0, -3.0), 0.5),
    ],
    "bright rectangle": [
        pc.RectangleLight((-0.8, 0.0, 1.5), (0.0, 1.5, 0.0), (1.5, 0.0, -0.3), 20.0),
        pc.RectangleLight((0.5, 0.5, -2.0), (1.5, 0.0, 0.0), (0.0, 1.5, 0.0), 0.5),
        environment(0.1),
    ],
    "bright environment": [
        environment(4.0),
        pc.PointLight((1.5, 1.0, 3.0), 1.0),
        pc.ConstantLight(0.2),
        pc.DirectionalLight((-0.5, 0.6, -1.0), 0.2),
        pc.RectangleLight((0.5, 0.5, -2.0), (1.5, 0.0, 0.0), (0.0, 1.5, 0.0), 0.5),
    ],
}
# Narrow lobes are found by scattering, wide ones by looking for lights.
MATERIALS = {
    "diffuse": pc.DiffuseBsdf(0.7),
    "rough": pc.PlyBsdf(base_color=0.8, transmitted_color=0.8, extinction=4.0,
                        roughness=(0.4, 0.5), exit_roughness=(0.5, 0.6)),
    "shiny": pc.PlyBsdf(base_color=0.3, extinction=2.0, roughness=(0.1, 0.1),
                        exit_roughness=(0.1, 0.15)),
}  # fmt: skip


def rendered(bsdf, lights, both_sides, seed):
    """The picture's mean and its variance, one channel."""
    yarn = pc.RoundYarn(0.2, bsdf, plies=1)
    swatch = pc.Swatch(pc.Fabric(pc.WeavePattern.plain(), yarn, yarn, 1.0, 1.0), (4.0, 4.0))
    camera = pc.OrthographicCamera((0.4, -0.8, 2.0), (0, 0, 0), (0, 1, 0), 2.0, (PIXELS, PIXELS))
    picture = pc.render(
        pc.Scene(swatch, camera, lights),
        spp=SPP,
        seed=seed,
        max_depth=6,
        both_sides=both_sides,
        progress=False,
    )
    value, variance = np.asarray(picture, float)[..., 1], picture.variance[..., 1].astype(float)
    return value.mean(), variance.mean() / PIXELS**2


def black(light):
    return {"radiance": 0.0} if isinstance(light, pc.RectangleLight) else {}


@pytest.mark.parametrize(
    ("material", "both_sides"),
    [("diffuse", False), ("rough", False), ("rough", True), ("shiny", False), ("shiny", True)],
)
@pytest.mark.parametrize("lights", LIGHTS)
def test_lights_together_are_the_sum_of_each_alone(lights, material, both_sides):
    """Rectangles stand in the way of other lights: dark, they stay."""
    bsdf, lights = MATERIALS[material], LIGHTS[lights]
    dark = [replace(each, radiance=0.0) for each in lights if isinstance(each, pc.RectangleLight)]
    together, variance = rendered(bsdf, lights, both_sides, 1)
    parts = []
    for i, light in enumerate(lights):
        others = [other for other in dark if replace(light, **black(light)) != other]
        parts.append(rendered(bsdf, [light, *others], both_sides, 2 + i))
    apart = sum(mean for mean, _ in parts)
    error = np.sqrt(variance + sum(part for _, part in parts))
    z = (together - apart) / error
    print(f"z {z:+.2f}, {together:.5f} {apart:.5f}, relative error {error / apart:.5f}")
    tests = 5 * len(LIGHTS)
    assert abs(z) < stats.norm.isf(0.5 * (1.0 - (1.0 - SIGNIFICANCE) ** (1.0 / tests)))
    assert error < 1.5e-2 * apart, "too noisy to tell"


def test_a_light_in_two_halves_is_the_whole():
    """Chosen twice as often and half as bright, of a kind that scattering finds too."""
    bsdf = MATERIALS["rough"]
    for kind, value in [("constant", 1.0), ("environment", 1.0)]:
        make = pc.ConstantLight if kind == "constant" else environment
        whole, var = rendered(bsdf, [make(value)], False, 1)
        halves, var_halves = rendered(bsdf, [make(0.25 * value), make(0.75 * value)], False, 2)
        z = (whole - halves) / np.sqrt(var + var_halves)
        assert abs(z) < 4.0, (kind, z, whole, halves)
