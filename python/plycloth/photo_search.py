"""The search for what photographs leave open about a cloth: an outer loop around `fit`.

Every geometry that is guessed gets a short fit. The better half goes on: cloth and lamps are
placed, the optics fitted again; and so on, until few are left, which get longer fits. Then the
yarns of the best one are varied, and the best of all is fitted several times more, with most paths.
No fit is lost: the best so far counts, whatever comes after. Errors are estimated by paths of their
own, and compared as noise leaves them unbiased (`Match.error`), where they stand out of it.

Both pictures should be explained: it is the sum of the fourth powers of their errors that is made
small, by weights on the squares that `fit` sums up. Where the exposure is not known, a picture of
the cloth by itself is the third (`photo_exposure.Look`).
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from plycloth.cells import cell_averages
from plycloth.fit import fit
from plycloth.fit_result import FitResult, Match
from plycloth.lens import Lens
from plycloth.photo_exposure import LOOK_CELLS
from plycloth.photo_geometry import Geometry
from plycloth.photo_placement import Placement, find_placement
from plycloth.photo_task import Task

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Effort:
    """How long a fit may take, as arguments of `fit`, and by how many paths it is judged."""

    cells: int
    paths: int
    rounds: int
    evaluations: int
    judging_paths: int


# Of fits while many geometries are left, while few are, and of the last.
SKETCH = Effort(cells=8, paths=128, rounds=3, evaluations=3, judging_paths=128)
DRAWING = Effort(cells=16, paths=256, rounds=3, evaluations=3, judging_paths=512)
PAINTING = Effort(cells=16, paths=4096, rounds=4, evaluations=3, judging_paths=512)
# So many fits are painted one after the other, each from the best so far.
PAINTINGS = 2
# The same for a first look: fewer geometries come to the end, and none has its yarns varied.
QUICK_SKETCH = Effort(cells=8, paths=64, rounds=2, evaluations=3, judging_paths=64)
QUICK_DRAWING = Effort(cells=12, paths=128, rounds=3, evaluations=3, judging_paths=256)
QUICK_PAINTING = Effort(cells=16, paths=256, rounds=3, evaluations=3, judging_paths=512)
# Errors are those of averages over so many cells across.
JUDGING_CELLS = 16
# Where cloth and lamp were is read off the large features of the pictures.
PLACING_CELLS = 8
PLACING_PATHS = 256
# No picture weighs less than this, relative to the one with the largest error.
LEAST_WEIGHT = 0.1
# The mean colour of the cloth by itself weighs so much: nothing but the exposure is against it.
# Where it was off by more than a part, it weighs more, up to a number of times.
LOOK_WEIGHT = 4.0
LOOK_TOLERANCE = 0.05
MOST_LOOK_WEIGHTS = 5.0
# The exposure is looked for within this factor of where it starts.
EXPOSURES = 50.0
# Fits count up from their seeds; errors are judged by others.
SEEDS_PER_FIT = 2**20
JUDGING_SEED = 2**40
# Yarns are varied again if that has lowered the error to this part or less.
WORTHWHILE = 0.95


@dataclass(frozen=True)
class Plan:
    """How much work a search is: `few` geometries are left after the sketches."""

    sketch: Effort
    drawing: Effort
    painting: Effort
    paintings: int
    few: int
    varied: bool

    def most_steps(self, geometries: int) -> int:
        """Return how many fits a search makes at most."""
        sketches, left = geometries, geometries
        while left > self.few:
            left = self.kept(left)
            sketches += left
        variations = 6 + 4 if self.varied else 0  # as many as Geometry.variations can give
        return sketches + left + 1 + variations + self.paintings

    def kept(self, count: int) -> int:
        """Return how many of so many geometries go on."""
        return max(self.few, count // 2)


def plan(*, quick: bool = False) -> Plan:
    """Return the plan of a whole search, or that of one for a first look."""
    if quick:
        return Plan(QUICK_SKETCH, QUICK_DRAWING, QUICK_PAINTING, paintings=1, few=2, varied=False)
    return Plan(SKETCH, DRAWING, PAINTING, PAINTINGS, few=3, varied=True)


@dataclass(frozen=True, eq=False)
class Candidate:
    """A geometry that was tried, and what a short fit left.

    Parameters
    ----------
    geometry
        What was tried.
    errors
        The relative error in each picture.
    look_error
        By what part the cloth by itself is off the photograph's mean colour; 0 if the exposure is
        known.
    """

    geometry: Geometry
    errors: Sequence[float]
    look_error: float = 0.0

    @property
    def score(self) -> float:
        """The fourth root of the summed fourth powers of the errors."""
        return float(np.power([*self.errors, self.look_error], 4).sum() ** 0.25)


@dataclass(frozen=True, eq=False)
class Trial:
    """A geometry with the fit that it was tried by."""

    candidate: Candidate
    result: FitResult
    placements: dict[str, Placement]

    @property
    def geometry(self) -> Geometry:
        """The geometry."""
        return self.candidate.geometry

    @property
    def score(self) -> float:
        """That of the candidate."""
        return self.candidate.score


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the best trial of each geometry, the best first."""
    best: dict[str, Trial] = {}
    for trial in sorted(trials, key=lambda trial: trial.score):
        best.setdefault(str(trial.geometry), trial)
    return list(best.values())


def estimated_error(match: Match) -> float:
    """Estimate a picture's error; where there is more noise than error, half the noise's square.

    Else a geometry could win by noise that makes its squared error negative.
    """
    return max(match.error, float(0.5**0.5 * match.noisy_error))


def _weights(errors: Sequence[float]) -> list[float]:
    """Weigh squared errors so that their sum has the gradient of the sum of fourth powers."""
    squares = np.maximum(np.square(errors), LEAST_WEIGHT * np.square(errors).max())
    return list(squares / squares.mean())


def _look_weight(error: float) -> float:
    return LOOK_WEIGHT * min(MOST_LOOK_WEIGHTS, 1.0 + (error / LOOK_TOLERANCE) ** 2)


class _OutOfTime(Exception):  # noqa: N818 (nothing is wrong)
    """The time that a search may take has passed."""


@dataclass
class Search:
    """The outer loop over photographs.

    Parameters
    ----------
    task
        What is searched in.
    plan
        How much work it is.
    tie, seed, threads
        As for `fit`.
    report
        Takes how many fits were made.
    deadline
        When to stop, by `time.monotonic`; None: at the end.
    """

    task: Task
    plan: Plan
    tie: bool
    seed: int
    threads: int | None
    report: Callable[[int], None]
    deadline: float | None = None
    trials: list[Trial] = field(default_factory=list)
    drawn: list[Trial] = field(default_factory=list)
    stopped: str | None = None

    def run(self) -> Trial:
        """Return the best that is found; `stopped` says why, if that is not all.

        Ctrl-C and the deadline end it; without a single fit so far, Ctrl-C goes through.
        """
        try:
            self._search()
        except _OutOfTime:
            self.stopped = "out of time"
        except KeyboardInterrupt:
            if not self.trials:
                raise
            self.stopped = "interrupted"
        return ranked(self.drawn or self.trials)[0]

    def _search(self) -> None:
        plan, drawn = self.plan, self.drawn
        for trial in self._sketched(self.task.geometries):
            drawn.append(self._again(trial, plan.drawing))
        drawn.append(self._again(ranked(drawn)[0], plan.drawing))
        if plan.varied:
            before = ranked(drawn)[0]
            self._vary(before, cross_sections=True)
            if (best := ranked(drawn)[0]).score < WORTHWHILE * before.score:
                self._vary(best, cross_sections=False)
        for _ in range(plan.paintings):
            drawn.append(self._again(ranked(drawn)[0], plan.painting))

    def _sketched(self, geometries: Sequence[Geometry]) -> list[Trial]:
        """Fit all geometries a little, the better half a little more, until few are left."""
        level = {side: Placement() for side in self.images}
        trials = [self._try(geometry, None, level, self.plan.sketch) for geometry in geometries]
        while len(trials) > self.plan.few:
            kept = ranked(trials)[: self.plan.kept(len(trials))]
            trials = [self._again(trial, self.plan.sketch) for trial in kept]
        return trials

    def _vary(self, trial: Trial, *, cross_sections: bool) -> None:
        """Try other yarns from the optics found so far."""
        for geometry in trial.geometry.variations(self.task.covers, cross_sections=cross_sections):
            self.drawn.append(self._try(geometry, trial, trial.placements, self.plan.drawing))

    @property
    def images(self) -> dict[str, FloatArray]:
        """The photographs by side."""
        return self.task.images

    def _check_time(self, *_: object) -> None:
        # One fit at least is made, so that there is something to show.
        if self.deadline is not None and self.trials and time.monotonic() > self.deadline:
            raise _OutOfTime

    def candidates(self) -> list[Candidate]:
        """List each geometry once, as its best trial left it, the best first."""
        return [trial.candidate for trial in ranked(self.trials)]

    def _again(self, trial: Trial, effort: Effort) -> Trial:
        """Place cloth and lamps by the optics found so far, and fit the optics again."""
        placements = {side: self._place(trial, side) for side in self.images}
        return self._try(trial.geometry, trial, placements, effort)

    def _try(
        self,
        geometry: Geometry,
        before: Trial | None,
        placements: dict[str, Placement],
        effort: Effort,
    ) -> Trial:
        """Fit the optics, from those of `before` if there is one."""
        color = np.mean([image.mean((0, 1)) for image in self.images.values()], axis=0)
        fabric = geometry.fabric(geometry.start(color) if before is None else before.result.bsdfs)
        count = len(self.images)
        looks = [] if self.task.look is None else [self.task.look]
        scenes = [
            placements[side].scene(self.task.rig, fabric, side, self._resolution(side))
            for side in self.images
        ]
        lenses = [self.task.lens] * count if before is None else before.result.lenses
        weights = [1.0] * count if before is None else _weights(before.candidate.errors)
        look_weight = _look_weight(0.0 if before is None else before.candidate.look_error)
        result = fit(
            [*scenes, *(look.scene(fabric) for look in looks)],
            [*self.images.values(), *(look.target for look in looks)],
            bounds=geometry.bounds() | {"exposure": self._exposures()},
            tie=self.tie,
            exposure=bool(looks),
            falloff="each",
            lenses=[*lenses, *(Lens() for _ in looks)],
            fixed_lenses=[count] if looks else [],
            weights=[*weights, *(look_weight for _ in looks)],
            # A fit that is tried again draws other paths.
            seed=self.seed + SEEDS_PER_FIT * len(self.trials),
            threads=self.threads,
            progress=self._check_time,
            cells=[*[effort.cells] * count, *(LOOK_CELLS for _ in looks)],
            paths=effort.paths,
            rounds=effort.rounds,
            evaluations=effort.evaluations,
        )
        photographed = replace(
            result,
            scenes=result.scenes[:count],
            lenses=result.lenses[:count],
            matches=result.matches[:count],
        )
        errors = self._errors(photographed, placements, effort.judging_paths)
        look_error = sum(look.error(result.matches[count].fitted) for look in looks)
        self.trials.append(Trial(Candidate(geometry, errors, look_error), photographed, placements))
        self.report(len(self.trials))
        self._check_time()
        return self.trials[-1]

    def _exposures(self) -> tuple[float, float]:
        likely = self.task.lens.exposure
        return likely / EXPOSURES, likely * EXPOSURES

    def _errors(
        self, result: FitResult, placements: dict[str, Placement], paths: int
    ) -> list[float]:
        """Estimate each picture's error by two sets of paths that the fit has not seen."""
        errors = []
        for side, image in self.images.items():
            first, second = (
                self._predict(result, side, placements[side], JUDGING_CELLS, paths, seed)
                for seed in (self.seed + JUDGING_SEED, self.seed + JUDGING_SEED + 1)
            )
            errors.append(
                estimated_error(Match(cell_averages(image, JUDGING_CELLS), first, second))
            )
        return errors

    def _predict(
        self,
        result: FitResult,
        side: str,
        placement: Placement,
        cells: int,
        paths: int,
        seed: int,
    ) -> FloatArray:
        """Return the cell averages of a picture with the cloth and lamp placed in this way."""
        return result.predict(
            placement.scene(self.task.rig, result.fabric, side, self._resolution(side)),
            cells,
            picture=list(self.images).index(side),
            paths=paths,
            seed=seed,
            threads=self.threads,
        )

    def _place(self, trial: Trial, side: str) -> Placement:
        """Find a better placement for a picture by itself, the optics staying as they are."""
        target = cell_averages(self.images[side], PLACING_CELLS)

        def residuals(placement: Placement) -> FloatArray:
            self._check_time()
            cells = self._predict(
                trial.result, side, placement, PLACING_CELLS, PLACING_PATHS, self.seed
            )
            return np.ravel(np.minimum(cells, 1.0) - target)

        return find_placement(trial.placements[side], self.task.rig.camera_height, residuals)

    def _resolution(self, side: str) -> tuple[int, int]:
        height, width = self.images[side].shape[:2]
        return width, height
