"""Photographs that tell nothing, or do not belong together, are named before any work."""

import numpy as np
import plycloth as pc
import pytest
from plycloth import photo_fit
from plycloth.photo_input import read_photographs


@pytest.fixture
def cloth(tmp_path):
    path = tmp_path / "cloth.png"
    light = np.random.default_rng(3).uniform(0.2, 0.6, (64, 64, 3))
    pc.Image(light.astype(np.float32)).save(path, gamma=2.2)
    return path


@pytest.fixture(autouse=True)
def no_search(monkeypatch):
    def searched(*_, **__):
        raise AssertionError("the search was begun")

    monkeypatch.setattr(photo_fit, "Search", searched)


def saved(path, light):
    pc.Image(light.astype(np.float32)).save(path, gamma=2.2)
    return path


def noisy(level):
    """A level and a speck of dust: what a camera makes of it."""
    light = np.full((64, 64, 3), level)
    light[5, 7] = 0.5
    return light


@pytest.mark.parametrize(
    ("level", "message"),
    [
        (1.0, r"odd.png: is white all over, .* expose it less"),
        (3.0, r"odd.png: is white all over"),
        (0.0, r"odd.png: is black all over, .* expose it more"),
        (1e-5, r"odd.png: is black all over"),
        (0.3, r"odd.png: shows one colour all over"),
    ],
)
@pytest.mark.parametrize("side", ["front", "back"])
def test_a_photograph_that_tells_nothing_is_named(level, message, side, cloth, tmp_path):
    odd = saved(tmp_path / "odd.png", noisy(level))
    for other in (cloth, None, odd):
        given = {"front": other, "back": other, side: odd}
        with pytest.raises(pc.ParameterError, match=message):
            pc.fit_photographs(**given)


def test_dark_and_bright_cloth_is_no_black_and_white():
    rng = np.random.default_rng(5)
    for low, high in ((0.0, 0.004), (0.8, 1.5)):
        image = pc.Image(rng.uniform(low, high, (64, 64, 3)).astype(np.float32))
        assert list(read_photographs({"front": image, "back": None}, 2.2)) == ["front"]


def test_light_that_is_none_is_refused():
    light = np.full((64, 64, 3), 0.5)
    light[3, 4, 1] = np.nan
    with pytest.raises(pc.ParameterError, match="front: holds light that is negative, infinite"):
        pc.fit_photographs(pc.Image(light.astype(np.float32)))


def test_sizes_that_differ_are_told(cloth, tmp_path):
    light = np.random.default_rng(4).uniform(0.2, 0.6, (64, 80, 3))
    wide = saved(tmp_path / "wide.png", light)
    with pytest.raises(pc.ParameterError, match=r"cloth.png has 64 x 64 .*wide.png 80 x 64 pixels"):
        pc.fit_photographs(cloth, wide)


def test_photographs_too_small_for_threads_are_named(tmp_path):
    light = np.random.default_rng(4).uniform(0.2, 0.6, (32, 80, 3))
    small = saved(tmp_path / "small.png", light)
    with pytest.raises(pc.ParameterError, match=r"small.png: has 80 x 32 pixels, but at least 64"):
        pc.fit_photographs(small)


def test_a_file_that_is_no_picture_is_told_without_addresses(tmp_path):
    for content, message in ((b"", "the file is empty"), (b"no picture", "none of a known format")):
        path = tmp_path / "none.png"
        path.write_bytes(content)
        with pytest.raises(pc.ImageError, match=f"none.png: not a readable picture: .*{message}"):
            pc.fit_photographs(path)
