import io
import pickle
from math import gcd

import numpy as np
import plycloth as pc
import pytest
from PIL import Image


def pixels(shown) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(shown._repr_png_())).convert("RGB"))


@pytest.mark.parametrize(
    ("pattern", "rows"),
    [
        (pc.WeavePattern.plain(), "#. .#"),
        (pc.WeavePattern.basket(1), "#. .#"),
        (pc.WeavePattern.basket(2), "##.. ##.. ..## ..##"),
        (pc.WeavePattern.twill(1, 1), "#. .#"),
        (pc.WeavePattern.twill(2, 1), "##. #.# .##"),
        (pc.WeavePattern.twill(1, 3), "#... ...# ..#. .#.."),
        (pc.WeavePattern.twill(2, 2), "##.. #..# ..## .##."),
        (pc.WeavePattern.satin(5, 2), ".#### ##.## ####. #.### ###.#"),
        (pc.WeavePattern.twill(2, 1).flipped(), "#.. .#. ..#"),
    ],
)
def test_weaves_look_as_the_books_have_them(pattern, rows):
    assert str(pattern).split("\n") == rows.split(" ")


@pytest.mark.parametrize(("over", "under"), [(1, 1), (3, 1), (1, 2), (5, 3)])
def test_every_end_of_a_twill_goes_over_then_under(over, under):
    warp_up = pc.WeavePattern.twill(over, under).warp_up
    assert (warp_up.sum(axis=0) == over).all()
    changes = warp_up != np.roll(warp_up, 1, axis=0)
    assert (changes.sum(axis=0) == 2).all()  # one float on each side, around the repeat


def test_a_satin_binds_each_end_and_pick_once_and_no_two_bindings_touch():
    for ends in range(5, 20):
        for step in (k for k in range(2, ends - 1) if gcd(k, ends) == 1):
            bound = ~pc.WeavePattern.satin(ends, step).warp_up
            assert (bound.sum(axis=0) == 1).all()
            assert (bound.sum(axis=1) == 1).all()
            for dx in (-1, 1):
                assert not (bound & np.roll(bound, (1, dx), axis=(0, 1))).any()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: pc.WeavePattern.satin(6, 2), "no 6-end satin: ends must be 5, or 7"),
        (lambda: pc.WeavePattern.satin(4, 2), "no 4-end satin"),
        (lambda: pc.WeavePattern.satin(8, 2), "must be one of 3, 5, not 2"),
        (lambda: pc.WeavePattern.satin(8, 7), "must be one of 3, 5, not 7"),
        (lambda: pc.WeavePattern.satin(8, 11), "must be one of 3, 5, not 11"),
        (lambda: pc.WeavePattern.satin(8, 2.5), "step must be an integer of at least 1, not 2.5"),
        (lambda: pc.WeavePattern.twill(0, 2), "over must be an integer of at least 1, not 0"),
        (lambda: pc.WeavePattern.twill(2, -1), "under must be an integer"),
        (lambda: pc.WeavePattern.twill(2, True), "under must be an integer"),
        (lambda: pc.WeavePattern.basket("2"), "n must be an integer"),
        (lambda: pc.WeavePattern([]), "picks x ends"),
        (lambda: pc.WeavePattern([True, False]), "picks x ends"),
        (lambda: pc.WeavePattern(np.zeros((0, 4))), "picks x ends"),
        (lambda: pc.WeavePattern(np.zeros((2, 2, 2))), r"not of shape \(2, 2, 2\)"),
        (lambda: pc.WeavePattern([[1, 0], [1]]), "rows differ in length"),
        (lambda: pc.WeavePattern([[0, 2], [1, 0]]), "only booleans, or 0 and 1"),
        (lambda: pc.WeavePattern([[0.0, np.nan]]), "only booleans, or 0 and 1"),
        (lambda: pc.WeavePattern(["#.", ".#"]), "picks x ends"),
        (lambda: pc.WeavePattern([["#", "."]]), "only booleans, or 0 and 1"),
        (lambda: pc.WeavePattern([[None]]), "only booleans, or 0 and 1"),
    ],
)
def test_bad_weaves(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_a_pattern_is_a_value():
    source = np.array([[1, 0, 1], [0, 1, 1]])
    pattern = pc.WeavePattern(source)
    same = pc.WeavePattern(source.astype(bool).tolist())
    assert (pattern.picks, pattern.ends) == (2, 3)
    assert repr(pattern) == "WeavePattern(2 picks x 3 ends)"
    assert pattern == same
    assert hash(pattern) == hash(same)
    assert pattern != pc.WeavePattern(source.reshape(3, 2))
    assert pattern != pc.WeavePattern(1 - source)
    assert pattern != "pattern"
    source[:] = 0
    assert pattern == same
    copy = pickle.loads(pickle.dumps(pattern))
    assert copy == pattern
    assert not copy.warp_up.flags.writeable
    with pytest.raises(ValueError, match="read-only"):
        pattern.warp_up[0, 0] = False
    with pytest.raises(AttributeError):
        pattern.warp_up = source


def test_the_back_of_the_back_is_the_face():
    pattern = pc.WeavePattern(np.random.default_rng(3).random((7, 4)) < 0.5)
    assert pattern.flipped() != pattern
    assert pattern.flipped().flipped() == pattern


def test_rows_are_read_as_they_are_printed():
    pattern = pc.WeavePattern(np.random.default_rng(4).random((5, 7)) < 0.5)
    assert pc.WeavePattern.from_rows(str(pattern)) == pattern
    assert pc.WeavePattern.from_rows(["#.", ".#"]) == pc.WeavePattern.plain()
    for wrong in ("", [], ["#.", "#"], ["#x"], [1], None):
        with pytest.raises(ValueError, match="rows"):
            pc.WeavePattern.from_rows(wrong)


def test_mirrored_patterns_lean_the_other_way():
    twill = pc.WeavePattern.twill(2, 1)
    assert twill.mirrored() != twill
    assert twill.mirrored().mirrored() == twill
    assert (twill.mirrored().warp_up == twill.warp_up[:, ::-1]).all()


def test_the_drawdown_has_the_first_pick_at_the_top_and_the_warp_black():
    pattern = pc.WeavePattern([[1, 1, 0], [0, 0, 0]])
    cell = 16
    centres = pixels(pattern)[cell // 2 :: cell, cell // 2 :: cell, 0]
    assert (centres == np.where(pattern.warp_up, 0, 255)).all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 5000), (100, 384), (385, 20), (1146, 8208)])
def test_a_drawdown_stays_small(shape):
    pattern = pc.WeavePattern(np.random.default_rng(4).random(shape) < 0.5)
    height, width, _ = pixels(pattern).shape
    assert max(height, width) <= 1536
    assert len(pattern._repr_png_()) < 1_000_000


def test_a_large_drawdown_is_averaged():
    plain = pc.WeavePattern(np.indices((2000, 2000)).sum(axis=0) % 2 == 0)
    shown = pixels(plain)
    assert shown.shape == (1000, 1000, 3)
    assert (abs(shown.astype(int) - 127.5) < 1).all()
