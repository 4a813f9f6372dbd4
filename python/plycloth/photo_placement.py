"""How cloth and lamp lay on the rig for one photograph, and the search for it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plycloth.fabric import Fabric
from plycloth.rig import PhotoRig, photo_rig
from plycloth.scene import Scene

FloatArray = NDArray[np.float64]

# Rotation in degrees, and the lamp's offset along x, y and z in parts of the camera's height: by
# how much they are moved to see what changes, and how far they may be off.
PROBES = np.array([1.0, 0.03, 0.03, 0.03])
LIMITS = np.array([8.0, 0.1875, 0.1875, 0.1875])
ITERATIONS = 3
# A step that leaves more than this part of the squares is the last.
WORTHWHILE = 0.97
# Added to the squares of what a probe changes, relative to their mean: what hardly shows stays.
DAMPING = 0.02


@dataclass(frozen=True)
class Placement:
    """Where cloth and lamp were for a photograph, as far as it is not where the rig has them.

    Parameters
    ----------
    rotation
        Of the cloth, in degrees, counter-clockwise in the picture.
    lamp_offset
        Of the lamp, along x, y and z, in millimetres.
    """

    rotation: float = 0.0
    lamp_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def scene(self, rig: PhotoRig, fabric: Fabric, side: str, resolution: tuple[int, int]) -> Scene:
        """Return the rig's scene with cloth and lamp in these places."""
        return photo_rig(
            fabric,
            side,
            rig=rig,
            rotation=self.rotation,
            lamp_offset=self.lamp_offset,
            resolution=resolution,
        )


def find_placement(
    start: Placement, height: float, residuals: Callable[[Placement], FloatArray]
) -> Placement:
    """Find the placement of least squares near `start`, by damped Gauss-Newton steps.

    Parameters
    ----------
    start
        Where the search begins.
    height
        The camera's height in millimetres, which probes and limits go with.
    residuals
        What is to be small: an array whose noise is the same for all placements.
    """
    units = PROBES * np.array([1.0, height, height, height])
    limits = LIMITS / PROBES

    def at(numbers: FloatArray) -> Placement:
        rotation, x, y, z = (float(number) for number in numbers * units)
        return Placement(rotation, (x, y, z))

    best = np.clip(np.array([start.rotation, *start.lamp_offset]) / units, -limits, limits)
    left = residuals(at(best))
    for _ in range(ITERATIONS):
        # Away from the nearer limit, so that every probe is one.
        probes = np.diag(np.where(best > 0.0, -1.0, 1.0))
        changes = np.stack([residuals(at(best + probe)) - left for probe in probes])
        squares = changes @ changes.T
        damped = squares + DAMPING * np.trace(squares) / len(squares) * np.eye(len(squares))
        step = -np.linalg.solve(damped, changes @ left) * np.diag(probes)
        before = left @ left
        for scale in (1.0, 0.5, 0.25):
            moved = np.clip(best + scale * step, -limits, limits)
            reached = residuals(at(moved))
            if reached @ reached < before:
                best, left = moved, reached
                break
        if left @ left > WORTHWHILE * before:
            break
    return at(best)
