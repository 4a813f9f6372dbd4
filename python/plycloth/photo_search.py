"""The search for what photographs leave open about a cloth: an outer loop around `fit`.

Every geometry that is guessed gets a short fit. The better half goes on: cloth and lamps are
placed, the optics fitted again; and so on, until few are left, which get longer fits. Then the
yarns of the best one are varied, and the best of all is fitted several times more, with most paths.
No fit is lost: the best so far counts, whatever comes after. Errors are estimated by paths of their
own, and compared as noise leaves them unbiased (`Match.error`), where they stand out of it.

Both pictures should be explained: it is the sum of the fourth powers of their errors that is made
small, by weights on the squares that `fit` sums up.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from plycloth.cells import cell_averages
from plycloth.fit import fit
from plycloth.fit_result import FitResult, Match
from plycloth.photo_geometry import Geometry
from plycloth.photo_placement import Placement, find_placement
from plycloth.rig import PhotoRig

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
# Errors are those of averages over so many cells across.
JUDGING_CELLS = 16
# Where cloth and lamp were is read off the large features of the pictures.
PLACING_CELLS = 8
PLACING_PATHS = 256
# So many geometries are left after the sketches.
FEW = 3
# No picture weighs less than this, relative to the one with the largest error.
LEAST_WEIGHT = 0.1
# Fits count up from their seeds; errors are judged by others.
SEEDS_PER_FIT = 2**20
JUDGING_SEED = 2**40
# Yarns are varied again if that has lowered the error to this part or less.
WORTHWHILE = 0.95


@dataclass(frozen=True, eq=False)
class Candidate:
    """A geometry that was tried, and the relative error that a short fit left in each picture."""

    geometry: Geometry
    errors: Sequence[float]

    @property
    def score(self) -> float:
        """The fourth root of the summed fourth powers of the errors."""
        return float(np.power(self.errors, 4).sum() ** 0.25)


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


def most_steps(geometries: int) -> int:
    """Return how many fits a search makes at most."""
    sketches, left = geometries, geometries
    while left > FEW:
        left = _half(left)
        sketches += left
    variations = 6 + 4  # as many as Geometry.variations can give
    return sketches + left + 1 + variations + PAINTINGS


def _half(count: int) -> int:
    return max(FEW, count // 2)


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the best trial of each geometry, the best first."""
    best: dict[str, Trial] = {}
    for trial in sorted(trials, key=lambda trial: trial.score):
        best.setdefault(str(trial.geometry), trial)
    return list(best.values())


def _error(match: Match) -> float:
    """Estimate a picture's error; where there is more noise than error, half the noise's square.

    Else a geometry could win by noise that makes its squared error negative.
    """
    return max(match.error, float(0.5**0.5 * match.noisy_error))


def _weights(errors: Sequence[float]) -> list[float]:
    """Weigh squared errors so that their sum has the gradient of the sum of fourth powers."""
    squares = np.maximum(np.square(errors), LEAST_WEIGHT * np.square(errors).max())
    return list(squares / squares.mean())


@dataclass
class Search:
    """The outer loop over photographs, by side, in linear light."""

    images: dict[str, FloatArray]
    rig: PhotoRig
    tie: bool
    seed: int
    threads: int | None
    report: Callable[[int], None]
    trials: list[Trial] = field(default_factory=list)

    def run(self, geometries: Sequence[Geometry]) -> Trial:
        """Return the best that is found."""
        drawn = [self._again(trial, DRAWING) for trial in self._sketched(geometries)]
        drawn.append(self._again(ranked(drawn)[0], DRAWING))
        drawn += self._varied(before := ranked(drawn)[0], cross_sections=True)
        if (best := ranked(drawn)[0]).score < WORTHWHILE * before.score:
            drawn += self._varied(best, cross_sections=False)
        for _ in range(PAINTINGS):
            drawn.append(self._again(ranked(drawn)[0], PAINTING))
        self.report(most_steps(len(geometries)))
        return ranked(drawn)[0]

    def _sketched(self, geometries: Sequence[Geometry]) -> list[Trial]:
        """Fit all geometries a little, the better half a little more, until few are left."""
        level = {side: Placement() for side in self.images}
        trials = [self._try(geometry, None, level, SKETCH) for geometry in geometries]
        while len(trials) > FEW:
            kept = ranked(trials)[: _half(len(trials))]
            trials = [self._again(trial, SKETCH) for trial in kept]
        return trials

    def _varied(self, trial: Trial, *, cross_sections: bool) -> list[Trial]:
        """Try other yarns from the optics found so far."""
        return [
            self._try(geometry, trial, trial.placements, DRAWING)
            for geometry in trial.geometry.variations(cross_sections=cross_sections)
        ]

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
        result = fit(
            [
                placements[side].scene(self.rig, fabric, side, self._resolution(side))
                for side in self.images
            ],
            list(self.images.values()),
            bounds=geometry.bounds(),
            tie=self.tie,
            exposure=True,
            falloff="each",
            lenses=None if before is None else before.result.lenses,
            weights=None if before is None else _weights(before.candidate.errors),
            # A fit that is tried again draws other paths.
            seed=self.seed + SEEDS_PER_FIT * len(self.trials),
            threads=self.threads,
            progress=False,
            cells=effort.cells,
            paths=effort.paths,
            rounds=effort.rounds,
            evaluations=effort.evaluations,
        )
        errors = self._errors(result, placements, effort.judging_paths)
        self.trials.append(Trial(Candidate(geometry, errors), result, placements))
        self.report(len(self.trials))
        return self.trials[-1]

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
            errors.append(_error(Match(cell_averages(image, JUDGING_CELLS), first, second)))
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
            placement.scene(self.rig, result.fabric, side, self._resolution(side)),
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
            cells = self._predict(
                trial.result, side, placement, PLACING_CELLS, PLACING_PATHS, self.seed
            )
            return np.ravel(np.minimum(cells, 1.0) - target)

        return find_placement(trial.placements[side], self.rig.camera_height, residuals)

    def _resolution(self, side: str) -> tuple[int, int]:
        height, width = self.images[side].shape[:2]
        return width, height
