"""Whether a fit finds what was hidden: `python -m benches.recovery`.

A satin whose ends are ribbons and whose picks are round yarns is rendered on the photo rig, lit
from the front and from behind. Its optical parameters are looked for twice from a start that both
yarns share: first all but the tints and r, then all. Printed for each: the hidden value, what was
found, how far off that is, its standard error, and which other parameters it trades with.

Why tints and r are given the first time: k_y^S and sigma_t both scale what passes a ply; r and the
colours k_x^B and k_y are seen as products alone, but for slight differences in how they change with
the angle. So two pictures tell them much worse than all else. What is told to 2.5% should be within
5%. Takes about half an hour on 2 cores, and 10 GB.
"""

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace

import plycloth as pc
from plycloth.fit_result import FitResult
from plycloth.unknowns import NAMES, unknowns

SIDES = ("front", "back")
HIDDEN = (
    pc.PlyBsdf(
        eta=1.45,
        specular_tint=(0.9, 0.85, 0.7),
        transmission_tint=(0.7, 0.8, 0.9),
        base_color=(0.7, 0.45, 0.25),
        transmitted_color=(0.6, 0.4, 0.3),
        body_reflection=0.6,
        extinction=40.0,
        roughness=(0.2, 0.45),
        exit_roughness=(0.25, 0.6),
    ),
    pc.PlyBsdf(
        eta=1.6,
        specular_tint=(0.8, 0.9, 0.85),
        transmission_tint=(0.9, 0.75, 0.8),
        base_color=(0.3, 0.5, 0.65),
        transmitted_color=(0.35, 0.5, 0.7),
        body_reflection=0.45,
        extinction=12.0,
        roughness=(0.3, 0.35),
        exit_roughness=(0.3, 0.5),
    ),
)
START = pc.PlyBsdf(
    specular_tint=0.8,
    transmission_tint=0.8,
    extinction=20.0,
    roughness=(0.3, 0.3),
    exit_roughness=(0.4, 0.4),
)
GIVEN = ("specular_tint", "transmission_tint", "body_reflection")
# What cannot be told better than this, relatively, cannot be asked to be within twice as much.
TOLD = 0.025


def scenes(bsdfs: tuple[pc.PlyBsdf, pc.PlyBsdf]) -> list[pc.Scene]:
    """The rig with each of its lamps."""
    fabric = pc.Fabric(
        pc.WeavePattern.satin(5, 2),
        pc.FlatYarn(0.2, bsdfs[0]),
        pc.RoundYarn(0.06, bsdfs[1], plies=1),
        0.25,
        0.2,
    )
    return [pc.photo_rig(fabric, side, resolution=(64, 64)) for side in SIDES]


def recover(pictures: list[pc.Image], free: Sequence[str], **effort: int) -> FitResult:
    """Look for the free parameters; the others are as hidden."""
    given = [name for name in NAMES if name not in free]
    warp, weft = (
        replace(START, **{name: getattr(hidden, name) for name in given}) for hidden in HIDDEN
    )
    return pc.fit(scenes((warp, weft)), pictures, free=free, seed=3, progress=False, **effort)


def show(result: FitResult, free: Sequence[str]) -> None:
    """Print a line for each parameter, and the worst of those that are told."""
    worst = told = 0
    for unknown, estimate in zip(
        unknowns(free, tie=False, bounds={}), result.estimates, strict=True
    ):
        hidden = unknown.value(HIDDEN)
        off, spread = abs(estimate.value / hidden - 1.0), estimate.uncertainty / hidden
        if spread < TOLD:
            worst, told = max(worst, off), told + 1
        found = f"{estimate.label:30} {hidden:8.4f} {estimate.value:8.4f}"
        trades = f"  trades with {', '.join(estimate.partners)}" if estimate.partners else ""
        print(f"{found} off {off:6.1%} +- {spread:6.1%}{trades}")
    print(f"told to {TOLD:.1%}: {told}, the worst of them off by {worst:.1%}", flush=True)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(prog="benches.recovery", description=__doc__)
    parser.add_argument("--spp", type=int, default=16384, help="of the pictures (default 16384)")
    parser.add_argument("--paths", type=int, default=16384, help="per cell (default 16384)")
    parser.add_argument("--rounds", type=int, default=32, help="(default 32)")
    options = parser.parse_args()
    pictures = [
        pc.render(scene, spp=options.spp, seed=11, both_sides=True, progress=False)
        for scene in scenes(HIDDEN)
    ]
    for free in ([name for name in NAMES if name not in GIVEN], NAMES):
        start = time.perf_counter()
        result = recover(pictures, free, paths=options.paths, rounds=options.rounds)
        print(f"\n{', '.join(free)}\n{result!r}, {time.perf_counter() - start:.0f} s")
        show(result, free)


if __name__ == "__main__":
    main()
