"""How much light comes through where plies touch: `python -m benches.touching`.

First, the share of light that leaks through an opaque black weft below a clear warp, lit from
below: over those pixels of a crossing's square, seen from above, behind which lies the weft.
Nothing should come through; what little does has grazed the weft's rim, as the warp bends light by
a little. Yarns keep the radius and the soft contact (collision_stiffness 1) that let them overlap.

Then what a crossing of a plain weave in the default colours lets through of light from below, with
plies that touch and with plies a tenth thinner, which clear each other. Takes half a minute on 2
cores.
"""

import warnings
from dataclasses import replace

import numpy as np
import plycloth as pc

RADII = (0.1, 0.2, 0.3, 0.4, 0.5)
PLIES = (1, 2, 3, 6, 12)
SMOOTH = (0.002, 0.002)
CLEAR = pc.PlyBsdf(
    eta=1.01,
    base_color=0,
    transmitted_color=0,
    extinction=0.0,
    roughness=SMOOTH,
    exit_roughness=SMOOTH,
)
BLACK = replace(CLEAR, eta=1.5, specular_tint=0, transmission_tint=0, extinction=1e5)
# A floor of light, so large that all that goes down meets it.
LAMP = pc.RectangleLight((0, 0, -20), (4000, 0, 0), (0, 4000, 0), 1.0)


def yarn(kind, radius, plies, bsdf):
    """A yarn of that radius, or a ribbon as wide."""
    if kind == "flat":
        return pc.FlatYarn(2.0 * radius, bsdf)
    return pc.RoundYarn(radius, bsdf, plies=plies)


def crossing(warp, weft, width, light, *, below=False):
    """A crossing's square of that width, warp on top, seen from above or from below."""
    fabric = pc.Fabric(pc.WeavePattern.plain(), warp, weft, 1.0, 1.0, collision_stiffness=1.0)
    pick, end = np.argwhere(fabric.pattern.warp_up)[0]
    x, y = end - 1.5, 1.5 - pick
    height = -5.0 if below else 5.0
    camera = pc.OrthographicCamera((x, y, height), (x, y, 0), (0, 1, 0), width, (64, 64))
    scene = pc.Scene(pc.Swatch(fabric, 8.0), camera, [light])
    pixels = np.asarray(pc.render(scene, spp=16, progress=False))[..., 1]
    return pixels[:, ::-1] if below else pixels


def leak(kinds, radius, plies):
    """The mean light that comes up where the weft lies below."""
    top, bottom = kinds

    def pair(warp_bsdf, weft_bsdf):
        return yarn(top, radius, plies, warp_bsdf), yarn(bottom, radius, plies, weft_bsdf)

    light = crossing(*pair(CLEAR, BLACK), 2.0 * radius, LAMP)
    white = pair(pc.DiffuseBsdf(0.0), pc.DiffuseBsdf(1.0))
    shown = crossing(*white, 2.0 * radius, pc.DirectionalLight((0, 0, 1), 3.0), below=True) > 0.15
    # Pixels that the weft fills, not those on its rim.
    inner = shown.copy()
    for axis in (0, 1):
        for step in (-1, 1):
            inner &= np.roll(shown, step, axis)
    inner[[0, -1]] = inner[:, [0, -1]] = False
    return float(light[inner].mean())


def backlit(extinction, ply_radius, width):
    """What a square of a crossing lets through."""
    ply = pc.RoundYarn(0.25, pc.PlyBsdf(extinction=extinction), plies=1, ply_radius_mm=ply_radius)
    return float(crossing(ply, ply, width, LAMP).mean())


def main():
    """Print the tables."""
    warnings.simplefilter("ignore", pc.OverlapWarning)
    print("light through an opaque weft below a clear warp, by radius / spacing")
    for kinds in (("round", "round"), ("round", "flat"), ("flat", "round"), ("flat", "flat")):
        for plies in PLIES if kinds == ("round", "round") else (1, 3) if "round" in kinds else (1,):
            row = " ".join(f"{leak(kinds, radius, plies):7.2%}" for radius in RADII)
            print(f"{kinds[0]:5} over {kinds[1]:5} {plies:2} plies {row}", flush=True)
    print("a backlit crossing at extinctions of 3, 10 and 30 per mm: centre; whole square")
    for name, radius in (("touching", 0.25), ("a tenth thinner", 0.225)):
        for width in (0.02, 0.5):
            row = " ".join(
                f"{backlit(extinction, radius, width):.3f}" for extinction in (3, 10, 30)
            )
            print(f"{name:16} {width:5} mm {row}", flush=True)


if __name__ == "__main__":
    main()
