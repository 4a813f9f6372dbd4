"""How well fitted cloth matches photographs: `python -m benches.photographs [NAME ...]`.

Fits each photo pair to both sides by three seeds, to the front alone and to the back alone, and
prints each fit's relative error on both sides: averages over 32 x 32 blocks in linear light, root
mean squared difference over the photograph's mean, of the pictures as 8-bit files encoded by a
gamma of 2.2. The fabric by itself, as `overview` shows it at the photograph's scale, should have
the mean colours of the front: "colour" is the largest deviation of a channel, and "lines" tells
whether the strongest diagonal lines of both go the same way (for the back alone: of the back, in
light "back"). Beside them stand the errors of FabricBTDF-Recovery (Tang et al. 2024), fitted to
both sides, and of one colour per photograph times the falloffs of light and lens ("Lambert"), by
the same metric. Needs the folder of real data that PLYCLOTH_DATA names; takes some fifteen minutes
a pair on 2 cores.
"""

import sys
import time

import numpy as np
import plycloth as pc
from plycloth.cells import cell_averages
from plycloth.photo_exposure import LIGHTS
from plycloth.photo_weaves import leaning

GAMMA = 2.2
CELLS = 16
SIDES = ("front", "back")
# What is fitted to, by which seeds.
FITS = ((SIDES, (0, 1, 2)), (SIDES[:1], (0,)), (SIDES[1:], (0,)))
# Front and back: the best of 5 to 7 fits of FabricBTDF-Recovery, and Lambert.
PEERS = {
    "satin1": ((0.113, 0.106), (0.288, 0.442)),
    "satin2": ((0.243, 0.217), (0.656, 0.835)),
    "twill1": ((0.102, 0.119), (0.118, 0.180)),
    "twill3": ((0.078, 0.090), (0.087, 0.092)),
    "twill4": ((0.168, 0.121), (0.180, 0.096)),
}


def error(picture, photograph):
    """Relative error of a picture, as 8-bit file, against the photograph; both in linear light."""
    codes = np.round(np.clip(picture.pixels, 0.0, 1.0).astype(float) ** (1 / GAMMA) * 255)
    fitted, target = (
        cell_averages(np.asarray(pixels, float), CELLS)
        for pixels in ((codes / 255) ** GAMMA, photograph.pixels)
    )
    return np.sqrt(((fitted - target) ** 2).mean()) / target.mean()


def row(name, fitted_to, seed=0):
    """Fit to some sides; answer the line of the table."""
    photographs = dict(
        zip(SIDES, (pc.read_image(p, GAMMA) for p in pc.datasets.photo_pair(name)), strict=True)
    )
    given = [photographs[side] if side in fitted_to else None for side in SIDES]
    start = time.perf_counter()
    found = pc.fit_photographs(*given, seed=seed, progress=False)
    seconds = time.perf_counter() - start
    errors = [error(found.picture(side, progress=False), photographs[side]) for side in SIDES]
    color, lines = look(found, fitted_to[0], photographs[fitted_to[0]])
    label = f"{'+'.join(fitted_to)}, seed {seed}"
    return (
        f"{name:8} {label:19} {_pair(errors)} {seconds:6.0f} s {color:7.1%}"
        f" {'same' if lines else 'other':5} {found.geometry}"
    )


def look(found, side, photograph):
    """How far the fabric by itself is off the photograph's colours; whether lines go its way."""
    scale = found.rig.picture_width / photograph.width
    size_mm = (scale * photograph.width, scale * photograph.height)
    scene = pc.overview(found.fabric, LIGHTS[side], size_mm=size_mm, width=photograph.width)
    seen = pc.render(scene, spp=16, progress=False)
    colors = (image.pixels.mean((0, 1)) for image in (seen, photograph))
    ratio = np.divide(*colors)
    ways = {leaning(pc.estimate_spacing(image).peaks) for image in (seen, photograph)}
    return np.abs(ratio - 1.0).max(), len(ways) == 1


def peers(name):
    """Answer the lines of the others, if they were measured on this pair."""
    labels = ("FabricBTDF-Recovery", "Lambert")
    return [
        f"{name:8} {label:19} {_pair(errors)}"
        for label, errors in zip(labels, PEERS.get(name, ()), strict=False)
    ]


def _pair(errors):
    return " ".join(f"{e:7.3f}" for e in errors)


def main(names):
    """Print the table."""
    print("pair     fitted to             front    back    time  colour lines geometry", flush=True)
    for name in names or pc.datasets.photo_pairs():
        for fitted_to, seeds in FITS:
            for seed in seeds:
                print(row(name, fitted_to, seed), flush=True)
        for line in peers(name):
            print(line, flush=True)


if __name__ == "__main__":
    main(sys.argv[1:])
