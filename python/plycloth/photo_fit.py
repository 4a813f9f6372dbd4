"""From two photographs to a fabric.

The optics are fitted; what the photographs leave open (weave, yarns, how cloth and lamps were
placed on the rig) is searched around it.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from plycloth._check import ParameterError, choice, integer, optional
from plycloth.fabric import Fabric
from plycloth.fit_result import FitResult
from plycloth.image import Image
from plycloth.image_read import read_photograph
from plycloth.lens import Lens, matching_blur
from plycloth.overlap import OverlapWarning
from plycloth.photo_geometry import YARNS, Geometry, weaves
from plycloth.photo_placement import Placement
from plycloth.photo_search import Candidate, Search, Trial, most_steps
from plycloth.progress import Progress, reporting
from plycloth.render import render
from plycloth.rig import RIG, PhotoRig
from plycloth.scene import Scene
from plycloth.spacing import estimate_spacing
from plycloth.weave import WeavePattern

FloatArray = NDArray[np.float64]
Photograph = str | PathLike[str] | Image

# A pitch found with less confidence is not used.
LEAST_CONFIDENCE = 0.3
# The pitch in pixels that is taken where none is found.
USUAL_PITCH = 2.0
# Samples per pixel of the pictures that the blur is read off.
BLUR_SPP = 8
# Samples per pixel of pictures to look at. Lit from behind, single paths differ most: the deviation
# of a pixel was 2.5 to 3.3 times that lit from the front, on three fitted fabrics.
PICTURE_SPP = {"front": 32, "back": 64}

_side = choice(*PICTURE_SPP)
_threads = optional(integer(1, 1024))


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
    rig
        How the photographs were taken.
    """

    geometry: Geometry
    placements: dict[str, Placement]
    result: FitResult
    candidates: Sequence[Candidate]
    size: tuple[int, int]
    lenses: dict[str, Lens]
    rig: PhotoRig = RIG

    @property
    def fabric(self) -> Fabric:
        """The fitted fabric."""
        return self.result.fabric

    def scene(self, side: str) -> Scene:
        """Return the rig's scene with the fitted fabric, lit from "front" or "back"."""
        return self.placements[_side("side", side)].scene(self.rig, self.fabric, side, self.size)

    def picture(
        self,
        side: str,
        *,
        spp: int | None = None,
        seed: int = 0,
        threads: int | None = None,
        progress: Progress = None,
    ) -> Image:
        """Render what the photograph shows, with all that the lens does, in linear light.

        `spp` None: 32 samples per pixel for the "front", 64 for the "back", which is noisier.
        """
        with warnings.catch_warnings():
            # What fits the photographs best is what was asked for.
            warnings.simplefilter("ignore", OverlapWarning)
            image = render(
                self.scene(side),
                spp=PICTURE_SPP[side] if spp is None else spp,
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
    rig: PhotoRig = RIG,
    tie: bool = False,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> PhotoFit:
    """Find a fabric that looks like photographs taken on a rig.

    The optical parameters, one exposure and each picture's falloff are fitted by `fit`. What else
    the photographs leave open is searched: first geometries by short fits, then, for the best, how
    wide the yarns are and how cloth and lamps were placed, in turns with longer fits. At last the
    lens's blur is read off the photographs' grain. It takes about three minutes on two cores.

    Parameters
    ----------
    front, back
        Photographs lit from the front and from behind: files (display values, decoded by the rig's
        gamma unless they hold linear light, as EXR does) or Images. One of them may be None.
    pattern
        The weave, if it is known; None: what the spectrum of the photograph suggests is tried.
    geometries
        Geometries to try; None: those that pattern and spectrum suggest.
    rig
        How the photographs were taken; by default on the rig of Tang et al. 2024.
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
        side: _linear(photograph, rig.gamma)
        for side, photograph in (("front", front), ("back", back))
        if photograph is not None
    }
    if not images:
        raise ParameterError("front and back must not both be None")
    threads = _threads("threads", threads)
    if len({image.shape for image in images.values()}) > 1:
        raise ParameterError("front and back must have the same size")
    if geometries is None:
        geometries = guess_geometries(images, pattern, rig)
    tried = list(geometries)
    if not tried or not all(isinstance(each, Geometry) for each in tried):
        raise TypeError("geometries must be a list of at least one Geometry")
    with reporting(progress, most_steps(len(tried)), description="fit") as report:
        search = Search(images, rig, tie, seed, threads, report or (lambda _: None))
        best = search.run(tried)
    return _photo_fit(best, search, images, rig)


def guess_geometries(
    images: dict[str, FloatArray], pattern: WeavePattern | None = None, rig: PhotoRig = RIG
) -> list[Geometry]:
    """List geometries that the spectrum of the (first) photograph suggests."""
    image = next(iter(images.values()))
    found = estimate_spacing(Image(image.astype(np.float32)))
    scale = rig.picture_width / image.shape[1]
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


def _photo_fit(
    best: Trial, search: Search, images: dict[str, FloatArray], rig: PhotoRig
) -> PhotoFit:
    height, width = next(iter(images.values())).shape[:2]
    lenses = dict(zip(images, best.result.lenses, strict=True))
    sharp = PhotoFit(
        geometry=best.geometry,
        placements={"front": Placement(), "back": Placement(), **best.placements},
        result=best.result,
        candidates=search.candidates(),
        size=(width, height),
        lenses=dict.fromkeys(("front", "back"), best.result.lenses[0]) | lenses,
        rig=rig,
    )
    rendered = [
        sharp.picture(side, spp=BLUR_SPP, threads=search.threads, progress=False) for side in images
    ]
    blur = matching_blur(rendered, list(images.values()))
    lenses = {side: replace(lens, blur=blur) for side, lens in sharp.lenses.items()}
    return replace(sharp, lenses=lenses)


def _linear(photograph: Photograph, gamma: float) -> FloatArray:
    image = photograph
    if not isinstance(image, Image):
        image = read_photograph(image, gamma)
    return image.pixels.astype(np.float64)
