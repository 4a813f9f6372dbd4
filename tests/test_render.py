"""Pictures: the same bits however they are made, stopped and gone on with, and their errors."""

import itertools
import multiprocessing
import os
import time

import numpy as np
import plycloth as pc
import pytest
from samples import plain_fabric

LIGHTS = (pc.PointLight((1.0, 2.0, 3.0), 40.0), pc.ConstantLight((0.2, 0.3, 0.4)))


def scene(lights=LIGHTS, resolution=(24, 16)):
    camera = pc.OrthographicCamera((0, 0, 5), (0, 0, 0), width_mm=1.0, resolution=resolution)
    return pc.Scene(pc.Swatch(plain_fabric(), (4.0, 4.0)), camera, lights)


def same(a, b):
    return a.pixels.tobytes() == b.pixels.tobytes()


def test_threads_and_passes_leave_every_bit_as_it_is():
    expected = pc.render(scene(), spp=16, seed=3, progress=False)
    for threads in (1, 2):
        renderer = pc.Renderer(scene(), seed=3)
        for _ in range(16):
            renderer.run(1, threads=threads, progress=False)
        assert renderer.samples == 16
        assert same(renderer.image(), expected)
    assert not same(pc.render(scene(), spp=16, seed=4, progress=False), expected)


def test_an_interrupted_picture_is_gone_on_with():
    class InterruptionError(Exception):
        pass

    def stop(done, total):
        if 0 < done < total:
            raise InterruptionError

    big = scene(resolution=(300, 200))
    expected = pc.render(big, spp=9, progress=False)
    renderer = pc.Renderer(big)
    with pytest.raises(InterruptionError):
        renderer.run(8, progress=stop)
    partial = renderer.image().pixels
    assert partial.any()
    seen = []
    renderer.run(1, progress=lambda done, total: seen.append((done, total)))
    assert same(renderer.image(), expected)
    # What the first run left undone counts for the second.
    assert seen[-1] == (seen[0][1], seen[0][1])
    assert 1 * 300 * 200 < seen[0][1] < 9 * 300 * 200
    assert all(a <= b for (a, _), (b, _) in itertools.pairwise(seen))


def test_many_samples_of_one_pixel_are_stopped_within_a_second():
    class InterruptionError(Exception):
        pass

    def stop(done, total):
        raise InterruptionError

    start = time.perf_counter()
    with pytest.raises(InterruptionError):
        pc.Renderer(scene(resolution=(1, 1))).run(2**31, progress=stop)
    assert time.perf_counter() - start < 5.0


@pytest.mark.filterwarnings("ignore:.*fork:DeprecationWarning")
@pytest.mark.skipif(not hasattr(os, "fork"), reason="there are no forks on this system")
def test_a_forked_process_renders_as_well():
    """No thread that the parent started is there in the child."""
    pc.render(scene(), spp=1, progress=False)
    child = multiprocessing.get_context("fork").Process(
        target=pc.render, args=(scene(),), kwargs={"spp": 1, "progress": False}
    )
    child.start()
    child.join(60)
    is_done = child.exitcode == 0
    child.kill()
    assert is_done


def test_variance_is_that_of_the_mean():
    """z-scores of two independent pictures have variance one."""
    many = [pc.render(scene(), spp=256, seed=seed, progress=False) for seed in (1, 2)]
    z = many[0].z_scores(many[1])
    z = z[np.isfinite(z) & (z != 0.0)]
    # Pixels' three channels share their samples: count a third of them as independent.
    assert abs(z.std() - 1.0) < 4.0 / np.sqrt(2.0 * z.size / 3.0)
    assert abs(z.mean()) < 4.0 / np.sqrt(z.size / 3.0)


def test_looking_for_light_on_both_sides_changes_noise_alone():
    behind = scene((pc.PointLight((0.0, 0.0, -3.0), 40.0),))
    one = pc.render(behind, spp=256, progress=False)
    both = pc.render(behind, spp=256, seed=1, both_sides=True, progress=False)
    difference = one.pixels.mean(dtype=float) - both.pixels.mean(dtype=float)
    deviations = [np.sqrt(i.variance.sum(dtype=float)) / i.pixels.size for i in (one, both)]
    # The channels of a pixel vary together: three times the variance of independent ones.
    assert abs(difference) < 4.0 * np.sqrt(3.0) * np.hypot(*deviations)
    assert deviations[1] < deviations[0]


def test_depth_one_sees_lights_alone():
    camera = pc.OrthographicCamera((0, 0, 5), (0, 0, 0), width_mm=8.0, resolution=(8, 8))
    swatch = pc.Swatch(plain_fabric(), (4.0, 4.0))
    sky = pc.Scene(swatch, camera, (pc.ConstantLight((0.2, 0.3, 0.4)),))
    pixels = pc.render(sky, spp=4, max_depth=1, progress=False).pixels
    assert np.allclose(pixels[0, 0], (0.2, 0.3, 0.4))
    assert pixels[4, 4].max() < 0.4


@pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")
def test_cloth_that_absorbs_nothing_loses_no_light():
    """However often it is scattered. Smooth plies, since rough ones mask some of their light."""
    white = pc.PlyBsdf(
        specular_tint=1,
        transmission_tint=1,
        base_color=1,
        transmitted_color=1,
        roughness=0.01,
        exit_roughness=0.01,
    )
    yarn = pc.RoundYarn(0.11, white)
    fabric = plain_fabric(warp=yarn, weft=yarn, weft_spacing_mm=0.25)
    camera = pc.OrthographicCamera((0, 0, 5), (0, 0, 0), width_mm=1.0, resolution=(32, 32))
    sky = pc.Scene(pc.Swatch(fabric, (20.0, 20.0)), camera, (pc.ConstantLight(1.0),))
    pixels = pc.render(sky, spp=64, progress=False)
    # The channels of a pixel are the same.
    error = np.sqrt(pixels.variance[..., 0].sum(dtype=float)) / pixels.pixels[..., 0].size
    assert error < 0.01
    assert abs(pixels.pixels.mean(dtype=float) - 1.0) < 0.005 + 4.0 * error
    shortened = pc.render(sky, spp=64, max_depth=8, progress=False)
    assert shortened.pixels.mean() < 0.95


def test_a_draft_is_seen_as_it_is_drawn():
    """White warp over black weft, from above: bright where the drawdown is."""
    warp_up = np.array([[1, 1, 0, 0, 0], [0, 0, 0, 1, 0], [1, 0, 0, 0, 0], [0, 0, 1, 0, 1]], bool)
    yarns = [pc.FlatYarn(0.95, pc.DiffuseBsdf(color)) for color in (1.0, 0.0)]
    fabric = pc.Fabric(pc.WeavePattern(warp_up), *yarns, 1.0, 1.0)
    camera = pc.OrthographicCamera((0, 0, 9), (0, 0, 0), width_mm=5.0, resolution=(5, 4))
    sky = pc.Scene(pc.Swatch(fabric), camera, (pc.ConstantLight(1.0),))
    pixels = pc.render(sky, spp=64, progress=False).pixels[..., 0]
    assert ((pixels > 0.5) == warp_up).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"spp": 0}, r"spp"),
        ({"spp": 2.5}, r"spp"),
        ({"seed": -1}, r"seed"),
        ({"max_depth": 0}, r"max_depth"),
        ({"both_sides": 1}, r"both_sides must be a bool"),
        ({"threads": 0}, r"threads"),
        ({"progress": "yes"}, r"progress"),
    ],
)
def test_bad_options_are_named(options, message):
    with pytest.raises((ValueError, TypeError), match=message):
        pc.render(scene(), **{"spp": 1, "progress": False, **options})


def test_only_scenes_are_rendered():
    with pytest.raises(TypeError, match="scene must be a Scene, not Fabric"):
        pc.render(plain_fabric())
