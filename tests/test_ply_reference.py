"""Every lobe of the ply BSDF against another evaluation of it, alone and in a picture."""

from dataclasses import replace
from functools import cache

import numpy as np
import ply_reference as reference
import plycloth as pc
import pytest
from scipy import stats

SIGNIFICANCE = 1e-3
WIDTHS = [(0.2, 0.3), (0.05, 0.6), (1.0, 1.0)]
COLORS = [0.0, 0.1, 0.5, 0.95, 1.0]

BSDF = pc.PlyBsdf(
    eta=1.4,
    specular_tint=(0.9, 0.8, 0.7),
    transmission_tint=(0.6, 0.9, 1.0),
    base_color=(0.9, 0.5, 0.1),
    transmitted_color=(0.3, 0.6, 0.9),
    body_reflection=0.4,
    extinction=12.0,
    roughness=(0.4, 0.5),
    exit_roughness=(0.5, 0.6),
)
RIBBONS = {
    "default": pc.PlyBsdf(),
    "colored": BSDF,
    "clear": replace(BSDF, extinction=0.0, eta=1.8),
    "dense": replace(BSDF, extinction=60.0),
    "body": replace(BSDF, transmission_tint=0, body_reflection=0.7, roughness=(1.0, 1.0)),
    "light": replace(BSDF, transmitted_color=0, base_color=0),
    "printed": replace(BSDF, body="printed"),
}
THICKNESS = 0.1
WO = [np.array([0.48, -0.36, 0.8]), np.array([0.8, 0.3, np.sqrt(0.27)]), np.array([0.0, 0.0, 1.0])]


def directions(count, seed):
    return reference.unit(np.random.default_rng(seed).normal(size=(count, 3)))


def assert_z(z, significance=SIGNIFICANCE):
    """The largest of z-scores by Sidak's bound, their mean, and their sum of squares."""
    z = np.ravel(z)
    largest = stats.norm.isf(0.5 * (1.0 - (1.0 - significance) ** (1.0 / z.size)))
    summary = f"{z.size} values, z {z.mean():+.3f} +- {z.std():.3f}, {np.abs(z).max():.2f}"
    print(summary)
    assert np.abs(z).max() < largest, summary
    assert abs(z.mean()) * np.sqrt(z.size) < stats.norm.isf(0.5 * significance), summary
    assert stats.chi2.sf((z**2).sum(), z.size) > significance, summary


# --- What can be compared to rounding ------------------------------------------------------------


@pytest.mark.parametrize("widths", WIDTHS)
@pytest.mark.parametrize("eta", [1.05, 1.5, 2.5])
def test_interface(eta, widths):
    """Eqs. 8 and 10 on both sides, from both sides."""
    wo, wi = directions(20_000, 1), directions(20_000, 2)
    expected = reference.interface(wo, wi, eta, widths)
    assert (expected > 1e-6).sum() > 2_000
    np.testing.assert_allclose(
        pc.Interface(eta, widths).eval(wo, wi), expected, rtol=2e-6, atol=1e-12
    )


@pytest.mark.parametrize("color", COLORS)
def test_conserving_body(color):
    mu_o, mu_i = np.random.default_rng(3).uniform(0.005, 1.0, (2, 400))
    expected = reference.ConservingBody(color).eval(mu_o, mu_i)
    found = pc.body_reflection(color, mu_o, mu_i)
    np.testing.assert_allclose(found, np.tile(expected[:, None], 3), rtol=1e-5, atol=1e-12)


@pytest.mark.parametrize("eta", [1.05, 1.5, 2.5])
@pytest.mark.parametrize("color", COLORS)
def test_printed_body(color, eta):
    mu_o, mu_i = np.random.default_rng(3).uniform(0.005, 1.0, (2, 400))
    expected = reference.PrintedBody(color, eta).eval(mu_o, mu_i)
    found = pc.body_reflection(color, mu_o, mu_i, eta=eta, body="printed")
    np.testing.assert_allclose(found, np.tile(expected[:, None], 3), rtol=1e-9, atol=1e-12)


def test_the_albedo_of_the_reference_is_the_integral_of_its_values():
    """So that a mistake in the one is none in the other."""
    ribbon, wo = reference.RibbonReference(BSDF, THICKNESS), WO[1]
    wi = directions(4_000, 4)
    values = 4.0 * np.pi * ribbon.eval(wo, wi)
    error = values.std(axis=0) / np.sqrt(len(wi))
    assert_z((values.mean(axis=0) - ribbon.albedo(wo)) / error)


# --- The ribbon: values are means over random ways -----------------------------------------------


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("name", RIBBONS)
def test_ribbon(name, side):
    """`PlyLobes`, with the slant of Eq. 15, the tints, the shares of B and both body lobes."""
    lobes, seeds = pc.PlyLobes(RIBBONS[name], THICKNESS), 16
    ribbon = reference.RibbonReference(RIBBONS[name], THICKNESS)
    z = []
    for number, wo in enumerate(WO):
        wo, wi = wo * [1, 1, side], directions(16, 5 + number)
        expected = ribbon.eval(wo, wi)
        pair = np.tile(wo, (len(wi), 1)), wi
        found = np.array([lobes.eval(*pair, passages=1024, seed=s) for s in range(seeds)])
        error = np.hypot(found.std(axis=0, ddof=1) / np.sqrt(seeds), 5e-4 * expected + 1e-7)
        z.append(((found.mean(axis=0) - expected) / error)[:, 1])
    assert_z(z, 0.1 * SIGNIFICANCE)


# --- The ribbon in a picture ---------------------------------------------------------------------

CAMERAS = {"steep": (0.5, -0.4, 2.0), "slanted": (-2.0, 1.2, 1.1), "below": (1.0, 1.0, -1.2)}
LIGHTS = {
    "front": pc.DirectionalLight((-1.0, 0.5, -1.2), (1.5, 2.0, 0.5)),
    "back": pc.DirectionalLight((-0.3, 0.6, 0.8), (1.5, 2.0, 0.5)),
    "constant": pc.ConstantLight((0.7, 1.0, 0.3)),
}


def lone_ribbon(bsdf):
    """A swatch of one straight flat ribbon along y; the pick is a thread too thin to be seen."""
    thread = pc.FlatYarn(1e-6, pc.DiffuseBsdf(0.0), thickness_mm=1e-6)
    yarn = pc.FlatYarn(0.6, bsdf, thickness_mm=THICKNESS)
    fabric = pc.Fabric(pc.WeavePattern([[True]]), yarn, thread, 1.0, 10.0)
    assert np.ptp(fabric.relaxed().warp_height) < 1e-9
    return pc.Swatch(fabric)


def seen_along(origin, swatch):
    """A camera so close to the ribbon's middle that it sees nothing else."""
    height = float(swatch.fabric.relaxed().warp_height[0, 0]) * swatch.fabric.unit_mm
    target = np.array([0.0, 1.3, height])
    up, width = (0.0, 1.0, 0.3), 0.05
    return pc.OrthographicCamera(tuple(target + origin), tuple(target), up, width, (8, 8))


def local(direction):
    """World to the ribbon's frame: x along the fiber (y of the cloth)."""
    x, y, z = reference.unit(np.asarray(direction, float))
    return np.array([y, -x, z])


@cache
def rendered_reference(extinction, body_reflection):
    bsdf = replace(BSDF, extinction=extinction, body_reflection=body_reflection)
    return lone_ribbon(bsdf), reference.RibbonReference(bsdf, THICKNESS)


def expected_radiance(ribbon, view, light):
    if isinstance(light, pc.ConstantLight):
        return ribbon.albedo(view) * light.radiance
    return ribbon.eval(view, -local(light.direction))[0] * light.irradiance


@pytest.mark.parametrize("both_sides", [False, True])
@pytest.mark.parametrize("light", LIGHTS)
@pytest.mark.parametrize("camera", CAMERAS)
def test_rendered_ribbon(camera, light, both_sides):
    """Nothing else is near, so what is seen is one value of the BSDF, or its integral."""
    z = []
    for extinction, body_reflection in ((12.0, 0.4), (25.0, 0.8)):
        swatch, ribbon = rendered_reference(extinction, body_reflection)
        scene = pc.Scene(swatch, seen_along(CAMERAS[camera], swatch), [LIGHTS[light]])
        picture = pc.render(scene, spp=2048, seed=2, both_sides=both_sides, progress=False)
        mean = np.asarray(picture, float).mean(axis=(0, 1))
        variance = picture.variance.astype(float).mean(axis=(0, 1)) / 64
        expected = expected_radiance(ribbon, local(CAMERAS[camera]), LIGHTS[light])
        error = np.sqrt(variance + (5e-4 * expected) ** 2)
        z.append((mean - expected) / error)
        print(mean, expected, error / expected)
        assert (error < 0.012 * expected).all()
    # Channels share their paths: one is tested.
    assert_z(np.array(z)[:, 1], 0.1 * SIGNIFICANCE)
