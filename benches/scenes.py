"""The cloth that is measured: a plain weave of three-ply yarns under a constant sky."""

from pathlib import Path

import plycloth as pc
from plycloth.mitsuba import write_curves

COLOR = (0.6, 0.5, 0.4)
FOV = 37.0
DISTANCE = 1.5  # of the camera, in widths of the cloth, which then fills the picture
BSDFS = {"diffuse": pc.DiffuseBsdf(COLOR), "ply": pc.PlyBsdf(base_color=COLOR)}
YARN = pc.RoundYarn(0.4, BSDFS["diffuse"], plies=3, pitch_mm=4.0)


def weave(yarns: int, bsdf: str, size: int) -> pc.Scene:
    """A swatch of yarns x yarns that fills a square picture of `size` pixels across."""
    yarn = pc.RoundYarn(YARN.radius_mm, BSDFS[bsdf], plies=YARN.plies, pitch_mm=YARN.pitch_mm)
    fabric = pc.Fabric(pc.WeavePattern.plain(), yarn, yarn, 1.0, 1.0)
    width = float(yarns)
    camera = pc.PerspectiveCamera(
        (0, 0, DISTANCE * width), (0, 0, 0), fov=FOV, resolution=(size, size)
    )
    return pc.Scene(pc.Swatch(fabric, width), camera, [pc.ConstantLight(1.0)])


def write_weave(yarns: int, folder: Path) -> None:
    """Write the plies of the same cloth for Mitsuba: warp.txt and weft.txt."""
    swatch = weave(yarns, "diffuse", 1).swatch
    for name in ("warp", "weft"):
        points = pc.ply_curves(swatch, name).points
        write_curves(folder / f"{name}.txt", points.reshape(-1, *points.shape[2:]), YARN.ply_radius)
