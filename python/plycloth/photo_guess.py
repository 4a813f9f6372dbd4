"""What is taken for granted before a fit to photographs: scale, spacings and weaves."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plycloth.image import Image
from plycloth.photo_geometry import COVERS, YARNS, Geometry
from plycloth.photo_weaves import leaning, that_lean, weaves
from plycloth.rig import RIG, PhotoRig
from plycloth.spacing import LEAST_CONFIDENCE, Spacing, estimate_spacing
from plycloth.trade import spacing_mm
from plycloth.weave import WeavePattern

FloatArray = NDArray[np.float64]

# The pitch in pixels that is taken where none is found.
USUAL_PITCH = 2.0
# Threads per centimetre of a usual cloth, the geometric mean of ends and picks: from shirtings and
# sheetings (some 50 x 30) to twills for trousers (some 40 x 20), satins being closer.
USUAL_COUNT = 35.0


@dataclass(frozen=True)
class Threads:
    """What the photographs' spectra tell about the threads.

    Parameters
    ----------
    spacing
        That of the photograph whose spectrum tells most.
    side
        Which it is.
    """

    spacing: Spacing
    side: str

    @property
    def sure(self) -> bool:
        """Whether the weave's repeat can be relied on."""
        return self.spacing.doubt is None and self.spacing.repeat not in (None, 1)

    @property
    def pitch_px(self) -> tuple[float, float]:
        """Distance between ends and between picks, in pixels; the usual one where none is seen."""
        warp, weft = (
            px if px is not None and confidence >= LEAST_CONFIDENCE else USUAL_PITCH
            for px, confidence in (
                (self.spacing.warp_px, self.spacing.warp_confidence),
                (self.spacing.weft_px, self.spacing.weft_confidence),
            )
        )
        return warp, weft

    def likely(self) -> list[tuple[str, WeavePattern]]:
        """List the weaves that the spectrum leaves open."""
        if self.sure:
            return weaves(self.spacing.repeat, self.spacing.step)
        return that_lean(weaves(None), leaning(self.spacing.peaks), *self.pitch_px)


def find_threads(images: Mapping[str, FloatArray]) -> Threads:
    """Read the threads off the photograph, of those by side, that tells most about them."""
    found = [
        Threads(estimate_spacing(Image(image.astype(np.float32))), side)
        for side, image in images.items()
    ]
    return max(found, key=lambda threads: threads.spacing.confidence)


def usual_width(threads: Threads, width_px: int) -> float:
    """Return the width of a picture in millimetres if its cloth has the usual count."""
    usual = spacing_mm(USUAL_COUNT, "cm")
    return width_of(threads, width_px, (usual, usual))


def width_of(
    threads: Threads, width_px: int, spacings_mm: tuple[float | None, float | None]
) -> float:
    """Return the width of a picture in millimetres by the spacing of its ends, picks or both.

    Of both, which never agree to the last digit, the geometric mean counts.
    """
    widths = [
        width_px * spacing / pitch
        for spacing, pitch in zip(spacings_mm, threads.pitch_px, strict=True)
        if spacing is not None
    ]
    return float(np.exp(np.mean(np.log(widths))))


def guess_geometries(
    threads: Threads,
    width_px: int,
    rig: PhotoRig = RIG,
    pattern: WeavePattern | None = None,
    covers: tuple[float, float] = COVERS,
) -> list[Geometry]:
    """List geometries of the weaves that the spectrum suggests, or of the given one."""
    scale = rig.picture_width / width_px
    warp_mm, weft_mm = (pitch * scale for pitch in threads.pitch_px)
    likely = threads.likely() if pattern is None else [("given weave", pattern)]
    guesses = [
        Geometry(name, weave, warp.within(covers), weft.within(covers), warp_mm, weft_mm)
        for name, weave in likely
        for warp, weft in YARNS
    ]
    return [guess for guess in guesses if guess.has_room(covers[0])]
