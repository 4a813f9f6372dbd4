"""A small fit that several tests show, save and report."""

from dataclasses import replace
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
    assumptions = ("The cloth is as large as it is.",)
    doubts = ("it may be otherwise",)
    notes = ("Warning: it may be otherwise.", *assumptions)

    def __init__(self, sides=SIDES, stopped=None):
        whole = small_fit()[1]
        count = len(sides)
        self.result = replace(
            whole,
            scenes=whole.scenes[:count],
            lenses=whole.lenses[:count],
            matches=whole.matches[:count],
        )
        self.fabric = self.result.fabric
        self.stopped = stopped
        self.errors = self.result.errors

    def pictures(self):
        return {side: self.picture(side) for side in SIDES}

    def picture(self, side, **_):
        return pc.Image(np.full((12, 12, 3), 0.5, np.float32))

    def summary(self):
        tried = [{"geometry": "plain weave", "errors": [0.1, 0.2]}]
        return {"errors": self.result.errors, "candidates": tried}
