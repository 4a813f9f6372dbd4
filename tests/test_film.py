"""Pictures in the making: looked at, stopped, pickled and merged, also while they run."""

import pickle
import subprocess
import sys
import threading
from types import SimpleNamespace

import numpy as np
import plycloth as pc
import pytest
from plycloth.shared_cloth import compiled_scene
from samples import plain_fabric

LIGHTS = (pc.PointLight((1.0, 2.0, 3.0), 40.0), pc.ConstantLight((0.2, 0.3, 0.4)))


def scene(resolution=(24, 16)):
    camera = pc.OrthographicCamera((0, 0, 5), (0, 0, 0), width_mm=1.0, resolution=resolution)
    return pc.Scene(pc.Swatch(plain_fabric(), (4.0, 4.0)), camera, LIGHTS)


def rendered(samples, seed=0, **options):
    renderer = pc.Renderer(scene(**options), seed=seed)
    renderer.run(samples, progress=False)
    return renderer


class EnoughError(Exception):
    pass


def test_a_picture_is_looked_at_from_the_callback():
    renderer = pc.Renderer(scene((150, 100)))
    seen = []

    def look(done, total):
        seen.append((done / total, renderer.samples, renderer.image()))

    renderer.run(8, progress=look)
    done, samples, images = zip(*seen, strict=True)
    assert any(0.0 < part < 1.0 for part in done)
    assert samples == tuple(sorted(samples))
    # Work goes on while the callback looks.
    assert all(8 * part - 1 <= count for part, count in zip(done, samples, strict=True))
    # What was seen is kept as it was.
    assert all(image.pixels.any() for image, part in zip(images, done, strict=True) if part > 0)
    assert len({image.pixels.tobytes() for image in images}) > 2
    assert images[-1] == renderer.image() == rendered(8, resolution=(150, 100)).image()


def test_a_picture_is_looked_at_from_another_thread():
    renderer = pc.Renderer(scene((150, 100)))
    work = threading.Thread(target=renderer.run, args=(10,), kwargs={"progress": False})
    work.start()
    taken = []
    while work.is_alive():
        taken.append((renderer.samples, np.isfinite(renderer.image().variance).all()))
    work.join()
    assert renderer.samples == 10
    assert any(0 < samples < 10 for samples, _ in taken)
    assert all(is_known for samples, is_known in taken if samples > 1)


def test_two_threads_run_one_picture():
    renderer = pc.Renderer(scene())
    works = [
        threading.Thread(target=renderer.run, args=(50,), kwargs={"progress": False})
        for _ in range(2)
    ]
    for work in works:
        work.start()
    for work in works:
        work.join()
    assert renderer.image() == rendered(100).image()


def test_a_run_that_is_stopped_has_as_many_samples_everywhere():
    renderer = pc.Renderer(scene((40, 25)))

    def stop(done, total):
        if done >= 0.1 * total:
            raise EnoughError

    with pytest.raises(EnoughError):
        renderer.run(200, progress=stop)
    taken = renderer.samples
    assert 20 <= taken < 150
    image = renderer.image()
    short, longer = (rendered(taken + more, resolution=(40, 25)).image() for more in (0, 1))
    same = [(image.pixels == each.pixels).all(axis=2) for each in (short, longer)]
    assert (same[0] | same[1]).all()
    renderer.run(1, progress=False)
    assert renderer.image() == rendered(201, resolution=(40, 25)).image()


def without_size(whole):
    """A stand-in for a scene whose swatch is smaller than nothing: the core panics in it."""
    swatch = SimpleNamespace(extent_mm=(-1.0, 1.0), fabric=whole.swatch.fabric)
    return SimpleNamespace(
        swatch=swatch, camera=whole.camera, lights=whole.lights, background=whole.background
    )


def test_a_panic_is_an_exception_that_spoils_nothing():
    renderer = rendered(2)
    broken = compiled_scene(without_size(scene()))
    with pytest.raises(RuntimeError, match="a fault inside plycloth, please report it: index"):
        renderer._film.run(broken, 3)
    assert renderer.samples == 2
    renderer.run(1, progress=False)
    assert renderer.samples == 6


def test_one_sample_has_no_variance_yet():
    assert np.isinf(rendered(1).image().variance).all()
    assert np.isfinite(rendered(2).image().variance).all()
    assert np.isinf(pc.Renderer(scene()).image().variance).all()


def test_a_pickled_picture_is_gone_on_with():
    renderer = rendered(5, seed=7)
    copy = pickle.loads(pickle.dumps(renderer))
    assert copy.image() == renderer.image()
    assert copy.samples == 5
    assert copy.scene == renderer.scene
    for each in (renderer, copy):
        each.run(4, progress=False)
    assert copy.image() == renderer.image() == rendered(9, seed=7).image()


def test_a_stopped_picture_is_pickled_and_completed():
    def stop(done, total):
        if done > 0:
            raise EnoughError

    renderer = pc.Renderer(scene((40, 25)))
    with pytest.raises(EnoughError):
        renderer.run(40, progress=stop)
    copy = pickle.loads(pickle.dumps(renderer))
    copy.run(1, progress=False)
    assert copy.image() == rendered(41, resolution=(40, 25)).image()


def test_merged_pictures_are_that_of_all_samples():
    parts = [rendered(count, seed) for seed, count in enumerate((10, 20, 30))]
    images = [part.image() for part in parts]
    for part in parts[1:]:
        parts[0].merge(pickle.loads(pickle.dumps(part)))
    merged = parts[0].image()
    assert parts[0].samples == 60
    means = [image.pixels.astype(float) for image in images]
    expected = np.average(means, axis=0, weights=(10, 20, 30))
    np.testing.assert_allclose(merged.pixels, expected, rtol=1e-6)
    # Sums of squares within the parts, and between them.
    squares = sum(
        n * (n - 1) * i.variance.astype(float) + n * (i.pixels - expected) ** 2
        for n, i in zip((10, 20, 30), images, strict=True)
    )
    np.testing.assert_allclose(merged.variance, squares / (60 * 59), rtol=1e-3)
    assert parts[1].image() == images[1]


def test_a_merged_picture_goes_on_with_its_own_samples():
    alone, merged = rendered(5, seed=1), rendered(5, seed=1)
    merged.merge(rendered(10, seed=2))
    for renderer in (alone, merged):
        renderer.run(5, progress=False)
    assert merged.samples == 20
    other = rendered(10, seed=2).image().pixels.astype(float)
    np.testing.assert_allclose(
        merged.image().pixels, 0.5 * (alone.image().pixels + other), rtol=1e-5
    )


def test_what_cannot_be_merged_is_refused():
    renderer = rendered(2, seed=3)
    before = renderer.image()
    for other, message in (
        (renderer, "both have those of seed 3"),
        (rendered(4, seed=3), "both have those of seed 3"),
        (pc.Renderer(scene((8, 8)), seed=4), "the same scene"),
        (pc.Renderer(scene(), seed=4, max_depth=3), "the same max_depth"),
        (pc.Renderer(scene(), seed=4, both_sides=True), "the same both_sides"),
    ):
        with pytest.raises(pc.ParameterError, match=message):
            renderer.merge(other)
    with pytest.raises(TypeError, match="must be a Renderer, not Image"):
        renderer.merge(before)
    both = rendered(2, seed=4)
    both.merge(rendered(2, seed=5))
    renderer.merge(both)
    with pytest.raises(pc.ParameterError, match="seed 5"):
        renderer.merge(rendered(2, seed=5))
    assert renderer.samples == 6


MEASURE = """
import resource, sys
import plycloth as pc
from samples import plain_fabric
camera = pc.OrthographicCamera((0, 0, 5), (9, 9, 0), (0, 1, 0), 0.1, (int(sys.argv[1]), 2000))
scene = pc.Scene(pc.Swatch(plain_fabric()), camera, [pc.ConstantLight(1.0)])
renderer = pc.Renderer(scene)
renderer.run(1, progress=False)
image = renderer.image()
del renderer
image.to_png()
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory is counted in other units")
def test_a_pixel_takes_48_bytes_at_most(request):
    def peak(width):
        command = [sys.executable, "-c", MEASURE, str(width)]
        folder = request.path.parent
        result = subprocess.run(command, check=True, stdout=subprocess.PIPE, cwd=folder)
        return 1024 * int(result.stdout)

    # A picture that shows nothing of the cloth: it takes no time, and its memory is a picture's.
    assert (peak(2000) - peak(500)) / (1500 * 2000) < 48
