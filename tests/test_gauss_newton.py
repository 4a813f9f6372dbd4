"""Pooled paths, settling and standard errors, on a linear problem whose answers are known."""

import numpy as np
import pytest
from plycloth.gauss_newton import settle
from plycloth.identify import identify
from plycloth.pool import Linear, pool

CELLS, CHANNELS, UNKNOWNS = 300, 3, 4
HIDDEN = np.array([0.3, 0.5, 0.6, 0.45])
LABELS = ["a", "b", "c", "d"]
generator = np.random.default_rng(3)
# All channels of a cell tell the same.
SLOPES = np.repeat(generator.normal(size=(CELLS, UNKNOWNS)), CHANNELS, axis=0)
SLOPES *= [1.0, 1.0, 0.3, 0.1]
# Noise of the picture: the channels of a cell are off together, and cells differ.
CELL_NOISE = generator.uniform(0.01, 0.2, CELLS)


def picture(generator):
    """How far off each residual of a picture is."""
    return np.repeat(CELL_NOISE * generator.normal(size=CELLS), CHANNELS)


def seen(generator, off, u, sets, noise):
    """Residuals and slopes at `u` by sets of paths whose noise in both goes together."""
    for _ in range(sets):
        stray = noise * generator.normal(size=len(SLOPES))
        yield Linear(u, SLOPES @ (u - HIDDEN) + off + stray, SLOPES + stray[:, None])


def test_noise_of_paths_does_not_add_to_gradient_and_curvature():
    generator = np.random.default_rng(1)
    u = HIDDEN + 0.02
    pools = [pool(list(seen(generator, 0.0, u, 2, 0.5)), u) for _ in range(400)]
    for values, expected in (
        ([p.gradient for p in pools], 2.0 * SLOPES.T @ SLOPES @ (u - HIDDEN)),
        ([p.curvature for p in pools], SLOPES.T @ SLOPES),
    ):
        error = np.std(values, axis=0) / 20.0
        assert (np.abs(np.mean(values, axis=0) - expected) < 5.0 * error).all()


def test_settling_finds_the_least_squares_of_all_paths():
    generator = np.random.default_rng(2)
    off = picture(generator)
    exact = HIDDEN - np.linalg.lstsq(SLOPES, off, rcond=None)[0]
    near = [
        each
        for shift in (-0.03, 0.01, 0.04)
        for each in seen(generator, off, HIDDEN + shift, 200, 0.02)
    ]
    far = list(seen(generator, off + 5.0, HIDDEN + 0.3, 20, 0.02))
    assert settle(near + far, HIDDEN) == pytest.approx(exact, abs=2e-3)
    assert (settle(far, HIDDEN) == HIDDEN).all()


def test_one_unknown_settles():
    slopes = SLOPES[:, :1]
    off = picture(np.random.default_rng(6))
    exact = HIDDEN[:1] - np.linalg.lstsq(slopes, off, rcond=None)[0]
    near = [
        Linear(u, slopes @ (u - HIDDEN[:1]) + off, slopes)
        for u in (HIDDEN[:1] - 0.03, HIDDEN[:1] + 0.01)
    ]
    assert settle(near, HIDDEN[:1]) == pytest.approx(exact, abs=1e-5)


def test_unknowns_that_change_nothing_stay_and_are_not_told():
    for count in (1, UNKNOWNS):
        u = HIDDEN[:count]
        off = picture(np.random.default_rng(7))
        near = [Linear(u, off, np.zeros((len(off), count)))] * 2
        assert (settle(near, u) == u).all()
        deviations, weak, partners = identify(pool(near, u), 0.01, LABELS[:count])
        assert weak.all()
        assert np.isfinite(deviations).all()
        assert (deviations > 1.0).all()
        assert not any(partners)


def test_settling_stays_within_bounds():
    u = np.array([0.02, 0.5, 0.5, 0.5])
    beyond = [Linear(u, SLOPES @ (u + 0.05), SLOPES) for _ in range(2)]
    assert settle(beyond, u)[0] == 0.0


def test_standard_errors_are_those_that_other_pictures_show():
    generator = np.random.default_rng(4)
    found, stated = [], []
    for _ in range(300):
        off = picture(generator)
        found.append(HIDDEN - np.linalg.lstsq(SLOPES, off, rcond=None)[0])
        near = list(seen(generator, off, found[-1], 2, 0.0))
        deviations, weak, _ = identify(pool(near, found[-1]), 1e-9, LABELS)
        stated.append(deviations)
        assert not weak.any()
    assert np.mean(stated, axis=0) == pytest.approx(np.std(found, axis=0), rel=0.15)


def test_unknowns_that_trade_are_weak_and_name_each_other():
    slopes = SLOPES.copy()
    slopes[:, 1] = -2.0 * slopes[:, 0]
    near = [Linear(HIDDEN, picture(np.random.default_rng(5)), slopes)] * 2
    _, weak, partners = identify(pool(near, HIDDEN), 0.01, LABELS)
    assert weak.tolist() == [True, True, False, False]
    assert partners[0] == ("b",)
    assert partners[1] == ("a",)
