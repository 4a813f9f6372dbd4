"""What a search in photographs starts from, and what is taken for granted in it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plycloth._check import POSITIVE, ParameterError, Range, number, vector
from plycloth.lens import Lens
from plycloth.photo_exposure import LIGHTS, GreyCard, Look, likely_exposure
from plycloth.photo_geometry import Geometry
from plycloth.photo_guess import (
    USUAL_COUNT,
    Threads,
    find_threads,
    guess_geometries,
    usual_width,
    width_of,
)
from plycloth.photo_input import Lit
from plycloth.rig import RIG, PhotoRig
from plycloth.spacing import SMALLEST_SIDE
from plycloth.trade import spacing_mm
from plycloth.weave import WeavePattern

FloatArray = NDArray[np.float64]

# Counts of ends and picks whose ratio is off by this factor contradict the picture.
LIKE = 1.15

# Yarns of a geometry that a user names may be narrowed to this part until they fit.
LEAST_KEPT = 0.5

_count = number(Range(0.1, 1e4))
_width = number(Range(1e-3, 1e6))
_exposure = number(POSITIVE)
_covers = vector(2, number(Range(0.01, 1.5)))


@dataclass(frozen=True, eq=False)
class Known:
    """What a user knows beside the photographs; as in `fit_photographs`."""

    width_mm: float | None
    ends: float | None
    picks: float | None
    per: str
    exposure: float | GreyCard | None
    pattern: WeavePattern | None
    covers: tuple[float, float]
    geometries: Sequence[Geometry] | None
    rig: PhotoRig

    def __post_init__(self) -> None:
        if self.width_mm is not None:
            _width("width_mm", self.width_mm)
        self._check_counts()
        if self.exposure is not None and not isinstance(self.exposure, GreyCard):
            _exposure("exposure", self.exposure)
        low, high = _covers("covers", self.covers)
        if low > high:
            raise ParameterError(f"covers must be the lower one first, not {low:g}, {high:g}")
        given = self.geometries
        if given is not None and not (given and all(isinstance(g, Geometry) for g in given)):
            raise TypeError("geometries must be a list of at least one Geometry")
        for each in given or ():
            if not each.has_room(LEAST_KEPT * min(each.warp.cover, each.weft.cover)):
                raise ParameterError(f"geometries: the yarns of {each} have no room")

    @property
    def spacings_mm(self) -> tuple[float | None, float | None]:
        """Distances of ends and picks, where their counts are known."""
        ends, picks = (
            None if count is None else float(spacing_mm(count, self.per))
            for count in (self.ends, self.picks)
        )
        return ends, picks

    def _check_counts(self) -> None:
        for name, count in (("ends", self.ends), ("picks", self.picks)):
            if count is None:
                continue
            spacing_mm(_count(name, count), self.per)
            for other in ("width_mm", "geometries"):
                if getattr(self, other) is not None:
                    raise ParameterError(
                        f"{other} must not be given with {name}: both say how large the cloth is"
                    )


@dataclass(frozen=True, eq=False)
class Task:
    """What to search in.

    Parameters
    ----------
    images
        By side, in linear light.
    rig
        How they were taken, in the cloth's real size.
    geometries
        Those to try.
    lens
        The exposure to start from, or that is known.
    look
        What the cloth by itself is to look like; None: the exposure is known.
    covers
        Narrowest and widest yarns, over their spacing.
    assumptions, doubts
        What was taken for granted, and what of it may well be wrong, a sentence each.
    """

    images: dict[str, FloatArray]
    rig: PhotoRig
    geometries: Sequence[Geometry]
    lens: Lens
    look: Look | None
    covers: tuple[float, float]
    assumptions: Sequence[str]
    doubts: Sequence[str]


def make_task(photographs: Mapping[str, Lit], known: Known) -> Task:
    """Decide what the photographs leave open and is not searched for."""
    images = {side: photograph.pixels for side, photograph in photographs.items()}
    width_px = next(iter(images.values())).shape[1]
    threads = None if known.geometries is not None else _threads_of(photographs)
    rig, scale = _real_rig(known, threads, width_px)
    lens, look, brightness = _exposure_of(known, rig, images)
    geometries, cloth = _geometries(known, threads, rig, width_px)
    sides = [] if len(images) == 2 else [_unseen(next(iter(images)))]
    return Task(
        images=images,
        rig=rig,
        geometries=geometries,
        lens=lens,
        look=look,
        covers=known.covers,
        assumptions=[scale, brightness, *cloth, *sides],
        doubts=_doubts(photographs, threads, known),
    )


def _doubts(photographs: Mapping[str, Lit], threads: Threads | None, known: Known) -> list[str]:
    if threads is None:
        return []
    doubts = [] if threads.spacing.doubt is None else [threads.spacing.doubt]
    ends, picks = known.spacings_mm
    warp_px, weft_px = threads.pitch_px
    if ends is not None and picks is not None:
        given, seen = picks / ends, weft_px / warp_px
        if not 1.0 / LIKE < given / seen < LIKE:
            doubts.append(
                f"there are {seen:.2g} times as many ends as picks per length in the picture, but"
                f" {given:.2g} times as many were given: perhaps the spectrum was misread, or the"
                " cloth lies on its side"
            )
    return [f"{photographs[threads.side].name}: {doubt}" for doubt in doubts]


def _threads_of(photographs: Mapping[str, Lit]) -> Threads:
    for photograph in photographs.values():
        height, width, _ = photograph.pixels.shape
        if min(height, width) < SMALLEST_SIDE:
            raise ParameterError(
                f"{photograph.name}: has {width} x {height} pixels, but at least {SMALLEST_SIDE}"
                " along both sides are needed to find threads; or name geometries"
            )
    return find_threads({side: each.pixels for side, each in photographs.items()})


def _real_rig(known: Known, threads: Threads | None, width_px: int) -> tuple[PhotoRig, str]:
    """Return the rig in the size that the cloth really has, and how that is known."""
    if known.width_mm is not None:
        rig = known.rig.scaled(known.width_mm)
        return (
            rig,
            f"The pictures show {rig.picture_width:.3g} mm of cloth from left to right, as given.",
        )
    if threads is not None and any(known.spacings_mm):
        rig = known.rig.scaled(width_of(threads, width_px, known.spacings_mm))
        return rig, (
            f"The pictures show {rig.picture_width:.3g} mm of cloth from left to right, by the"
            " number of threads given and the distances between threads in the picture."
        )
    if threads is None or known.rig != RIG:
        what = "the rig" if threads is not None else "the geometries"
        return known.rig, (
            f"The pictures show {known.rig.picture_width:.3g} mm of cloth from left to right, by"
            f" the measures of {what}."
        )
    rig = known.rig.scaled(usual_width(threads, width_px))
    return rig, (
        f"The pictures are taken to show {rig.picture_width:.3g} mm of cloth from left to right,"
        f" since {USUAL_COUNT:g} threads per cm are usual; there is cloth of half and of twice as"
        " many, so give the real width if you can."
    )


def _exposure_of(
    known: Known, rig: PhotoRig, images: Mapping[str, FloatArray]
) -> tuple[Lens, Look | None, str]:
    """Return the exposure that is known, or else how the cloth is to look; and that in words."""
    if isinstance(known.exposure, GreyCard):
        lens = Lens(known.exposure.exposure(rig))
        shown = f"a card of reflectance {known.exposure.reflectance:g}"
        return (
            lens,
            None,
            f"The exposure, {lens.exposure:.4g}, is that with which {shown} looks as given.",
        )
    if known.exposure is not None:
        return Lens(known.exposure), None, f"The exposure is {known.exposure:.4g}, as given."
    side, image = next(iter(images.items()))
    height, width = image.shape[:2]
    size_mm = (rig.picture_width, rig.picture_width * height / width)
    look = Look(side, image.mean((0, 1)), size_mm, width)
    return (
        Lens(likely_exposure(rig, side)),
        look,
        (
            "How bright the cloth is depends on the exposure, which is not known: it is taken to"
            f' be the one with which the cloth in the light "{LIGHTS[side]}" of overview has the'
            f" mean colours of the photograph lit from the {side}."
        ),
    )


def _geometries(
    known: Known, threads: Threads | None, rig: PhotoRig, width_px: int
) -> tuple[list[Geometry], list[str]]:
    """Return the geometries to try, and where they come from."""
    if threads is None:
        assert known.geometries is not None
        return list(known.geometries), []
    tried = guess_geometries(threads, width_px, rig, known.pattern, known.covers)
    if not tried:
        raise ParameterError(
            f"covers must be less: yarns {known.covers[0]:.0%} of their spacing wide have no room"
        )
    warp_mm, weft_mm = tried[0].warp_spacing_mm, tried[0].weft_spacing_mm
    low, high = known.covers
    return tried, [
        f"At that width there are {10.0 / warp_mm:.3g} ends and {10.0 / weft_mm:.3g} picks per cm.",
        _weaves_in_words(known, threads),
        f"Yarns are {low:.0%} to {high:.0%} of their spacing wide, and pressed and narrowed until"
        " none pass through each other.",
    ]


def _weaves_in_words(known: Known, threads: Threads) -> str:
    if known.pattern is not None:
        return "The weave is the given one."
    if threads.sure:
        return (
            f"The weave repeats after {threads.spacing.repeat} threads, as the spectrum shows it;"
            " which of them lie on the face was searched."
        )
    return (
        "The weave is one of the most common, as the spectrum does not tell its repeat; of those,"
        " one whose lines go the way of the photograph's."
    )


def _unseen(side: str) -> str:
    other = {"front": "behind", "back": "the front"}[side]
    return f"There is no photograph lit from {other}: how the cloth looks in such light is a guess."
