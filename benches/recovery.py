"""Whether a fit finds what was hidden: `python -m benches.recovery`.

A satin whose ends are ribbons and whose picks are round yarns is rendered on the photo rig, lit
from the front and from behind. All optical parameters of both yarns are then looked for, from the
same start for both. Printed for each: the hidden value, what was found, how far off that is, and
its standard error. What the pictures cannot tell to 2.5%
is named with the parameters that it trades with.
"""

import argparse
import time

import plycloth as pc
from plycloth.fit_result import FitResult
from plycloth.unknowns import unknowns

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


def recover(spp: int, paths: int, rounds: int) -> FitResult:
    """Render what is hidden, and look for it."""
    pictures = [
        pc.render(scene, spp=spp, seed=11, both_sides=True, progress=False)
        for scene in scenes(HIDDEN)
    ]
    return pc.fit(
        scenes((START, START)), pictures, paths=paths, rounds=rounds, seed=3, progress=False
    )


def table(result: FitResult) -> list[tuple[str, float, float, float, float, tuple[str, ...]]]:
    """Label, hidden value, found, relative error, relative uncertainty and partners of each."""
    rows = []
    for unknown, estimate in zip(
        unknowns(None, tie=False, bounds={}), result.estimates, strict=True
    ):
        hidden = unknown.value(HIDDEN)
        off = abs(estimate.value / hidden - 1.0)
        spread = estimate.uncertainty / hidden
        rows.append((estimate.label, hidden, estimate.value, off, spread, estimate.partners))
    return rows


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="benches.recovery", description=__doc__)
    parser.add_argument("--spp", type=int, default=4096, help="of the pictures (default 4096)")
    parser.add_argument("--paths", type=int, default=4096, help="per cell (default 4096)")
    parser.add_argument("--rounds", type=int, default=16, help="(default 16)")
    options = parser.parse_args()
    start = time.perf_counter()
    result = recover(**vars(options))
    print(f"{result!r}, {time.perf_counter() - start:.0f} s")
    told = []
    for label, hidden, found, off, spread, partners in table(result):
        is_told = spread < TOLD
        told += [off] if is_told else []
        note = "" if is_told else f"  not told apart from {', '.join(partners) or 'nothing'}"
        print(f"{label:32} {hidden:8.4f} {found:8.4f} off {off:6.1%} +- {spread:6.1%}{note}")
    print(
        f"{len(told)} parameters are told to {TOLD:.1%}; the worst of them is off {max(told):.1%}"
    )


if __name__ == "__main__":
    main()
