"""Pictures keep their bits from version to version, unless a change means to change them.

The hashes are of pictures made on Linux, x86-64: other mathematical libraries round otherwise.
``python tests/test_bits.py`` prints those of now.
"""

import hashlib
import platform
import sys

import numpy as np
import plycloth as pc
import pytest

ROUND = pc.RoundYarn(0.07, pc.PlyBsdf(extinction=20.0), plies=3)
PRESSED = pc.RoundYarn(0.08, pc.PlyBsdf(base_color=(0.7, 0.3, 0.2)), plies=2, thickness_mm=0.1)
FLAT = pc.FlatYarn(0.17, pc.PlyBsdf(roughness=(0.1, 0.4)))
DULL = pc.RoundYarn(0.06, pc.DiffuseBsdf((0.6, 0.5, 0.4)), plies=1)
SUN = pc.DirectionalLight((0.4, 0.3, -1.0), 2.0)
BEHIND = pc.PointLight((0.5, -1.0, -3.0), 20.0)
PANEL = pc.RectangleLight((1.0, 1.0, 3.0), (1.0, 0.0, 0.0), (0.0, -1.0, 0.0), 4.0)
SKY = pc.ConstantLight((0.5, 0.6, 0.8))
MAP = pc.EnvironmentLight(np.linspace(0.0, 2.0, 4 * 8 * 3).reshape(4, 8, 3), rotation=30.0)
ABOVE = pc.OrthographicCamera((0.0, 0.0, 5.0), (0.0, 0.0, 0.0), width_mm=1.2, resolution=(24, 16))
ASIDE = pc.PerspectiveCamera((0.5, -1.5, 2.0), (0.0, 0.0, 0.0), fov=35.0, resolution=(24, 16))


def woven(warp, weft, pattern=None, **given):
    pattern = pc.WeavePattern.twill(2, 1) if pattern is None else pattern
    return pc.Fabric(pattern, warp, weft, 0.2, 0.21, **given)


def scene(fabric, *lights, camera=ABOVE, size_mm=1.0, background=None):
    return pc.Scene(pc.Swatch(fabric, size_mm), camera, lights, background)


DYED = woven(ROUND, ROUND, warp_colors=np.eye(3), weft_colors=np.full((3, 3), 0.8))
EACH = woven([ROUND, FLAT, ROUND], ROUND)
JACQUARD = woven(ROUND, DULL, pc.WeavePattern(np.random.default_rng(5).random((40, 40)) < 0.5))

# A scene each, and whether light is looked for on both sides.
SCENES = {
    "round, sun": (scene(woven(ROUND, ROUND), SUN), False),
    "round, lamp behind": (scene(woven(ROUND, ROUND), BEHIND), False),
    "round, lamp behind, both sides": (scene(woven(ROUND, ROUND), BEHIND, SKY), True),
    "pressed, panel": (scene(woven(PRESSED, PRESSED), PANEL), False),
    "flat, sun and sky": (scene(woven(FLAT, FLAT), SUN, SKY), False),
    "flat, lamp behind": (scene(woven(FLAT, FLAT), BEHIND), True),
    "flat and round, map": (scene(woven(FLAT, ROUND), MAP, camera=ASIDE), False),
    "diffuse, sky": (scene(woven(DULL, DULL), SKY, background=0.1), False),
    "dyed, sun and map": (scene(DYED, SUN, MAP, camera=ASIDE), False),
    "a yarn for each thread": (scene(EACH, SUN, BEHIND, size_mm=(1.1, 0.7)), False),
    "cut edge, seen aside": (scene(woven(ROUND, FLAT), SKY, camera=ASIDE, size_mm=0.45), False),
    "random pattern": (scene(JACQUARD, SUN, SKY, size_mm=8.0), False),
}

HASHES = {
    "round, sun": "305b906a31256938",
    "round, lamp behind": "22b41182aca80a9b",
    "round, lamp behind, both sides": "abe21f3eb2e4aeb3",
    "pressed, panel": "87f7014900925270",
    "flat, sun and sky": "f8082d89ac88ae08",
    "flat, lamp behind": "7e0e707f3cfb3f92",
    "flat and round, map": "70581a9e444134e9",
    "diffuse, sky": "4b80c9f91d7a46ce",
    "dyed, sun and map": "21ea436a30984d89",
    "a yarn for each thread": "206649c900b16851",
    "cut edge, seen aside": "2f5fa22e510ecef6",
    "random pattern": "65f4560abe93edcb",
}


def digest(name):
    shown, both_sides = SCENES[name]
    image = pc.render(shown, spp=4, seed=7, both_sides=both_sides, progress=False)
    return hashlib.sha256(image.pixels.tobytes()).hexdigest()[:16]


@pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")
@pytest.mark.skipif(
    (sys.platform, platform.machine()) != ("linux", "x86_64"), reason="other roundings"
)
@pytest.mark.parametrize("name", SCENES)
def test_pictures_keep_their_bits(name):
    assert digest(name) == HASHES[name]


if __name__ == "__main__":
    for name in SCENES:
        print(f'    "{name}": "{digest(name)}",')
