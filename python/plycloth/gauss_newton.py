"""Gauss-Newton steps within bounds, each found by SLSQP on the quadratic model."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Self

import nlopt
import numpy as np
from numpy.typing import NDArray

from plycloth.pool import LINEAR_RADIUS, Linear, nearby, pool

FloatArray = NDArray[np.float64]

# Relative to the mean squared slope.
FIRST_DAMPING = 1e-2
# Steps that gain less than this part of the objective are the last.
LEAST_GAIN = 3e-3
# Of the quadratic model, for one step.
MODEL_EVALUATIONS = 400
LAST_DAMPING = 1e-6


@dataclass(frozen=True)
class Model:
    """A sum of squares around a point: value, gradient, and half the curvature (of slopes alone).

    Squares count noise as error. The products of two independent halves (`of`) do not, in the
    mean; their curvature is made of mean slopes, to be positive.

    Where there is much noise, the value may be small by luck. Points are therefore compared by
    upper bounds: value and standard error together.
    """

    value: float
    error: float
    gradient: FloatArray
    curvature: FloatArray

    @classmethod
    def of(cls, first: Linear, second: Linear) -> Self:
        """Return the model that two independent halves make at the point where both are."""
        slopes = 0.5 * (first.slopes + second.slopes)
        gradient = second.residuals @ first.slopes + first.residuals @ second.slopes
        products = first.residuals * second.residuals
        error = len(products) ** 0.5 * float(products.std())
        return cls(float(products.sum()), error, gradient, slopes.T @ slopes)

    @property
    def bound(self) -> float:
        """What the value hardly exceeds."""
        return self.value + self.error


def minimise(
    model: Callable[[FloatArray], Model],
    u: FloatArray,
    start: Model,
    radius: float,
    evaluations: int,
) -> tuple[FloatArray, int, float]:
    """Lower a sum of squares of unknowns within [0, 1], starting from `u`.

    Parameters
    ----------
    model
        Asked for the objective at other points.
    u, start
        Where to begin, and the model there.
    radius
        No unknown moves further than this.
    evaluations
        At most so many times the model is asked.

    Returns
    -------
    The best point, how often the model was asked, and the objective there.
    """
    low, high = np.maximum(0.0, u - radius), np.minimum(1.0, u + radius)
    best, here, damping = u, start, FIRST_DAMPING
    for used in range(1, evaluations + 1):
        shift = damping * np.trace(here.curvature) / len(u)
        damped = here.curvature + shift * np.eye(len(u))
        proposed = _model_minimum(here.gradient, damped, best, (low, high))
        there = model(proposed)
        gain = here.bound - there.bound
        if gain > 0.0:
            best, here = proposed, there
            damping *= 0.3
            if gain < LEAST_GAIN * here.bound:
                return best, used, here.value
        else:
            damping *= 10.0
    return best, evaluations, here.value


def settle(seen: Sequence[Linear], u: FloatArray) -> FloatArray:
    """Find the least squares near `u` of all that independent paths have seen there.

    Noise of the paths averages out.
    """
    near = nearby(seen, u)
    if len(near) < 2:
        return u
    pooled = pool(near, u)
    curvatures = np.linalg.eigvalsh(pooled.curvature)
    damping = max(-2.0 * curvatures[0], LAST_DAMPING * curvatures[-1])
    curvature = pooled.curvature + damping * np.eye(len(u))
    bounds = np.maximum(0.0, u - LINEAR_RADIUS), np.minimum(1.0, u + LINEAR_RADIUS)
    return _model_minimum(pooled.gradient, curvature, u, bounds)


def _model_minimum(
    slope: FloatArray,
    curvature: FloatArray,
    u: FloatArray,
    bounds: tuple[FloatArray, FloatArray],
) -> FloatArray:
    """SLSQP on the quadratic model of the objective around `u`, within bounds.

    The problem has as many unknowns as the fit, and no paths: it takes milliseconds.
    """

    def objective(x: FloatArray, gradient: FloatArray) -> float:
        step = x - u
        curved = curvature @ step
        if gradient.size:
            gradient[:] = 2.0 * curved + slope
        return float(step @ (curved + slope))

    solver = nlopt.opt(nlopt.LD_SLSQP, len(u))
    solver.set_lower_bounds(bounds[0])
    solver.set_upper_bounds(bounds[1])
    solver.set_min_objective(objective)
    solver.set_maxeval(MODEL_EVALUATIONS)
    solver.set_ftol_rel(1e-4)
    best = u
    # Where the line search runs into the last digits, no step is taken.
    with suppress(nlopt.RoundoffLimited):
        best = solver.optimize(u)
    return np.clip(best, *bounds)
