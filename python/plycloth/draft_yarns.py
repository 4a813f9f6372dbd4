"""The yarns that a draft's threads stand for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from plycloth.bsdf import PlyBsdf
from plycloth.yarn import RoundYarn
from plycloth.yarn_set import MAX_HALF_WIDTH, Yarns

FloatArray = NDArray[np.float64]

# The albedo that a draft's white stands for: that of bleached cotton, not a perfect reflector.
WHITE_ALBEDO = 0.8


def draft_yarns(
    thickness_mm: FloatArray, spacing_mm: FloatArray, like: RoundYarn | None = None
) -> Yarns:
    """Return yarns that stand for those of a draft: one, or one per thread if they differ.

    Parameters
    ----------
    thickness_mm, spacing_mm
        Diameter and slot of each thread. None is made thicker than `Fabric` takes, four mean
        slots; `Fabric.fitted` narrows them to less.
    like
        Gives plies and pitch, as parts of its radius. None: three plies, a pitch of 8 radii.
    """
    widest = 2.0 * MAX_HALF_WIDTH * float(np.mean(spacing_mm))
    thickness = np.minimum(thickness_mm, widest)
    known = {value: _draft_yarn(value, like) for value in np.unique(thickness).tolist()}
    if len(known) == 1:
        return next(iter(known.values()))
    return tuple(known[value] for value in thickness.tolist())


def _draft_yarn(thickness_mm: float, like: RoundYarn | None) -> RoundYarn:
    bsdf = PlyBsdf(base_color=(WHITE_ALBEDO,) * 3, transmitted_color=(WHITE_ALBEDO,) * 3)
    yarn = RoundYarn(radius_mm=0.5 * thickness_mm, bsdf=bsdf)
    if like is None:
        return yarn
    pitch = None if like.pitch_mm is None else like.pitch_mm * yarn.radius_mm / like.radius_mm
    return replace(yarn, plies=like.plies, pitch_mm=pitch)
