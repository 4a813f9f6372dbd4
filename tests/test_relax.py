"""The relaxation against an independent minimiser of an independent energy."""

import os
import pickle
import signal
import subprocess
import sys

import numpy as np
import plycloth as pc
import pytest
from scipy.optimize import minimize

GAUSS_NODES, GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(3)  # exact for the squared slope


RELAX = "pc.relax(up, warp_radius=0.4, weft_radius=0.4)"
OVERLAPS = "pc.Fabric(pc.WeavePattern(up), *[pc.preset('cotton1')] * 2, 1.0, 1.0).overlaps()"


def knots_of(slots):
    """Boundaries and middles of the slots, closed by the period."""
    ends = np.cumsum(slots)
    return np.append(np.column_stack([ends - slots, ends - slots / 2]).ravel(), ends[-1])


def strain(height, slope, knots, stiffness):
    """Eq. 2 by quadrature, and its derivatives; height and slope are yarns x knots."""
    step = np.diff(knots)
    value = 0.0
    by_height, by_slope = np.zeros_like(height), np.zeros_like(slope)
    for node, weight in zip((GAUSS_NODES + 1) / 2, GAUSS_WEIGHTS / 2, strict=True):
        # Derivatives of the cubic Hermite basis.
        rise = (6 * node - 6 * node**2) / step
        start = 1 - 4 * node + 3 * node**2
        end = 3 * node**2 - 2 * node
        derivative = (
            rise * (np.roll(height, -1, 1) - height) + start * slope + end * np.roll(slope, -1, 1)
        )
        pull = stiffness[:, None] * weight * step * derivative
        value += 0.5 * np.sum(pull * derivative)
        by_height += np.roll(pull * rise, 1, 1) - pull * rise
        by_slope += pull * start + np.roll(pull * end, 1, 1)
    return value, by_height, by_slope


class Cell:
    """Eq. 4 of one cell as a function of all heights and slopes."""

    def __init__(self, warp_up, warp, weft, collision_stiffness):
        self.sign = np.where(warp_up, 1.0, -1.0)
        self.picks, self.ends = warp_up.shape
        self.warp, self.weft, self.collision_stiffness = warp, weft, collision_stiffness
        self.distance = weft["radius"][:, None] + warp["radius"]
        self.warp_knots, self.weft_knots = knots_of(weft["spacing"]), knots_of(warp["spacing"])

    def split(self, x):
        half = 2 * self.picks * self.ends
        warp, weft = x[: 2 * half], x[2 * half :]
        return (
            *warp.reshape(2, self.ends, 2 * self.picks),
            *weft.reshape(2, self.picks, 2 * self.ends),
        )

    def __call__(self, x):
        warp_height, warp_slope, weft_height, weft_slope = self.split(x)
        warp, *warp_by = strain(warp_height, warp_slope, self.warp_knots, self.warp["stiffness"])
        weft, *weft_by = strain(weft_height, weft_slope, self.weft_knots, self.weft["stiffness"])
        ratio = self.sign * (warp_height[:, 1::2].T - weft_height[:, 1::2]) / self.distance
        if ratio.min() <= 0:
            return np.inf, np.zeros_like(x)
        d = ratio**2
        collision = np.where(d < 1, d**-2.0 + d**2 - 2, 0.0).sum() * self.collision_stiffness
        by_ratio = np.where(d < 1, (2 * d - 2 * d**-3.0) * 2 * ratio, 0.0)
        force = self.collision_stiffness * by_ratio * self.sign / self.distance
        warp_by[0][:, 1::2] += force.T
        weft_by[0][:, 1::2] -= force
        gradient = np.concatenate([part.ravel() for part in (*warp_by, *weft_by)])
        return warp + weft + collision, gradient

    def minimum(self):
        start = np.zeros(8 * self.picks * self.ends)
        warp_height, _, weft_height, _ = self.split(start)
        warp_height[:] = np.repeat(0.45 * (self.sign * self.distance).T, 2, axis=1)
        weft_height[:] = np.repeat(-0.45 * self.sign * self.distance, 2, axis=1)
        options = {"maxiter": 20000, "maxfun": 40000, "maxcor": 50, "ftol": 1e-15, "gtol": 1e-9}
        # A line search that runs into the infinite energy of swapped yarns ends the run: go on.
        for _ in range(20):
            found = minimize(self, start, jac=True, method="L-BFGS-B", options=options)
            if np.abs(found.jac).max() < 1e-5:
                return found.fun
            start = found.x
        raise AssertionError("the minimiser to compare with has not converged")


def per_yarn(rng, count, spread):
    return {
        "radius": rng.uniform(0.4 / spread, 0.4 * spread, count),
        "stiffness": rng.uniform(1 / spread, spread, count),
        "spacing": rng.uniform(1 / spread, spread, count),
    }


def relax_cell(cell, warp_up):
    names = {f"warp_{name}": values for name, values in cell.warp.items()}
    names |= {f"weft_{name}": values for name, values in cell.weft.items()}
    return pc.relax(warp_up, collision_stiffness=cell.collision_stiffness, **names)


def random_cell(seed, spread):
    rng = np.random.default_rng(seed)
    picks, ends = rng.integers(1, 11, 2)
    warp_up = rng.random((picks, ends)) < rng.uniform(0.2, 0.8)
    warp, weft = per_yarn(rng, ends, spread), per_yarn(rng, picks, spread)
    return warp_up, Cell(warp_up, warp, weft, collision_stiffness=rng.uniform(0.3, 3.0))


@pytest.mark.parametrize("spread", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("seed", range(8))
def test_energy_is_that_of_another_minimiser(seed, spread):
    warp_up, cell = random_cell(seed, spread)
    relaxed = relax_cell(cell, warp_up)
    assert relaxed.energy == pytest.approx(cell.minimum(), rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_returned_curves_have_the_energy_and_its_gradient_vanishes(seed):
    warp_up, cell = random_cell(seed, spread=2.0)
    relaxed = relax_cell(cell, warp_up)
    x = np.concatenate(
        [
            part.ravel()
            for part in (
                relaxed.warp_height,
                relaxed.warp_slope,
                relaxed.weft_height,
                relaxed.weft_slope,
            )
        ]
    )
    energy, gradient = cell(x)
    assert relaxed.energy == pytest.approx(energy, rel=1e-12, abs=1e-15)
    assert np.linalg.norm(gradient) < 1e-6
    assert relaxed.gradient_norm < 1e-6


@pytest.mark.parametrize(
    ("pattern", "energy", "height", "slope"),
    [
        (pc.WeavePattern.plain(), 2.761084, (-0.383836, 0.383836), 0.575754),
        (pc.WeavePattern.twill(2, 2), 5.329111, (-0.408261, 0.408261), 0.685879),
        (pc.WeavePattern.satin(8, 3), 7.050061, (-0.389436, 0.679895), 0.433423),
    ],
)
def test_minima_computed_independently(pattern, energy, height, slope):
    relaxed = pc.relax(pattern, warp_radius=0.4, weft_radius=0.4)
    assert relaxed.energy == pytest.approx(energy, abs=1e-6)
    assert relaxed.warp_height.min() == pytest.approx(height[0], abs=1e-6)
    assert relaxed.warp_height.max() == pytest.approx(height[1], abs=1e-6)
    assert np.abs(relaxed.warp_slope).max() == pytest.approx(slope, abs=1e-6)


def test_order_is_that_of_the_pattern():
    rng = np.random.default_rng(1)
    warp_up = rng.random((40, 30)) < 0.5
    relaxed = pc.relax(warp_up, warp_radius=rng.uniform(0.1, 0.6, 30), weft_radius=0.3)
    warp, weft = relaxed.warp_height[:, 1::2], relaxed.weft_height[:, 1::2]
    assert relaxed.warp_slope.shape == (30, 80)
    assert relaxed.weft_slope.shape == (40, 60)
    np.testing.assert_array_equal(weft < warp.T, warp_up)


def test_an_array_is_a_pattern():
    sizes = {"warp_radius": 0.4, "weft_radius": 0.4}
    assert pc.relax([[1, 0], [0, 1]], **sizes) == pc.relax(pc.WeavePattern.plain(), **sizes)


def test_result_is_a_value():
    relaxed = pc.relax(pc.WeavePattern.plain(), warp_radius=0.4, weft_radius=0.4)
    other = pc.relax(pc.WeavePattern.plain(), warp_radius=0.4, weft_radius=0.3)
    assert pickle.loads(pickle.dumps(relaxed)) == relaxed != other
    assert "energy=2.76" in repr(relaxed)
    with pytest.raises(ValueError, match="read-only"):
        relaxed.warp_height[0, 0] = 1.0


def test_threads_do_not_change_a_bit():
    script = (
        "import numpy as np, plycloth as pc;"
        "up = np.random.default_rng(3).random((120, 140)) < 0.5;"
        "r = pc.relax(up, warp_radius=0.4, weft_radius=0.3);"
        "print(r.energy.hex(), hash(r.warp_height.tobytes() + r.weft_slope.tobytes()))"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-c", script],
            env=os.environ | {"RAYON_NUM_THREADS": threads, "PYTHONHASHSEED": "0"},
            capture_output=True,
            check=True,
        ).stdout
        for threads in "12"
    }
    assert len(outputs) == 1


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"pattern": np.zeros((0, 2), bool)}, ValueError, "empty|at least"),
        ({"pattern": [True, False]}, ValueError, "two|2"),
        ({"pattern": [[0, 2]]}, ValueError, "0 and 1"),
        ({"warp_radius": np.nan}, pc.ParameterError, "warp_radius must be finite and greater"),
        ({"weft_radius": 0.0}, pc.ParameterError, "weft_radius must be finite and greater"),
        ({"warp_stiffness": -1.0}, pc.ParameterError, "warp_stiffness must be"),
        ({"weft_stiffness": [1.0, -1.0]}, pc.ParameterError, r"weft_stiffness\[1\] must be"),
        ({"warp_radius": [0.4] * 3}, pc.ParameterError, "each of the 2 yarns, not 3 numbers"),
        ({"warp_spacing": np.ones((2, 1))}, pc.ParameterError, "warp_spacing must be an array"),
        ({"weft_spacing": np.inf}, pc.ParameterError, "weft_spacing must be finite"),
        ({"collision_stiffness": 0.0}, pc.ParameterError, "collision_stiffness must be"),
        ({"warp_radius": "thick"}, TypeError, "warp_radius must"),
        ({"warp_radius": 1e300}, pc.ConvergenceError, "no convergence"),
    ],
)
def test_bad_input_names_the_culprit(changes, error, message):
    arguments = {"pattern": np.eye(2, dtype=bool), "warp_radius": 0.4, "weft_radius": 0.4}
    with pytest.raises(error, match=message):
        pc.relax(**(arguments | changes))


@pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")
def test_interrupt_stops_it():
    up = np.random.default_rng(3).random((1500, 1500)) < 0.5
    previous = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.5)
    try:
        with pytest.raises(KeyboardInterrupt):
            pc.relax(up, warp_radius=0.4, weft_radius=0.4)
    finally:
        signal.signal(signal.SIGALRM, previous)


def corner(size):
    """Return a weave of which 6 picks and 4 ends interlace, and all else lies under all ends."""
    up = np.ones((size, size), bool)
    up[:6, :4] = np.random.default_rng(1).random((6, 4)) < 0.5
    return up


def test_threads_that_hold_nothing_cost_nothing():
    few = pc.relax(corner(60), warp_radius=0.4, weft_radius=0.4)
    many = pc.relax(corner(1200), warp_radius=0.4, weft_radius=0.4)
    assert max(few.iterations, many.iterations) < 20
    # Longer floats pull a little less.
    assert 0.95 * few.energy < many.energy < few.energy


@pytest.mark.parametrize("size", [7, 11])
def test_their_minimum_is_that_of_another_minimiser(size):
    rng = np.random.default_rng(size)
    warp, weft = per_yarn(rng, size, 1.5), per_yarn(rng, size, 1.5)
    cell = Cell(corner(size), warp, weft, collision_stiffness=1.0)
    relaxed = relax_cell(cell, corner(size))
    assert relaxed.energy == pytest.approx(cell.minimum(), rel=1e-6, abs=1e-9)


def test_progress_is_told_to_its_end():
    up = np.random.default_rng(3).random((150, 150)) < 0.5
    calls = []
    pc.relax(
        up,
        warp_radius=0.4,
        weft_radius=0.4,
        progress=lambda done, total: calls.append((done, total)),
    )
    assert calls[-1] == (100, 100)
    assert calls == sorted(calls)


@pytest.mark.skipif(sys.platform != "linux", reason="limits memory as Linux does")
@pytest.mark.parametrize("what", [RELAX, OVERLAPS])
def test_memory_that_cannot_be_had_is_an_error(what):
    script = f"""
import resource
import numpy as np
import plycloth as pc
up = np.random.default_rng(3).random((4000, 4000)) < 0.5
resource.setrlimit(resource.RLIMIT_AS, (3 * 2**29, 3 * 2**29))
try:
    {what}
except MemoryError as error:
    assert "relaxing 4000 picks x 4000 ends takes 1.6 GB of memory" in str(error), error
else:
    raise AssertionError("no error")
"""
    subprocess.run([sys.executable, "-c", script], check=True, timeout=120)
