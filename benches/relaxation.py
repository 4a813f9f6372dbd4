"""How long relaxations take and how much memory: `python -m benches.relaxation [SIZE ...]`.

Each weave is relaxed in a process of its own. Seconds are those of all processors together, since
others may be at work on the machine.
"""

import json
import resource
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import plycloth as pc
from numpy.typing import NDArray

SIZES = (100, 200, 400, 1200)

Weave = NDArray[np.bool_]


def corner(size: int) -> Weave:
    """Return a weave of which 6 picks and 4 ends interlace."""
    up = np.zeros((size, size), bool)
    up[:6, :4] = np.random.default_rng(1).random((6, 4)) < 0.5
    return up


def random(size: int) -> Weave:
    """Return a weave of random crossings."""
    return np.random.default_rng(2).random((size, size)) < 0.5


def sparse(size: int) -> Weave:
    """Return a weave in which an end is up at about three picks, all others floats."""
    return np.random.default_rng(3).random((size, size)) < 3 / size


def framed(size: int) -> Weave:
    """Return a square of floats, half as wide as all, in plain weave."""
    up = np.add.outer(np.arange(size), np.arange(size)) % 2 == 0
    up[size // 4 : 3 * size // 4, size // 4 : 3 * size // 4] = True
    return up


def blocks(size: int) -> Weave:
    """Return four blocks of warp and of weft floats, held at their edges."""
    pick, end = np.ogrid[:size, :size]
    plain = (pick + end) % 2 == 0
    edge = (pick % (size // 2) < 2) | (end % (size // 2) < 2)
    return np.where(edge, plain, (pick < size // 2) == (end < size // 2))


def thin_frame(size: int) -> Weave:
    """Return floats nearly as wide as all, in a frame of four yarns of plain weave."""
    up = np.add.outer(np.arange(size), np.arange(size)) % 2 == 0
    up[4:-4, 4:-4] = True
    return up


def held_rows(size: int) -> Weave:
    """Return picks that float above all and below all by turns, held by two ends and picks."""
    pick, end = np.ogrid[:size, :size]
    plain = (pick + end) % 2 == 0
    return np.where((pick < 2) | (end < 2), plain, pick % 2 == 0)


def half(size: int) -> Weave:
    """Return plain weave, of which one half is picks that float over 63 ends."""
    pick, end = np.ogrid[:size, :size]
    plain = (pick + end) % 2 == 0
    return np.where(pick < size // 2, (pick % 2 == 0) | (end % 64 == 0), plain)


WEAVES: dict[str, Callable[[int], Weave]] = {
    "corner": corner,
    "random": random,
    "sparse": sparse,
    "framed": framed,
    "blocks": blocks,
    "thin": thin_frame,
    "half": half,
    "rows": held_rows,
}


def measure(name: str, size: int) -> dict[str, Any]:
    """Relax one weave in this process."""
    up = WEAVES[name](size)
    before = resource.getrusage(resource.RUSAGE_SELF)
    relaxed = pc.relax(up, warp_radius=0.4, weft_radius=0.4, progress=False)
    after = resource.getrusage(resource.RUSAGE_SELF)
    return {
        "seconds": after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime,
        "bytes": 1024 * (after.ru_maxrss - before.ru_maxrss) / up.size,
        "steps": relaxed.iterations,
    }


def main(sizes: tuple[int, ...]) -> None:
    """Print a line for each weave and size."""
    for name in WEAVES:
        for size in sizes:
            command = [sys.executable, "-m", "benches.relaxation", name, str(size)]
            output = subprocess.run(command, check=True, stdout=subprocess.PIPE).stdout
            found = json.loads(output)
            print(
                f"{name:8} {size:5}: {found['seconds']:7.2f} s of processors,"
                f" {found['bytes']:4.0f} bytes a crossing, {found['steps']} steps",
                flush=True,
            )


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] in WEAVES:
        print(json.dumps(measure(sys.argv[1], int(sys.argv[2]))))
    else:
        main(tuple(map(int, sys.argv[1:])) or SIZES)
