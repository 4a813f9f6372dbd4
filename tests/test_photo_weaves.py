"""Weaves that a photograph's spectrum leaves open."""

import numpy as np
import plycloth as pc
import pytest
from plycloth.photo_guess import find_threads
from plycloth.photo_weaves import leaning, leaning_of, that_lean, weaves
from test_spacing import photograph

STEPS = [(r, s) for r in range(3, 11) for s in range(1, r) if np.gcd(r, s) == 1]


@pytest.mark.parametrize(("repeat", "step"), STEPS)
def test_weaves_repeat_and_move_as_the_spectrum_shows(repeat, step):
    for name, pattern in weaves(repeat, step):
        up = pattern.warp_up
        assert up.shape == (repeat, repeat), name
        for above, below in zip(up, np.roll(up, -1, axis=0), strict=True):
            assert np.array_equal(below, np.roll(above, step)), name
        assert up.sum(axis=0).min() > 0, name
        assert up.sum(axis=0).max() < repeat, name


@pytest.mark.parametrize(("repeat", "step"), [(None, None), (1, None), (6, None), (6, 2), (8, 4)])
def test_without_a_common_weave_the_most_common_are_tried(repeat, step):
    names = [name for name, _ in weaves(repeat, step)]
    assert len(names) == len(set(names)) == 7
    assert "plain" in names


def test_twills_lean_as_their_names_say():
    assert leaning_of(pc.WeavePattern.twill(3, 1), 5.0, 5.0) == 1
    for repeat, step, hand, way in ((4, 3, "Z", 1), (4, 1, "S", -1), (3, 2, "Z", 1)):
        for name, pattern in weaves(repeat, step):
            assert name.endswith(f"{hand} twill")
            assert leaning_of(pattern, 6.1, 5.3) == way
    assert leaning_of(pc.WeavePattern.plain(), 5.0, 5.0) == 0


@pytest.mark.parametrize("step", [1, 3])
def test_a_twill_on_a_photograph_leans_as_the_weaves_that_are_tried(step):
    """Also where yarns are thinner than two pixels, and what is seen of them is an alias."""
    pattern = weaves(4, step)[0][1]
    for warp_px, weft_px in ((5.2, 4.4), (1.3, 2.6)):
        image = photograph(pattern.warp_up, warp_px, weft_px, size=(512, 512))
        threads = find_threads({"front": np.repeat(image[..., None], 3, axis=2)})
        assert threads.sure
        wanted = leaning(threads.spacing.peaks)
        assert wanted != 0
        assert {leaning_of(weave, warp_px, weft_px) for _, weave in threads.likely()} == {wanted}


def test_weaves_of_the_other_way_are_left_out():
    kept = [name for name, _ in that_lean(weaves(None), 1, 6.0, 6.0)]
    assert "2/2 Z twill" in kept
    # Nor does a plain weave have such lines.
    assert not {"2/2 S twill", "plain"} & set(kept)
    assert len(that_lean(weaves(None), 0, 6.0, 6.0)) == len(weaves(None))


def test_the_photograph_that_tells_most_is_taken():
    clear = photograph(weaves(4, 1)[0][1].warp_up, 5.2, 4.4)
    blank = np.random.default_rng(1).normal(1.0, 0.1, clear.shape)
    images = {"front": np.repeat(blank[..., None], 3, 2), "back": np.repeat(clear[..., None], 3, 2)}
    threads = find_threads(images)
    assert threads.side == "back"
    assert threads.pitch_px == pytest.approx((5.2, 4.4), rel=0.02)
    assert find_threads({"front": images["front"]}).pitch_px == (2.0, 2.0)
