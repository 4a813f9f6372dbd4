"""Ply curves: as long as the swatch, and where the renders have the plies."""

import numpy as np
import plycloth as pc
import pytest
from samples import plain_fabric

# Whether its yarns fit side by side is all the same to a curve.
pytestmark = pytest.mark.filterwarnings("ignore::plycloth.OverlapWarning")

WHITE = pc.DiffuseBsdf(1.0)


def open_fabric(yarn, **changes):
    given = {"warp_spacing_mm": 0.5, "weft_spacing_mm": 0.6}
    return plain_fabric(warp=yarn, weft=yarn, **(given | changes))


def covered(swatch, pixels, width_mm):
    """Which pixels of a view from above lie on a ply, as its curve and width have it."""
    places = (np.arange(pixels) + 0.5) / pixels * width_mm - 0.5 * width_mm
    x, y = np.meshgrid(places, -places)
    inside = np.zeros((pixels, pixels), bool)
    for name, across in (("warp", 0), ("weft", 1)):
        curves = pc.ply_curves(swatch, name)
        here, along = (x, y) if across == 0 else (y, x)
        for points in curves.points.reshape(-1, *curves.points.shape[2:]):
            center = np.interp(along, points[:, 1 - across], points[:, across])
            inside |= np.abs(here - center) < curves.radii_mm[0]
    half = 0.5 * np.asarray(swatch.extent_mm)
    return inside & (np.abs(x) < half[0]) & (np.abs(y) < half[1])


@pytest.mark.parametrize(
    "yarn",
    [
        pc.RoundYarn(0.1, WHITE, plies=1),
        pc.RoundYarn(0.2, WHITE, plies=2, pitch_mm=-4.8),
        pc.RoundYarn(0.2, WHITE, plies=2, pitch_mm=4.8, thickness_mm=0.2),
        pc.FlatYarn(0.2, WHITE, thickness_mm=0.05),
    ],
    ids=["one ply", "two plies", "pressed", "flat"],
)
@pytest.mark.parametrize("size", [None, (2.2, 1.7)], ids=["repeat", "cut"])
def test_curves_are_where_the_picture_has_plies(yarn, size):
    swatch = pc.Swatch(open_fabric(yarn), size)
    pixels, width = 96, 1.1 * max(swatch.extent_mm)
    camera = pc.OrthographicCamera((0, 0, 9), (0, 0, 0), (0, 1, 0), width, (pixels, pixels))
    # Depth 1 shows lights alone: cloth is black before a bright ground.
    scene = pc.Scene(swatch, camera, [pc.ConstantLight(1.0)])
    bright = pc.render(scene, spp=16, max_depth=1, progress=False).pixels[..., 0]
    cloth, ours = bright < 0.5, covered(swatch, pixels, width)
    assert 0.2 < cloth.mean() < 0.9
    # Edges of a pixel's width: about one in fifty lies on one.
    assert (cloth != ours).mean() < 0.02


def test_a_swatch_of_whole_repeats_has_all_its_yarns():
    fabric = open_fabric(pc.RoundYarn(0.15, WHITE, plies=3))
    curves = pc.ply_curves(pc.Swatch(fabric, (4.0, 3.6)), "warp")
    assert curves.points.shape[:2] == (8, 3)
    assert curves.points.shape[3] == 3
    x, y, z = np.moveaxis(curves.points, -1, 0)
    np.testing.assert_allclose(x.mean(axis=(1, 2)), np.arange(-1.75, 2, 0.5), atol=0.02)
    np.testing.assert_allclose(y[..., [0, -1]].mean(axis=(0, 1)), (-1.8, 1.8), atol=0.01)
    assert np.abs(z).max() < 0.5
    radius = fabric.warp.ply_radius
    assert curves.radii_mm == (radius, radius)


def test_a_round_yarn_keeps_its_distance_from_the_others():
    """Relaxed yarns touch at their crossings: by their radii, the distance of the two curves."""
    swatch = pc.Swatch(open_fabric(pc.RoundYarn(0.1, WHITE, plies=1)))
    warp, weft = (pc.ply_curves(swatch, name).points.reshape(-1, 3) for name in ("warp", "weft"))
    nearest = np.linalg.norm(warp[:, None] - weft, axis=-1).min()
    assert nearest == pytest.approx(0.2, rel=0.05)


def test_pressed_plies_are_wider_than_high():
    yarn = pc.RoundYarn(0.2, WHITE, plies=2, thickness_mm=0.1)
    across, up = pc.ply_curves(pc.Swatch(open_fabric(yarn)), "weft").radii_mm
    assert across == yarn.ply_radius
    assert up == pytest.approx(0.25 * across)


def test_wrong_arguments_are_named():
    swatch = pc.Swatch(plain_fabric())
    with pytest.raises(pc.ParameterError, match="yarns must be one of 'warp', 'weft'"):
        pc.ply_curves(swatch, "both")
    with pytest.raises(TypeError, match="swatch must be a Swatch"):
        pc.ply_curves(plain_fabric(), "warp")
