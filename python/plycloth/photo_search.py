"""The search for what photographs leave open about a cloth: an outer loop around `fit`.

Every geometry that is guessed gets a short fit. The best ones are refined: cloth and lamps are
placed, the optics fitted again. Then the yarns of the best one are varied, and what is better is
kept. Errors are compared as noise leaves them unbiased (`Match.error`).
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field

import numpy as np
from numpy.typing import NDArray

from plycloth.cells import cell_averages
from plycloth.fit import fit
from plycloth.fit_result import FitResult
from plycloth.photo_geometry import Geometry
from plycloth.photo_placement import Placement, find_placement
from plycloth.rig import PhotoRig

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Effort:
    """How long a fit may take: arguments of `fit`."""

    cells: int
    paths: int
    rounds: int
    evaluations: int


# Of the first fit of each geometry, of those that refine one, and of the last.
SKETCH = Effort(cells=8, paths=128, rounds=5, evaluations=8)
DRAWING = Effort(cells=16, paths=256, rounds=3, evaluations=8)
PAINTING = Effort(cells=16, paths=512, rounds=4, evaluations=10)
# So many geometries are refined, and at last painted.
REFINED = 3
PAINTED = 2


@dataclass(frozen=True, eq=False)
class Candidate:
    """A geometry that was tried, and the relative error that a short fit left in each picture."""

    geometry: Geometry
    errors: Sequence[float]

    @property
    def score(self) -> float:
        """The root of the summed squares of the errors."""
        return float(np.sqrt(np.square(self.errors).sum()))


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
    variations = 6 + 4  # as many as Geometry.variations can give
    return geometries + REFINED + 1 + variations + PAINTED + 1


def ranked(trials: Sequence[Trial]) -> list[Trial]:
    """Return the best trial of each geometry, the best first."""
    best: dict[str, Trial] = {}
    for trial in sorted(trials, key=lambda trial: trial.score):
        best.setdefault(str(trial.geometry), trial)
    return list(best.values())


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
        level = {side: Placement() for side in self.images}
        sketches = [self._try(geometry, None, level, SKETCH) for geometry in geometries]
        refined = [self._again(trial, DRAWING) for trial in ranked(sketches)[:REFINED]]
        drawn = [*refined, self._again(ranked(refined)[0], DRAWING)]
        for cross_sections in (True, False):
            best = ranked(drawn)[0]
            drawn += [
                self._try(geometry, best.result, best.placements, DRAWING)
                for geometry in best.geometry.variations(cross_sections=cross_sections)
            ]
        painted = [self._again(trial, PAINTING) for trial in ranked(drawn)[:PAINTED]]
        best = ranked(painted)[0]
        best = ranked([best, self._again(best, PAINTING)])[0]
        self.report(most_steps(len(geometries)))
        return best

    def candidates(self) -> list[Candidate]:
        """List each geometry once, as its best trial left it, the best first."""
        return [trial.candidate for trial in ranked(self.trials)]

    def _again(self, trial: Trial, effort: Effort) -> Trial:
        """Place cloth and lamps by the optics found so far, and fit the optics again."""
        return self._try(trial.geometry, trial.result, self._placed(trial), effort)

    def _try(
        self,
        geometry: Geometry,
        before: FitResult | None,
        placements: dict[str, Placement],
        effort: Effort,
    ) -> Trial:
        """Fit the optics, from those of `before` if there is one."""
        color = np.mean([image.mean((0, 1)) for image in self.images.values()], axis=0)
        fabric = geometry.fabric(geometry.start(color) if before is None else before.bsdfs)
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
            lenses=None if before is None else before.lenses,
            seed=self.seed,
            threads=self.threads,
            progress=False,
            **asdict(effort),
        )
        self.trials.append(Trial(Candidate(geometry, result.errors), result, placements))
        self.report(len(self.trials))
        return self.trials[-1]

    def _placed(self, trial: Trial) -> dict[str, Placement]:
        """Find better placements for each picture by itself, the optics staying as they are."""
        return {side: self._place(trial, side) for side in self.images}

    def _place(self, trial: Trial, side: str) -> Placement:
        picture = list(self.images).index(side)
        target = cell_averages(self.images[side], DRAWING.cells)
        result, resolution = trial.result, self._resolution(side)

        def residuals(placement: Placement) -> FloatArray:
            cells = result.predict(
                placement.scene(self.rig, result.fabric, side, resolution),
                DRAWING.cells,
                picture=picture,
                paths=DRAWING.paths,
                seed=self.seed,
                threads=self.threads,
            )
            return np.ravel(np.minimum(cells, 1.0) - target)

        return find_placement(trial.placements[side], self.rig.camera_height, residuals)

    def _resolution(self, side: str) -> tuple[int, int]:
        height, width = self.images[side].shape[:2]
        return width, height
