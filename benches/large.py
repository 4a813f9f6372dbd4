"""Large drafts in which nothing repeats: `python -m benches.large [PICKS ENDS]`.

Seconds to a first picture of 64 x 64 pixels, and peak memory per crossing. Seconds are those of all
processors together, since others may be at work on the machine; the memory is what comes on top of
the program's own. A last line says what a longer render comes to.
"""

import resource
import sys
import warnings

import numpy as np
import plycloth as pc

from benches.measure import peak

PIXELS = 64
LONG = 8


def processors() -> float:
    """Seconds that all processors have worked for this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def main(picks: int = 1600, ends: int = 542) -> None:
    """Print a line for each step."""
    warnings.simplefilter("error", pc.OverlapWarning)
    pattern = pc.WeavePattern(np.random.default_rng(2).random((picks, ends)) < 0.5)
    program, before = peak(), processors()

    def show(what: str) -> None:
        nonlocal before
        now = processors()
        used = (peak() - program) * 1024**2 / (picks * ends)
        print(
            f"{what:26} {now - before:7.2f} s of processors, {used:4.0f} bytes a crossing",
            flush=True,
        )
        before = now

    fabric = pc.Fabric.from_draft(pc.Draft.from_pattern(pattern), progress=False)
    show("fitted")
    # A square in which the whole draft is seen, repeated along its shorter side.
    scene = pc.overview(fabric, size_mm=max(pc.Swatch(fabric).extent_mm), width=PIXELS)
    renderer = pc.Renderer(scene, progress=False)
    show("relaxed, overlaps sought")
    renderer.run(1, progress=False)
    show("first picture")
    renderer.run(LONG, progress=False)
    show(f"{LONG} more samples a pixel")


if __name__ == "__main__":
    main(*map(int, sys.argv[1:3]))
