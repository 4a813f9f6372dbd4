"""From one or two photographs to a fabric.

The optics are fitted; what the photographs leave open (weave, yarns, how cloth and lamps were
placed on the rig) is searched around it. What they cannot tell at all, how large the cloth really
is and how bright, is given or assumed, and said.
"""

from __future__ import annotations

import html
import time
import warnings
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace

from plycloth._check import POSITIVE, choice, integer, number, optional
from plycloth.fabric import Fabric
from plycloth.fit_result import FitResult
from plycloth.image import Image
from plycloth.lens import Lens, matching_blur
from plycloth.photo_exposure import GreyCard
from plycloth.photo_geometry import COVERS, Geometry
from plycloth.photo_input import Photograph, read_photographs
from plycloth.photo_placement import Placement
from plycloth.photo_search import Candidate, Search, Trial, estimated_error, plan
from plycloth.photo_task import Known, make_task
from plycloth.progress import Progress, reporting
from plycloth.render import render
from plycloth.rig import RIG, PhotoRig
from plycloth.scene import Scene
from plycloth.spacing import ConfidenceWarning
from plycloth.weave import WeavePattern

# Samples per pixel of the pictures that the blur is read off.
BLUR_SPP = 8
# Samples per pixel of pictures to look at. Lit from behind, single paths differ most: the deviation
# of a pixel was 2.5 to 3.3 times that lit from the front, on three fitted fabrics.
PICTURE_SPP = {"front": 32, "back": 64}
# A quick search ends after so many seconds, unless a time is given.
QUICK_SECONDS = 26.0
# One that may take no longer than this is a quick one: a whole one would be stopped at its start.
WORTHWHILE_SECONDS = 90.0

_side = choice(*PICTURE_SPP)
_threads = optional(integer(1, 1024))
_seconds = optional(number(POSITIVE))


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
        How the photographs were taken, in the cloth's real size.
    assumptions
        What the photographs do not tell and was given or assumed, a sentence each.
    doubts
        What may well be wrong, a sentence each; these were warnings, too.
    stopped
        "out of time" or "interrupted" if this is the best that there was until then; None: the
        search came to its end.
    """

    geometry: Geometry
    placements: dict[str, Placement]
    result: FitResult
    candidates: Sequence[Candidate]
    size: tuple[int, int]
    lenses: dict[str, Lens]
    rig: PhotoRig = RIG
    assumptions: Sequence[str] = ()
    doubts: Sequence[str] = ()
    stopped: str | None = None

    @property
    def fabric(self) -> Fabric:
        """The fitted fabric."""
        return self.result.fabric

    @property
    def errors(self) -> list[float]:
        """The relative error of each picture; where paths were few, half of their noise at least.

        Those of the `result` have no noise in them, but may come out as 0 if there was much.
        """
        return [estimated_error(match) for match in self.result.matches]

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

    @property
    def notes(self) -> list[str]:
        """What to know about the result before it is used: how it ended, doubts, assumptions."""
        stopped = [f"The search was stopped ({self.stopped}): this is the best that it had found."]
        return [
            *(stopped if self.stopped is not None else []),
            *(f"Warning: {doubt}." for doubt in self.doubts),
            *self.assumptions,
        ]

    def summary(self) -> dict[str, object]:
        """Return all that was found, as plain values for JSON."""
        return {
            "geometry": str(self.geometry),
            "assumptions": list(self.assumptions),
            "doubts": list(self.doubts),
            "stopped": self.stopped,
            "width_mm": self.rig.picture_width,
            "placements": {side: asdict(p) for side, p in self.placements.items()},
            "errors": self.errors,
            "lenses": {side: asdict(lens) for side, lens in self.lenses.items()},
            "parameters": [asdict(e) for e in self.result.estimates],
            "candidates": [
                {"geometry": str(c.geometry), "errors": list(c.errors)} for c in self.candidates
            ],
            "message": self.result.message,
        }

    def __repr__(self) -> str:
        stopped = "" if self.stopped is None else f"; stopped ({self.stopped})"
        return f"<PhotoFit: {self.geometry}{stopped}; {self.result!r}>"

    def _repr_html_(self) -> str:
        notes = "".join(f"<li>{html.escape(note)}</li>" for note in self.notes)
        return (
            f"<p>{html.escape(str(self.geometry))}</p><ul>{notes}</ul>{self.result._repr_html_()}"
        )


def fit_photographs(
    front: Photograph | None,
    back: Photograph | None = None,
    *,
    width_mm: float | None = None,
    ends: float | None = None,
    picks: float | None = None,
    per: str = "inch",
    exposure: float | GreyCard | None = None,
    pattern: WeavePattern | None = None,
    covers: tuple[float, float] = COVERS,
    geometries: Sequence[Geometry] | None = None,
    rig: PhotoRig = RIG,
    tie: bool = False,
    quick: bool = False,
    seconds: float | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Progress = None,
) -> PhotoFit:
    """Find a fabric that looks like photographs taken on a rig.

    The optical parameters and each picture's falloff are fitted by `fit`. What else the photographs
    leave open is searched: first geometries by short fits, then, for the best, how wide the yarns
    are and how cloth and lamps were placed, in turns with longer fits. At last the lens's blur is
    read off the photographs' grain. It takes about three minutes on two cores.

    Photographs do not tell how large the cloth is, nor how bright: `width_mm`, or `ends` or
    `picks`, and `exposure` do. If they are left out, the result's `assumptions` say what was taken.
    Ctrl-C ends the search with the best so far (`stopped`).

    Parameters
    ----------
    front, back
        Photographs lit from the front and from behind: files (display values, decoded by the rig's
        gamma unless they hold linear light, as EXR does) or Images. One of them may be None.
    width_mm
        Real width of the piece of cloth that the pictures show, in millimetres; the rig is enlarged
        to it. None: as the rig or the `geometries` have it, if one of them is given; else that with
        which cloth has the usual 35 threads per centimetre.
    ends, picks
        In place of `width_mm`: threads per length along the rows and the columns of the picture,
        in [0.1, 1e4]; one of them is enough.
    per
        "inch" or "cm".
    exposure
        Factor between the rig's light and that of the photographs, greater than 0, or what a card
        of known reflectance shows. None: the exposure with which `overview` shows the cloth in the
        mean colours of the photograph (that lit from the front, if there is one).
    pattern
        The weave, if it is known; None: what the spectrum of the photograph suggests is tried.
    covers
        Narrowest and widest yarns that are tried, over their spacing, within [0.01, 1.5].
    geometries
        Geometries to try, with spacings in the rig's millimetres; None: those that pattern and
        spectrum suggest.
    rig
        How the photographs were taken; by default on the rig of Tang et al. 2024.
    tie
        Whether warp and weft share their optical parameters.
    quick
        Whether a first look is enough: fewer geometries, shorter fits, at most half a minute.
    seconds
        The search stops after so many seconds; the result's blur takes a few more. With less than
        90 it is a quick one. At least one fit is made.
    seed
        Fits with different seeds draw different paths.
    threads
        Threads to use; None: one per processor.
    progress
        None: a bar where a person watches; False: none; or a callable of (done, total).

    Raises
    ------
    ParameterError
        If there is no photograph, they differ in size, one is white, black or of one colour all
        over, or a number lies outside its range.

    Warns
    -----
    ConfidenceWarning
        If the spectrum hardly tells spacings and weave.
    """
    started = time.monotonic()
    threads, seconds = _threads("threads", threads), _seconds("seconds", seconds)
    known = Known(width_mm, ends, picks, per, exposure, pattern, covers, geometries, rig)
    task = make_task(read_photographs({"front": front, "back": back}, rig.gamma), known)
    for doubt in task.doubts:
        warnings.warn(doubt, ConfidenceWarning, stacklevel=2)
    quick = quick or (seconds is not None and seconds < WORTHWHILE_SECONDS)
    seconds = QUICK_SECONDS if quick and seconds is None else seconds
    effort = plan(quick=quick)
    total = effort.most_steps(len(task.geometries))
    with reporting(progress, total, description="fit") as report:
        search = Search(
            task,
            effort,
            tie=tie,
            seed=seed,
            threads=threads,
            report=report or (lambda _: None),
            deadline=None if seconds is None else started + seconds,
        )
        best = search.run()
    return _photo_fit(best, search)


def _photo_fit(best: Trial, search: Search) -> PhotoFit:
    task = search.task
    height, width = next(iter(task.images.values())).shape[:2]
    lenses = dict(zip(task.images, best.result.lenses, strict=True))
    sharp = PhotoFit(
        geometry=best.geometry,
        placements={"front": Placement(), "back": Placement(), **best.placements},
        result=best.result,
        candidates=search.candidates(),
        size=(width, height),
        lenses=dict.fromkeys(("front", "back"), best.result.lenses[0]) | lenses,
        rig=task.rig,
        assumptions=task.assumptions,
        doubts=task.doubts,
        stopped=search.stopped,
    )
    try:
        rendered = [
            sharp.picture(side, spp=BLUR_SPP, threads=search.threads, progress=False)
            for side in task.images
        ]
    except KeyboardInterrupt:
        return replace(sharp, stopped="interrupted")
    blur = matching_blur(rendered, list(task.images.values()))
    lenses = {side: replace(lens, blur=blur) for side, lens in sharp.lenses.items()}
    return replace(sharp, lenses=lenses)
