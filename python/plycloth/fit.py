"""Inverse rendering: optical parameters from pictures (Montazeri et al. 2020, section 6.2).

The paper minimises the distance of average intensities by SLSQP with finite differences. Here
averages over a grid of cells are compared, and their derivatives are exact: paths are drawn once
from the parameters that a round starts with, and re-weighted for all others
(`_plycloth.CompiledTape`), so that the objective of a round is a smooth function. It is a sum of
squares with known slopes: Gauss-Newton steps lower it, each found by SLSQP on the quadratic model
within bounds and a trust region. Then new paths are drawn at the new parameters, until nothing
moves. The rounds that are left, one at least, go on drawing paths where those of all rounds
together have the minimum (`gauss_newton.settle`): noise of the paths averages out.

Squares of noisy differences count the noise as error, and are least where there is little noise.
Every picture is therefore drawn twice, with independent paths: errors and the objective are
products of the two differences, whose expectation has no noise in it. Such a product can be made
negative by parameters that make much noise; a step that follows its slope, but is curved by the
squares of the mean slopes, does not look for them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from plycloth import _plycloth
from plycloth._check import (
    ParameterError,
    choice,
    integer,
    optional,
)
from plycloth.bsdf import PlyBsdf
from plycloth.fit_input import (
    cell_counts,
    fixed_pictures,
    picture_targets,
    picture_weights,
    scene_list,
    start_bsdfs,
    start_lenses,
)
from plycloth.fit_result import Estimate, FitResult, Match, Step
from plycloth.gauss_newton import Model, minimise, settle
from plycloth.identify import identify
from plycloth.lens import Lens
from plycloth.pool import Linear, Pool, nearby, pool
from plycloth.progress import Progress, reporting
from plycloth.scene import Scene
from plycloth.shared_cloth import compiled_scene
from plycloth.unknowns import (
    FALLOFFS,
    LensUnknown,
    Parameter,
    Unknown,
    lens_unknowns,
    split_bounds,
    unknowns,
    with_lens_values,
    with_values,
)

FloatArray = NDArray[np.float64]
Tapes = tuple[_plycloth.CompiledTape, _plycloth.CompiledTape]

OBJECTIVES = ("grid", "average")
TRUST_RADIUS = 0.15
SMALLEST_TRUST_RADIUS = 0.01
# A round that gains less than this part of the objective counts as a standstill.
STANDSTILL = 0.01
MOST_STANDSTILLS = 4
# Uncertainties take this much noise for granted in every cell: a hundredth of the picture's mean.
STATED_NOISE = 0.01

_count = integer(1, 10**6)
_depth = optional(integer(1, 10**6))
_paths = integer(1, 2 * _plycloth.CompiledTape.MAX_PATHS)
_objective = choice(*OBJECTIVES)
_falloff = optional(choice(*FALLOFFS))
_threads = optional(integer(1, 1024))


@dataclass(frozen=True)
class _Point:
    """A place in the space of unknowns: the BSDFs of warp and weft, and the pictures' lenses."""

    bsdfs: Sequence[PlyBsdf]
    lenses: Sequence[Lens]


@dataclass(frozen=True)
class _Space:
    """Which numbers are looked for, and how they map to a point; all in [0, 1]."""

    start: _Point
    optical: Sequence[Unknown]
    camera: Sequence[LensUnknown]

    def encode(self, point: _Point) -> FloatArray:
        pairs = zip(self.parameters, self.values(point), strict=True)
        return np.clip([p.to_unit(value) for p, value in pairs], 0.0, 1.0)

    def decode(self, u: FloatArray) -> _Point:
        values = [p.from_unit(x) for p, x in zip(self.parameters, u, strict=True)]
        optical, camera = values[: len(self.optical)], values[len(self.optical) :]
        return _Point(
            bsdfs=with_values(self.start.bsdfs, self.optical, optical),
            lenses=with_lens_values(self.start.lenses, self.camera, camera),
        )

    def slopes(self, u: FloatArray) -> FloatArray:
        """Return the derivatives of the numbers with respect to `u`."""
        pairs = zip(self.parameters, u, strict=True)
        return np.array([p.slope(p.from_unit(x)) for p, x in pairs])

    def values(self, point: _Point) -> list[float]:
        """Return the numbers at a point."""
        optical = [unknown.value(point.bsdfs) for unknown in self.optical]
        return optical + [unknown.value(point.lenses) for unknown in self.camera]

    @property
    def labels(self) -> list[str]:
        return [u.label for u in self.optical] + [u.label for u in self.camera]

    @property
    def parameters(self) -> list[Parameter]:
        return [u.parameter for u in self.optical] + [u.parameter for u in self.camera]


def fit(
    scenes: Scene | Sequence[Scene],
    images: object,
    *,
    free: Iterable[str] | None = None,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    tie: bool = False,
    exposure: bool = False,
    falloff: str | None = None,
    lenses: Sequence[Lens] | None = None,
    fixed_lenses: Sequence[int] = (),
    objective: str = "grid",
    cells: int | Sequence[int] = 16,
    weights: Sequence[float] | None = None,
    paths: int = 128,
    rounds: int = 12,
    evaluations: int = 6,
    max_depth: int | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> FitResult:
    """Fit a fabric's optical parameters to one or more pictures of it.

    Time grows with pictures x cells x `paths` x `rounds` x `evaluations`, memory with the first
    three.

    Parameters
    ----------
    scenes
        How each picture was taken; all show the same fabric, whose BSDFs are the start.
    images
        The pictures, one per scene: arrays or Images of H x W x 3 in linear light, of any size at
        least as large as the grid.
    free
        Names of the parameters to look for: fields of PlyBsdf, for both yarns ("eta") or for one
        ("warp.base_color"). None: all. It may be empty if exposure or falloff is looked for.
    bounds
        Ranges for some parameters, as {"roughness": (0.1, 0.5)}; in the units of PlyBsdf. That of
        the "exposure" is 0.02 to 50 unless it is named.
    tie
        Whether warp and weft share their values.
    exposure
        Whether one factor on the brightness of all pictures is unknown.
    falloff
        "shared" or "each": a falloff towards the corners is unknown (see `Lens`), the same for all
        pictures or one for each: lamps, too, may shine less to the side. None: there is none.
    lenses
        Per picture: exposure and falloff to start from, and to stay with if they are not looked
        for. None: 1 and 0.
    fixed_lenses
        Which pictures, counted from 0, keep the lens that `lenses` gives them, whatever is looked
        for in the others.
    objective
        "grid": the averages of `cells` x `cells` cells; "average": those of whole pictures, as in
        the paper. In both, squared differences relative to the picture's mean, averaged over cells
        and channels and summed over pictures.
    cells
        Rows and columns of the grid, 1 to 256; one number, or one per picture.
    weights
        Per picture: a factor on its part of the objective, greater than 0; None: 1.
    paths
        Paths per cell, at most 131072: two independent halves, each best a power of two.
    rounds, evaluations
        At most so many times new paths are drawn, and the objective is evaluated in between.
    max_depth
        As in `render`.
    seed
        Fits with different seeds draw different paths.
    threads
        Threads to use; None: one per processor.
    progress
        None: a bar where a person watches; False: none; or a callable of (done, total).

    Raises
    ------
    ParameterError
        If the scenes show different fabrics, a fabric has colours of its own or yarns that are not
        plies, an image has the wrong shape, NaN or is black, a name or range is wrong, or nothing
        is left to look for.
    """
    all_scenes = scene_list(scenes)
    count = len(all_scenes)
    grids = cell_counts(cells if _objective("objective", objective) == "grid" else 1, count)
    bsdfs = start_bsdfs(all_scenes)
    targets = picture_targets(all_scenes, images, grids)
    start = _Point(bsdfs, start_lenses(lenses, count))
    optical_bounds, exposure_bounds = split_bounds({} if bounds is None else bounds)
    fixed = fixed_pictures(fixed_lenses, count)
    camera = lens_unknowns(
        exposure,
        _falloff("falloff", falloff),
        [each for each in range(count) if each not in fixed],
        exposure_bounds,
    )
    optical = unknowns(free, tie=tie, bounds=optical_bounds)
    if not optical and not camera:
        raise ParameterError("free must name at least one parameter if the lens is known")
    problem = _Problem(
        scenes=all_scenes,
        targets=targets,
        space=_Space(start, optical, camera),
        paths=max(1, _paths("paths", paths) // 2),
        max_depth=_depth("max_depth", max_depth),
        weights=picture_weights(weights, count),
        threads=_threads("threads", threads),
    )
    rounds, evaluations = _count("rounds", rounds), _count("evaluations", evaluations)
    with reporting(progress, rounds, description="fit", unit="round") as report:
        return _solve(problem, rounds, evaluations, integer(0, 2**63)("seed", seed), report)


@dataclass(frozen=True)
class _Problem:
    """What is to be fitted to what."""

    scenes: Sequence[Scene]
    targets: Sequence[FloatArray]
    space: _Space
    paths: int
    max_depth: int | None
    weights: Sequence[float]
    threads: int | None

    def record(self, u: FloatArray, seed: int) -> list[Tapes]:
        """Draw paths at `u`, for all pictures, twice."""
        bsdfs = self.space.decode(u).bsdfs
        tapes = []
        for picture, (scene, target) in enumerate(zip(self.scenes, self.targets, strict=True)):
            compiled = compiled_scene(scene, self.threads, bsdfs=bsdfs)
            rows, columns = target.shape[:2]
            first, second = (
                _plycloth.CompiledTape(
                    compiled,
                    (columns, rows),
                    self.paths,
                    2 * (seed * len(self.scenes) + picture) + half,
                    self.max_depth,
                    self.threads,
                )
                for half in range(2)
            )
            tapes.append((first, second))
        return tapes

    def cells(
        self, tape: _plycloth.CompiledTape, picture: int, u: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Cell averages (rows x columns x 3) and their derivatives by `u` (last axis)."""
        space = self.space
        point = space.decode(u)
        lens = point.lenses[picture]
        values, jacobian = tape.evaluate(point.bsdfs, self.threads)
        gain, gain_by_falloff = lens.gain(values.shape[:2])
        columns = [
            sum(jacobian[:, s, unknown.column] for s in unknown.sets) for unknown in space.optical
        ]
        optical = [np.reshape(column, values.shape) * gain for column in columns]
        by_exposure, by_falloff = values * gain / lens.exposure, values * gain_by_falloff
        camera = [
            (by_exposure if unknown.parameter.name == "exposure" else by_falloff)
            * (picture in unknown.pictures)
            for unknown in space.camera
        ]
        derivatives = np.stack(optical + camera, axis=-1)
        return values * gain, derivatives * space.slopes(u)

    def residuals(self, tapes: Sequence[Tapes], u: FloatArray) -> tuple[Linear, Linear]:
        """Return differences and slopes for both halves, scaled so that their squares sum up."""
        halves = []
        for half in range(2):
            parts = []
            for picture, (pair, target) in enumerate(zip(tapes, self.targets, strict=True)):
                values, derivatives = self.cells(pair[half], picture, u)
                # A photograph is saturated at 1: what is brighter looks the same.
                seen = (values < 1.0) | (target < 1.0)
                scale = (self.weights[picture] / target.size) ** 0.5 / target.mean()
                difference = np.where(seen, values - target, 0.0) * scale
                slopes = np.where(seen[..., None], derivatives, 0.0) * scale
                parts.append((difference.ravel(), slopes.reshape(-1, len(u))))
            differences, slopes_of_all = zip(*parts, strict=True)
            halves.append(Linear(u, np.concatenate(differences), np.concatenate(slopes_of_all)))
        return halves[0], halves[1]

    def model(self, tapes: Sequence[Tapes], u: FloatArray) -> Model:
        """Return the relative squared error, summed over pictures, as paths have it around `u`."""
        return Model.of(*self.residuals(tapes, u))


@dataclass(frozen=True)
class _Descent:
    """Where the rounds of a fit led, and what the paths of each have seen."""

    u: FloatArray
    seen: list[Linear]
    steps: list[Step]
    evaluations: int
    message: str


def _solve(
    problem: _Problem,
    rounds: int,
    evaluations: int,
    seed: int,
    report: Callable[[int], None] | None,
) -> FitResult:
    descent = _descend(problem, rounds, evaluations, seed, report)
    return _settle(problem, descent, rounds, seed, report)


def _settle(
    problem: _Problem,
    descent: _Descent,
    rounds: int,
    seed: int,
    report: Callable[[int], None] | None,
) -> FitResult:
    """Spend what is left of the rounds on new paths where all so far have the minimum."""
    u, seen, used = descent.u, list(descent.seen), len(descent.steps)
    for index in range(used, max(rounds, used + 1)):
        settled = settle(seen, u)
        tapes = problem.record(settled, seed + index + 1)
        halves = problem.residuals(tapes, settled)
        seen += halves
        if Model.of(*halves).bound < problem.model(tapes, u).bound:
            u = settled
        if report is not None:
            report(min(index + 1, rounds))
    return _result(problem, tapes, descent, pool(nearby(seen, u), u), u)


def _descend(
    problem: _Problem,
    rounds: int,
    evaluations: int,
    seed: int,
    report: Callable[[int], None] | None,
) -> _Descent:
    """Take steps, each round by other paths, until none lowers the objective."""
    u = problem.space.encode(problem.space.start)
    steps: list[Step] = []
    seen: list[Linear] = []
    tapes = problem.record(u, seed)
    here = problem.model(tapes, u)
    radius, standstills, count = TRUST_RADIUS, 0, 0
    for index in range(rounds):
        model = partial(problem.model, tapes)
        proposed, used, predicted = minimise(model, u, here, radius, evaluations)
        count += used
        # The step is judged by paths that it was not made to suit, which is hard on it if those
        # before were lucky: then beside staying, by the same paths.
        fresh = problem.record(proposed, seed + index + 1)
        halves = problem.residuals(fresh, proposed)
        there = Model.of(*halves)
        seen += halves
        accepted = there.bound < here.bound or there.bound < problem.model(fresh, u).bound
        steps.append(Step(here.value, predicted, there.value, radius, accepted))
        gaining = here.bound - there.bound > STANDSTILL * here.bound
        if accepted:
            u, here, tapes = proposed, there, fresh
        radius = min(1.0, 1.5 * radius) if gaining else 0.5 * radius
        standstills = 0 if gaining else standstills + 1
        if report is not None:
            report(index + 1)
        if radius < SMALLEST_TRUST_RADIUS or standstills >= MOST_STANDSTILLS:
            message = "converged: no further step lowers the objective"
            return _Descent(u, seen, steps, count, message)
    return _Descent(u, seen, steps, count, f"stopped after {rounds} rounds")


def _result(
    problem: _Problem,
    tapes: Sequence[Tapes],
    descent: _Descent,
    pooled: Pool,
    u: FloatArray,
) -> FitResult:
    point = problem.space.decode(u)
    matches = [
        Match(target, *(problem.cells(tape, picture, u)[0] for tape in pair))
        for picture, (pair, target) in enumerate(zip(tapes, problem.targets, strict=True))
    ]
    return FitResult(
        scenes=[scene.with_bsdfs(*point.bsdfs) for scene in problem.scenes],
        lenses=point.lenses,
        estimates=_estimates(problem.space, pooled, u, problem.targets[0].size),
        matches=matches,
        steps=descent.steps,
        evaluations=descent.evaluations,
        message=descent.message,
    )


def _estimates(space: _Space, pooled: Pool, u: FloatArray, rows: int) -> list[Estimate]:
    """Values with the uncertainty that the residuals at `u`, and `STATED_NOISE`, leave them."""
    # Rows carry 1/sqrt(rows per picture): noise of one row is STATED_NOISE of that.
    noise = STATED_NOISE / rows**0.5
    deviations, in_weak, partners = identify(pooled, noise, space.labels)
    labels, values, scales = space.labels, space.values(space.decode(u)), space.slopes(u)
    units = [parameter.unit for parameter in space.parameters]
    return [
        Estimate(label, value, unit, float(min(deviation, 1.0) * scale), not weak_here, trades)
        for label, value, unit, deviation, scale, weak_here, trades in zip(
            labels, values, units, deviations, scales, in_weak, partners, strict=True
        )
    ]
