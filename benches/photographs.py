"""How well fitted cloth matches photographs: `python -m benches.photographs [NAME ...]`.

Fits each photo pair to both sides, to the front alone and to the back alone, and prints each fit's
relative error on both sides: averages over 32 x 32 blocks in linear light, root mean squared
difference over the photograph's mean, of the pictures as 8-bit files encoded by a gamma of 2.2.
Needs the folder of real data that PLYCLOTH_DATA names; takes some five minutes a pair on 2 cores.
"""

import sys
import time

import numpy as np
import plycloth as pc
from plycloth.cells import cell_averages

GAMMA = 2.2
CELLS = 16
SIDES = ("front", "back")


def error(picture, photograph):
    """Relative error of a picture, as 8-bit file, against the photograph; both in linear light."""
    codes = np.round(np.clip(picture.pixels, 0.0, 1.0).astype(float) ** (1 / GAMMA) * 255)
    fitted, target = (
        cell_averages(np.asarray(pixels, float), CELLS)
        for pixels in ((codes / 255) ** GAMMA, photograph.pixels)
    )
    return np.sqrt(((fitted - target) ** 2).mean()) / target.mean()


def row(name, fitted_to):
    """Fit to some sides; answer the line of the table."""
    photographs = dict(
        zip(SIDES, (pc.read_image(p, GAMMA) for p in pc.datasets.photo_pair(name)), strict=True)
    )
    given = [photographs[side] if side in fitted_to else None for side in SIDES]
    start = time.perf_counter()
    found = pc.fit_photographs(*given, progress=False)
    seconds = time.perf_counter() - start
    errors = [error(found.picture(side, progress=False), photographs[side]) for side in SIDES]
    shown = " ".join(f"{e:7.3f}" for e in errors)
    return f"{name:8} {'+'.join(fitted_to):11} {shown} {seconds:6.0f} s  {found.geometry}"


def main(names):
    """Print the table."""
    print("pair     fitted to     front    back    time  geometry", flush=True)
    for name in names or pc.datasets.photo_pairs():
        for fitted_to in (SIDES, SIDES[:1], SIDES[1:]):
            print(row(name, fitted_to), flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
