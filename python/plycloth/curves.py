"""The plies of a swatch as curves: arrays of points and radii, for other programs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plycloth._check import ParameterError, choice, instance, integer
from plycloth.fabric import Fabric
from plycloth.scene import Swatch
from plycloth.yarn import RoundYarn, Yarn

Array = NDArray[np.float64]

# As in plycloth's core (src/cloth/twist.rs, src/cloth/yarn_path.rs).
SEGMENTS_PER_TURN = 16
LEAST_SEGMENTS = 8

# A swatch of whole repeats may be measured in numbers that are rounded.
ROUNDING = 1e-9

_swatch = instance(Swatch)
_yarns = choice("warp", "weft")


@dataclass(frozen=True, eq=False)
class PlyCurves:
    """The plies of all ends, or of all picks, of one kind of a swatch.

    Attributes
    ----------
    points : ndarray, (yarns, plies, joints, 3)
        Joints of the plies' centre lines in millimetres, where the swatch lies in space: ends from
        the left, along +y; picks from the top, along +x. A flat yarn is one ply.
    radii_mm : tuple of 2 floats
        Half the width of each ply in the plane of the cloth and half its height: equal if the
        yarn is not pressed. The cross section is an ellipse, or a rectangle if the yarn is flat.
    """

    points: Array
    radii_mm: tuple[float, float]


def ply_curves(swatch: Swatch, yarns: str, *, kind: int | None = None) -> PlyCurves:
    """Compute the plies of all ends, or of all picks, of one kind of a swatch as curves.

    Joints are those that plycloth renders (section 3.2), apart from the rounding of heights and of
    the twist that lets it share equal pieces. Where the swatch ends within a repeat, curves end at
    its edge; yarns whose centre lines lie beyond it are left out. Takes a relaxation; memory grows
    with the number of crossings.

    Parameters
    ----------
    swatch
        The cloth.
    yarns
        "warp" for the ends, "weft" for the picks.
    kind
        Which of `Fabric.warp_kinds` or `Fabric.weft_kinds`, since yarns that differ need not have
        as many plies or joints. None: the only one.

    Raises
    ------
    ParameterError
        If `yarns` is neither, or there is no such kind, or `kind` is None where there are several.
    TypeError
        If `swatch` is not a Swatch.
    """
    fabric = _swatch("swatch", swatch).fabric
    is_warp = _yarns("yarns", yarns) == "warp"
    number = _kind(yarns, fabric.warp_kinds if is_warp else fabric.weft_kinds, kind)
    yarn = (fabric.warp_kinds if is_warp else fabric.weft_kinds)[number]
    kind_of = fabric.end_kind if is_warp else fabric.pick_kind
    extent = np.asarray(swatch.extent_mm)
    repeats = np.ceil(extent / fabric.repeat_mm - ROUNDING).astype(int)
    # Along the yarns and across them.
    (length, along), (breadth, across) = (
        (extent[axis], int(repeats[axis])) for axis in ((1, 0) if is_warp else (0, 1))
    )
    slots, widths = _spacings(fabric, is_warp)
    position = np.cumsum(np.tile(widths, across)) - 0.5 * np.tile(widths, across)
    inside = (position < breadth) & np.tile(kind_of == number, across)
    knots = np.append(0.0, np.cumsum(np.repeat(0.5 * np.tile(slots, along), 2)))
    # Ends run upwards from below the swatch if that ends within a repeat: its top is a repeat's.
    start = max(0.0, knots[-1] - length) if is_warp else 0.0
    s, knot = _stations(knots, _segments(yarn, slots), start, min(start + length, knots[-1]))
    z, dz = (
        np.tile(each, (across, 1))[inside]
        for each in _hermite(knots, *_heights(fabric, is_warp), s, knot)
    )
    sideways, outwards = _helices(yarn, s)
    # The normal is perpendicular to the tangent (1, dz) in the plane of the yarn and z.
    norm = np.sqrt(1.0 + dz**2)[:, None]
    forward = s - start - outwards * dz[:, None] / norm - 0.5 * length
    up = z[:, None] + outwards / norm
    aside = np.broadcast_to(position[inside, None, None] + sideways - 0.5 * breadth, up.shape)
    # Ends run along +y with their side to +x, picks along +x with their side to -y.
    parts = [aside, forward, up] if is_warp else [forward, -aside, up]
    return PlyCurves(np.stack(parts, axis=-1), _radii(yarn))


def _kind(yarns: str, kinds: Sequence[Yarn], kind: int | None) -> int:
    if kind is None and len(kinds) > 1:
        raise ParameterError(
            f"kind must say which of the fabric's {len(kinds)} different yarns in its {yarns},"
            f" from 0 to {len(kinds) - 1}"
        )
    checked: int = integer(0, len(kinds) - 1)("kind", 0 if kind is None else kind)
    return checked


def _radii(yarn: Yarn) -> tuple[float, float]:
    if not isinstance(yarn, RoundYarn):
        return yarn.half_width, 0.5 * yarn.thickness
    return yarn.ply_radius, yarn.ply_radius * _pressed(yarn)


def _pressed(yarn: RoundYarn) -> float:
    """Return the height of the cross section over its width."""
    return 0.5 * yarn.thickness / yarn.radius_mm


def _helices(yarn: Yarn, s: Array) -> tuple[Array, Array]:
    """Return how far each ply's centre is aside of the yarn's and out of the cloth (plies x s)."""
    if not isinstance(yarn, RoundYarn):
        return np.zeros((1, len(s))), np.zeros((1, len(s)))
    angle = 2 * np.pi * (s / yarn.pitch + np.arange(yarn.plies)[:, None] / yarn.plies)
    # The twist turns in the round yarn of which a pressed one is a stretched copy.
    out = yarn.helix_radius * _pressed(yarn)
    return yarn.helix_radius * np.cos(angle), -out * np.sin(angle)


def _spacings(fabric: Fabric, is_warp: bool) -> tuple[Array, Array]:
    """Return the slots along a yarn of the set, in the direction it runs, and the set's widths."""
    if is_warp:
        return fabric.pick_spacing[::-1], fabric.end_spacing
    return fabric.end_spacing, fabric.pick_spacing


def _segments(yarn: Yarn, slots: Array) -> int:
    """Return the number of straight pieces from one crossing to the next, an even one."""
    if not isinstance(yarn, RoundYarn) or yarn.plies == 1:
        return LEAST_SEGMENTS
    turns = abs(float(np.mean(slots)) / yarn.pitch)
    return max(LEAST_SEGMENTS, 2 * int(np.ceil(0.5 * SEGMENTS_PER_TURN * turns)))


def _stations(
    knots: Array, segments: int, start: float, end: float
) -> tuple[Array, NDArray[np.intp]]:
    """Return the joints' places along the yarns, and the knot to the left of each."""
    half = segments // 2
    steps = np.arange(half) / half
    s = np.append((knots[:-1, None] + steps * np.diff(knots)[:, None]).ravel(), knots[-1])
    knot = np.append(np.repeat(np.arange(len(knots) - 1), half), len(knots) - 2)
    within = (s > start) & (s < end)
    ends = np.searchsorted(knots, (start, end), side="right") - 1
    ends = np.minimum(ends, len(knots) - 2)
    return (
        np.concatenate([[start], s[within], [end]]),
        np.concatenate([ends[:1], knot[within], ends[1:]]),
    )


def _heights(fabric: Fabric, is_warp: bool) -> tuple[Array, Array]:
    """Return heights in millimetres and slopes at the knots, in the direction the yarns run."""
    relaxed = fabric.relaxed()
    if is_warp:
        # Knots are counted from the first pick, at the top: turned about, the start becomes the
        # end, which the periodic curve shares.
        height, slope = relaxed.warp_height, -relaxed.warp_slope
        turned = [np.roll(knots[:, ::-1], 1, axis=1) for knots in (height, slope)]
        return turned[0] * fabric.unit_mm, turned[1]
    return relaxed.weft_height * fabric.unit_mm, relaxed.weft_slope


def _hermite(
    knots: Array, height: Array, slope: Array, s: Array, knot: NDArray[np.intp]
) -> tuple[Array, Array]:
    """Return, for each yarn of a repeat, heights and slopes at places along it."""
    step = np.diff(knots)[knot]
    t = (s - knots[knot]) / step
    # The curves are periodic.
    left, right = knot % height.shape[1], (knot + 1) % height.shape[1]
    h0, h1 = height[:, left], height[:, right]
    m0, m1 = step * slope[:, left], step * slope[:, right]
    rise = h1 - h0
    z = h0 + t * (m0 + t * ((3 * rise - 2 * m0 - m1) + t * (m0 + m1 - 2 * rise)))
    dz = (m0 + t * (2 * (3 * rise - 2 * m0 - m1) + t * 3 * (m0 + m1 - 2 * rise))) / step
    return z, dz
