"""Whole weaves with light that goes from yarn to yarn, against a plain and slow path tracer."""

from dataclasses import replace

import brute_force
import numpy as np
import plycloth as pc
import pytest
from scipy import stats

CROSSINGS = 4
CELLS = 3
PATHS = 63_000
VIEW, WIDTH = (0.9, -0.7, 2.0), 1.2
# Plies of eight pieces a crossing transmit more from behind than smooth ones: 1.5% at a radius of
# 0.2 of the spacing (0.3% with 32 pieces), and less with the square of the bend.
BIAS = 8e-3
SIGNIFICANCE = 1e-3

BRIGHT = pc.PlyBsdf(base_color=(0.8, 0.7, 0.9), transmitted_color=0.8, body_reflection=0.6,
                    roughness=(0.3, 0.4), extinction=8.0)  # fmt: skip
CLEAR = pc.PlyBsdf(base_color=0.9, transmitted_color=(0.5, 0.9, 0.7), extinction=1.5,
                   specular_tint=0.95, roughness=(0.3, 0.3), exit_roughness=(0.4, 0.4))  # fmt: skip
GLASS = replace(CLEAR, extinction=0.0, eta=1.3)
SETS = {"bright": (BRIGHT, BRIGHT), "clear": (CLEAR, CLEAR), "glass on bright": (GLASS, BRIGHT)}
SUNS = {"front": (-0.5, 0.6, -1.0), "back": (0.3, 0.2, 1.0)}
SKY, IRRADIANCE = (0.3, 0.25, 0.5), (1.5, 2.0, 1.0)


def plies(bsdf):
    """Plies a tenth thinner than their yarn, so that crossing ones clear each other."""
    return pc.RoundYarn(0.14, bsdf, plies=1, ply_radius_mm=0.126)


def ribbon(bsdf):
    return pc.FlatYarn(0.6, bsdf, thickness_mm=0.12)


def fabric_of(warp, weft):
    return pc.Fabric(pc.WeavePattern.plain(), warp, weft, 1.0, 1.0, collision_stiffness=1e4)


def surfaces(yarn, curves):
    if isinstance(yarn, pc.FlatYarn):
        return brute_force.Ribbons(curves, CROSSINGS, yarn.width_mm, yarn.thickness)
    return brute_force.Plies(curves, CROSSINGS, yarn.ply_radius)


def cloth_of(fabric):
    yarns, curves = (fabric.warp, fabric.weft), brute_force.curves_of(fabric, CROSSINGS)
    sets = tuple(surfaces(*pair) for pair in zip(yarns, curves, strict=True))
    return brute_force.Cloth(sets, (fabric.warp.bsdf, fabric.weft.bsdf), CROSSINGS)


def camera_rays(rng):
    """Rays of the orthographic camera, and the cell of each, row by row from the top."""
    forward = brute_force.unit(-np.array(VIEW))
    right = brute_force.unit(np.cross(forward, [0.0, 1.0, 0.0]))
    cell = np.arange(PATHS) % CELLS**2
    place = np.stack([cell % CELLS, cell // CELLS], axis=-1) + rng.random((PATHS, 2))
    u, v = WIDTH * (place / CELLS - 0.5).T[:, :, None]
    origin = np.array(VIEW) + u * right - v * np.cross(right, forward)
    return cell, origin, np.tile(forward, (PATHS, 1))


def brute(fabric, sky, sun, irradiance):
    """Means of the cells and their variances."""
    tracer = brute_force.Tracer(cloth_of(fabric), sky, sun, irradiance, seed=1)
    cell, *rays = camera_rays(np.random.default_rng(2))
    values = tracer.radiance(*rays)
    values = np.array([values[cell == each] for each in range(CELLS**2)])
    shape = CELLS, CELLS, 3
    variance = values.var(axis=1) / values.shape[1]
    return values.mean(axis=1).reshape(shape), variance.reshape(shape)


def ours(fabric, lights):
    size, pixels = float(CROSSINGS), 8
    camera = pc.OrthographicCamera(VIEW, (0, 0, 0), (0, 1, 0), WIDTH, (CELLS * pixels,) * 2)
    scene = pc.Scene(pc.Swatch(fabric, (size, size)), camera, lights)
    picture = pc.render(scene, spp=512, seed=4, max_depth=200, progress=False)

    def cells(values):
        shape = CELLS, pixels, CELLS, pixels, 3
        return np.asarray(values, float).reshape(shape).mean(axis=(1, 3))

    return cells(picture), cells(picture.variance) / pixels**2


def assert_same(fabric, sky, sun, irradiance):
    lights = [pc.ConstantLight(sky), pc.DirectionalLight(sun, irradiance)]
    lights = [light for light, on in zip(lights, (any(sky), any(irradiance)), strict=True) if on]
    (a, var_a), (b, var_b) = ours(fabric, lights), brute(fabric, sky, sun, irradiance)
    z = (a - b) / np.sqrt(var_a + var_b + (BIAS * b) ** 2)
    largest = stats.norm.isf(0.5 * (1.0 - (1.0 - SIGNIFICANCE) ** (1.0 / z.size)))
    whole = (a - b).mean(axis=(0, 1))
    error = np.sqrt((var_a + var_b).sum(axis=(0, 1))) / CELLS**2
    summary = (
        f"z up to {np.abs(z).max():.2f} (allowed {largest:.2f}), whole off by"
        f" {whole / b.mean(axis=(0, 1))} +- {error / b.mean(axis=(0, 1))}"
    )
    print(summary)
    assert np.abs(z).max() < largest, summary
    allowed = np.sqrt(error**2 + (BIAS * b.mean(axis=(0, 1))) ** 2)
    assert (np.abs(whole) < stats.norm.isf(SIGNIFICANCE / 6.0) * allowed).all(), summary
    assert (error < 0.015 * b.mean(axis=(0, 1))).all(), summary


@pytest.mark.parametrize("sun", SUNS)
@pytest.mark.parametrize("bsdfs", SETS)
def test_round_plies(bsdfs, sun):
    fabric = fabric_of(*map(plies, SETS[bsdfs]))
    assert_same(fabric, SKY, SUNS[sun], IRRADIANCE)


@pytest.mark.parametrize("sun", SUNS)
def test_ribbons(sun):
    fabric = fabric_of(ribbon(BRIGHT), ribbon(CLEAR))
    assert_same(fabric, SKY, SUNS[sun], IRRADIANCE)


def test_plies_over_ribbons():
    fabric = fabric_of(plies(CLEAR), ribbon(BRIGHT))
    assert_same(fabric, SKY, SUNS["front"], IRRADIANCE)
