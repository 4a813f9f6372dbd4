"""A small fit that several tests show, save and report."""

from functools import cache

import numpy as np
import plycloth as pc
from samples import plain_fabric

SIDES = ("front", "back")


@cache
def small_fit():
    """The pictures of a fabric on the rig, and a fit to them that is as short as it can be."""
    fabric = plain_fabric()
    scenes = [pc.photo_rig(fabric, side, resolution=(16, 16)) for side in SIDES]
    pictures = [pc.render(scene, spp=4, progress=False) for scene in scenes]
    result = pc.fit(
        scenes,
        pictures,
        free=["base_color"],
        tie=True,
        objective="average",
        paths=4,
        rounds=1,
        evaluations=2,
        progress=False,
    )
    return pictures, result


class SmallPhotoFit:
    """Stands in for what `fit_photographs` finds, which takes minutes."""

    geometry = "plain weave"

    def __init__(self, photographs):
        self.photographs = photographs
        self.result = small_fit()[1]
        self.fabric = self.result.fabric

    def pictures(self):
        return {
            side: pc.Image(np.full((photograph.height, photograph.width, 3), 0.5, np.float32))
            for side, photograph in zip(SIDES, self.photographs, strict=True)
        }

    def summary(self):
        tried = [{"geometry": "plain weave", "errors": [0.1, 0.2]}]
        return {"errors": self.result.errors, "candidates": tried}
