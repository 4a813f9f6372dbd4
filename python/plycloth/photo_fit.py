"""From two photographs to a fabric.

The optics are fitted; what the photographs leave open (weave, yarns, how cloth and lamps were
placed on the rig) is searched around it.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, field, replace
from os import PathLike
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from plycloth._check import ParameterError
from plycloth.cells import cell_averages
from plycloth.fabric import Fabric
from plycloth.fit import fit
from plycloth.fit_result import FitResult
from plycloth.image import Image, read_image
from plycloth.lens import Lens, matching_blur
from plycloth.photo_geometry import YARNS, Geometry, weaves
from plycloth.progress import Progress, reporting
from plycloth.render import render
from plycloth.rig import PICTURE_SIDE, photo_rig
from plycloth.scene import Scene
from plycloth.spacing import estimate_spacing
from plycloth.weave import WeavePattern

FloatArray = NDArray[np.float64]
Photograph = str | PathLike[str] | Image

PHOTO_GAMMA = 2.2
"""The rig's photographs are compared with rendered ** (1 / 2.2)."""

# A pitch found with less confidence is not used.
LEAST_CONFIDENCE = 0.3
# The pitch in pixels that is taken where none is found.
USUAL_PITCH = 2.0
CELLS = 16


@dataclass(frozen=True)
class Effort:
    """How long a fit may take: arguments of `fit`."""

    paths: int
    rounds: int
    evaluations: int


# Of the first fit of each geometry, of those of the best ones, and of the last.
SKETCH = Effort(64, 4, 10)
DRAWING = Effort(144, 3, 12)
PAINTING = Effort(576, 8, 15)
FINALISTS = 2
CALIBRATION_PATHS = 128
# Samples per pixel of the pictures that the blur is read off.
BLUR_SPP = 8
# Factors on a yarn's cover that are tried on the best geometry.
COVER_FACTORS = (0.6, 1.25)
LARGEST_COVER = 1.2


@dataclass(frozen=True)
class Placement:
    """How cloth and lamp were placed for a photograph, where the rig's description is not exact.

    Parameters
    ----------
    rotation
        Of the cloth, in degrees, counter-clockwise in the picture.
    lamp_offset
        Of the lamp, along x, y and z, in the rig's units.
    """

    rotation: float = 0.0
    lamp_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    # Steps and limits of the search: degrees, and the rig's units.
    STEPS: ClassVar = (2.0, 0.5, 0.5, 0.5)
    LIMITS: ClassVar = (8.0, 1.5, 1.5, 1.5)
    FINEST: ClassVar = 0.25

    @property
    def numbers(self) -> FloatArray:
        """What is searched: rotation, and the lamp's offset along x, y and z."""
        return np.array([self.rotation, *self.lamp_offset])

    @classmethod
    def of(cls, numbers: FloatArray) -> "Placement":
        """Undo `numbers`, within the limits."""
        rotation, x, y, z = (
            float(np.clip(n, -limit, limit)) for n, limit in zip(numbers, cls.LIMITS, strict=True)
        )
        return cls(rotation, (x, y, z))


@dataclass(frozen=True, eq=False)
class Candidate:
    """A geometry that was tried, and the relative error that a first fit left in each picture."""

    geometry: Geometry
    errors: Sequence[float]

    @property
    def score(self) -> float:
        """The root of the summed squares of the errors."""
        return float(np.sqrt(np.square(self.errors).sum()))


@dataclass(frozen=True, eq=False)
class PhotoFit:
    """A fabric fitted to photographs; shows itself as its `result` does.

    Parameters
    ----------
    geometry
        What was found about the geometry.
    placements
        By side ("front", "back"), how cloth and lamp were placed; of a side that was not fitted:
        as the rig has it.
    result
        The fit of the optical parameters, for the sides that were fitted.
    candidates
        The geometries that were tried, the best first.
    size
        Width and height of the photographs.
    lenses
        By side, exposure, falloff and blur; of a side that was not fitted: as of the other.
    """

    geometry: Geometry
    placements: dict[str, Placement]
    result: FitResult
    candidates: Sequence[Candidate]
    size: tuple[int, int]
    lenses: dict[str, Lens]

    @property
    def fabric(self) -> Fabric:
        """The fitted fabric."""
        return self.result.fabric

    def scene(self, side: str) -> Scene:
        """Return the rig's scene with the fitted fabric, lit from "front" or "back"."""
        return _scene(self.fabric, side, self.placements[side], self.size)

    def picture(
        self,
        side: str,
        *,
        spp: int = 64,
        seed: int = 0,
        threads: int | None = None,
        progress: Progress = None,
    ) -> Image:
        """Render what the photograph shows, with all that the lens does, in linear light."""
        image = render(
            self.scene(side),
            spp=spp,
            seed=seed,
            both_sides=True,
            threads=threads,
            progress=progress,
        )
        return self.lenses[side].develop(image)

    def pictures(self, **options: object) -> dict[str, Image]:
        """Render both sides; `options` are those of `picture`."""
        return {side: self.picture(side, **options) for side in self.placements}  # type: ignore[arg-type]

    def summary(self) -> dict[str, object]:
        """Return all that was found, as plain values for JSON."""
        return {
            "geometry": str(self.geometry),
            "placements": {side: asdict(p) for side, p in self.placements.items()},
            "errors": self.result.errors,
            "lenses": {side: asdict(lens) for side, lens in self.lenses.items()},
            "parameters": [asdict(e) for e in self.result.estimates],
            "candidates": [
                {"geometry": str(c.geometry), "errors": list(c.errors)} for c in self.candidates
            ],
            "message": self.result.message,
        }

    def __repr__(self) -> str:
        return f"<PhotoFit: {self.geometry}; {self.result!r}>"

    def _repr_html_(self) -> str:
        return f"<p>{self.geometry}</p>{self.result._repr_html_()}"


def fit_photographs(
    front: Photograph | None,
    back: Photograph | None,
    *,
    pattern: WeavePattern | None = None,
    geometries: Sequence[Geometry] | None = None,
    tie: bool = False,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> PhotoFit:
    """Find a fabric that looks like photographs taken on the rig (`photo_rig`).

    The optical parameters, one exposure and each picture's falloff are fitted by `fit`. What else
    the photographs leave open is searched: first geometries by short fits, then, for the best, how
    wide the yarns are and how cloth and lamps were placed, in turns with longer fits. At last the
    lens's blur is read off the photographs' grain. It takes about three minutes on two cores.

    Parameters
    ----------
    front, back
        Photographs lit from the front and from behind: files (display values, decoded by a gamma
        of 2.2) or Images in linear light. One of them may be None.
    pattern
        The weave, if it is known; None: what the spectrum of the photograph suggests is tried.
    geometries
        Geometries to try; None: those that pattern and spectrum suggest.
    tie
        Whether warp and weft share their optical parameters.
    seed
        Fits with different seeds draw different paths.
    threads
        Threads to use; None: one per processor.
    progress
        None: a bar where a person watches; False: none; or a callable of (done, total).

    Raises
    ------
    ParameterError
        If there is no photograph, or they differ in size, or one is black.
    """
    images = {
        side: _linear(photograph)
        for side, photograph in (("front", front), ("back", back))
        if photograph is not None
    }
    if not images:
        raise ParameterError("front and back must not both be None")
    if len({image.shape for image in images.values()}) > 1:
        raise ParameterError("front and back must have the same size")
    tried = list(geometries) if geometries is not None else guess_geometries(images, pattern)
    search = _Search(images, tie, seed, threads)
    total = len(tried) + 2 * FINALISTS + 2 * len(COVER_FACTORS) + 2
    with reporting(progress, total, description="fit") as report:
        return search.run(tried, report or (lambda _: None))


def guess_geometries(
    images: dict[str, FloatArray], pattern: WeavePattern | None = None
) -> list[Geometry]:
    """List geometries that the spectrum of the (first) photograph suggests."""
    image = next(iter(images.values()))
    found = estimate_spacing(Image(image.astype(np.float32)))
    scale = PICTURE_SIDE / image.shape[1]
    pitches = [
        (px if px is not None and confidence >= LEAST_CONFIDENCE else USUAL_PITCH) * scale
        for px, confidence in (
            (found.warp_px, found.warp_confidence),
            (found.weft_px, found.weft_confidence),
        )
    ]
    sure = min(found.warp_confidence, found.weft_confidence) >= LEAST_CONFIDENCE
    likely = weaves(found.repeat if sure else None)
    return [
        Geometry(name, weave, warp, weft, *pitches)
        for name, weave in ([("given weave", pattern)] if pattern is not None else likely)
        for warp, weft in YARNS
    ]


@dataclass(frozen=True, eq=False)
class _Trial:
    """A geometry with the fit that it was tried by."""

    candidate: Candidate
    result: FitResult
    placements: dict[str, Placement]


def _score(trial: _Trial) -> float:
    return trial.candidate.score


@dataclass
class _Search:
    """The outer loop."""

    images: dict[str, FloatArray]
    tie: bool
    seed: int
    threads: int | None
    trials: list["_Trial"] = field(default_factory=list)
    done: int = 0

    def run(self, tried: Sequence[Geometry], report: Callable[[int], None]) -> PhotoFit:
        level = {side: Placement() for side in self.images}
        sketches = [self._try(geometry, None, level, SKETCH, report) for geometry in tried]
        sketches.sort(key=_score)
        best = min(
            (self._improve(trial, report) for trial in sketches[:FINALISTS]),
            key=_score,
        )
        for wider in self._other_covers(best.candidate.geometry):
            trial = self._try(wider, best.result, best.placements, DRAWING, report)
            best = min(best, trial, key=_score)
        geometry, result, placements = best.candidate.geometry, best.result, best.placements
        for _ in range(2):
            placements = self._place(result, placements)
            result = self._fit(geometry, result, placements, PAINTING)
            self._advance(report)
        height, width = next(iter(self.images.values())).shape[:2]
        lenses = dict(zip(self.images, result.lenses, strict=True))
        sharp = PhotoFit(
            geometry=geometry,
            placements={"front": Placement(), "back": Placement(), **placements},
            result=result,
            candidates=self._candidates(),
            size=(width, height),
            lenses=dict.fromkeys(("front", "back"), result.lenses[0]) | lenses,
        )
        blur = self._blur(sharp)
        lenses = {side: replace(lens, blur=blur) for side, lens in sharp.lenses.items()}
        return replace(sharp, lenses=lenses)

    def _blur(self, sharp: PhotoFit) -> float:
        """Find how much the lens blurs, by the photographs and sharp pictures of the same."""
        rendered = [
            sharp.picture(side, spp=BLUR_SPP, threads=self.threads, progress=False)
            for side in self.images
        ]
        return matching_blur(rendered, list(self.images.values()))

    def _try(
        self,
        geometry: Geometry,
        before: FitResult | None,
        placements: dict[str, Placement],
        effort: Effort,
        report: Callable[[int], None],
    ) -> "_Trial":
        result = self._fit(geometry, before, placements, effort)
        trial = _Trial(Candidate(geometry, result.errors), result, placements)
        self.trials.append(trial)
        self._advance(report)
        return trial

    def _improve(self, trial: "_Trial", report: Callable[[int], None]) -> "_Trial":
        """Place cloth and lamps, fit, and once more."""
        for _ in range(2):
            placements = self._place(trial.result, trial.placements)
            geometry = trial.candidate.geometry
            trial = self._try(geometry, trial.result, placements, DRAWING, report)
        return trial

    def _candidates(self) -> list[Candidate]:
        """List each geometry once, as its best trial left it, the best first."""
        best: dict[str, Candidate] = {}
        for trial in sorted(self.trials, key=_score):
            best.setdefault(str(trial.candidate.geometry), trial.candidate)
        return list(best.values())

    @staticmethod
    def _other_covers(geometry: Geometry) -> list[Geometry]:
        """List the geometry with one of its yarns narrower or wider."""
        others = []
        for factor in COVER_FACTORS:
            for name, guess in (("warp", geometry.warp), ("weft", geometry.weft)):
                cover = min(factor * guess.cover, LARGEST_COVER)
                changed: dict[str, Any] = {name: replace(guess, cover=cover)}
                others.append(replace(geometry, **changed))
        return others

    def _advance(self, report: Callable[[int], None]) -> None:
        self.done += 1
        report(self.done)

    def _fit(
        self,
        geometry: Geometry,
        before: FitResult | None,
        placements: dict[str, Placement],
        effort: Effort,
    ) -> FitResult:
        color = np.mean([image.mean((0, 1)) for image in self.images.values()], axis=0)
        fabric = geometry.fabric(geometry.start(color) if before is None else before.bsdfs)
        scenes = [_scene(fabric, side, placements[side], (512, 512)) for side in self.images]
        return fit(
            scenes,
            list(self.images.values()),
            bounds=geometry.bounds(),
            tie=self.tie,
            exposure=True,
            falloff="each",
            lenses=None if before is None else before.lenses,
            seed=self.seed,
            threads=self.threads,
            progress=False,
            paths=effort.paths,
            rounds=effort.rounds,
            evaluations=effort.evaluations,
        )

    def _place(self, result: FitResult, placements: dict[str, Placement]) -> dict[str, Placement]:
        """Find better placements for each picture by itself, the optics staying as they are."""
        return {
            side: self._search_placement(result, side, placement)
            for side, placement in placements.items()
        }

    def _search_placement(self, result: FitResult, side: str, start: Placement) -> Placement:
        """Compass search: a step along each axis in turn, halved when none is better."""
        target, picture = cell_averages(self.images[side], CELLS), list(self.images).index(side)

        def error(placement: Placement) -> float:
            scene = _scene(result.fabric, side, placement, (512, 512))
            cells = result.predict(
                scene,
                CELLS,
                picture=picture,
                paths=CALIBRATION_PATHS,
                seed=self.seed,
                threads=self.threads,
            )
            return float(((np.minimum(cells, 1.0) - target) ** 2).mean())

        best, least, scale = start, error(start), 1.0
        while scale >= Placement.FINEST:
            moved = False
            for axis, step in enumerate(Placement.STEPS):
                for sign in (-1.0, 1.0):
                    numbers = best.numbers
                    numbers[axis] += sign * scale * step
                    candidate = Placement.of(numbers)
                    if candidate == best:
                        continue
                    reached = error(candidate)
                    if reached < least:
                        best, least, moved = candidate, reached, True
                        break
            scale *= 1.0 if moved else 0.5
        return best


def _scene(fabric: Fabric, side: str, placement: Placement, size: tuple[int, int]) -> Scene:
    return photo_rig(
        fabric,
        side,
        rotation=placement.rotation,
        lamp_offset=placement.lamp_offset,
        resolution=size,
    )


def _linear(photograph: Photograph) -> FloatArray:
    image = photograph
    if not isinstance(image, Image):
        image = read_image(image, gamma=PHOTO_GAMMA)
    return image.pixels.astype(np.float64)
