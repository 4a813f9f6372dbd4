"""Cloths and pictures beside each other."""

import numpy as np
import plycloth as pc
import pytest
from plycloth.beside import side_by_side
from plycloth.compare import subject
from samples import plain_fabric

QUICK = {"spp": 1, "progress": False}


def flat(color, height=12, width=12):
    return pc.Image(np.broadcast_to(np.float32(color), (height, width, 3)))


def test_pictures_stand_in_their_order_at_one_height_on_white():
    image = side_by_side([("a", flat((1, 0, 0))), ("b", flat((0, 0, 1), 24, 12))], 48)
    assert image.height == 48 + 14
    left, right = image.pixels[:48, :48], image.pixels[:48, -24:]
    assert np.allclose(left, (1, 0, 0))
    assert np.allclose(right, (0, 0, 1), atol=1e-6)
    gap = image.pixels[:, 48:-24]
    assert gap.shape[1] == 2
    assert np.array_equal(gap, np.ones_like(gap))


def test_pictures_of_that_height_stay_as_they_are():
    picture = pc.Image(np.random.default_rng(1).random((16, 9, 3)))
    image = side_by_side([("a", picture)], 16)
    assert np.array_equal(image.pixels[:16], picture.pixels)


def test_labels_are_below_and_fit_in():
    def ink(label, width):
        strip = side_by_side([(label, flat(1, 64, width))], 64).pixels[64:]
        return np.argwhere(strip.min(2) < 0.5)

    assert len(ink("", 64)) == 0
    short = ink("ab", 64)
    assert abs(short[:, 1].mean() - 32) < 2
    # Cut to the picture, with an ellipsis at its end.
    long = ink("a name that is far too long", 64)
    assert np.ptp(long[:, 1]) > 40
    assert not np.array_equal(long, ink("a name that is far too long", 400))
    assert np.array_equal(ink("a\nb", 64), ink("a b", 64))
    # Letters of other languages have shapes of their own, no common box.
    assert not np.array_equal(ink("ж", 64), ink("λ", 64))


def test_cloths_are_rendered_alike():
    wide = plain_fabric(warp_spacing_mm=0.5, weft_spacing_mm=0.5)
    close = plain_fabric(warp_spacing_mm=0.25, weft_spacing_mm=0.25).fitted()
    picture = pc.compare([("wide", wide), ("close", close)], "overcast", height=32, **QUICK)
    # 16 yarns of the coarser one: 8 mm, of both.
    for fabric, pixels in ((wide, picture.pixels[:32, :32]), (close, picture.pixels[:32, -32:])):
        scene = pc.overview(fabric, "overcast", size_mm=8, width=32)
        assert np.array_equal(pixels, pc.render(scene, **QUICK).pixels)


def test_pieces_have_the_size_and_the_ground_that_are_named():
    cloth = plain_fabric()
    image = pc.compare([("a", cloth)], size_mm=(3, 2), height=20, ground=1.0, **QUICK)
    scene = pc.overview(cloth, size_mm=(3, 2), width=30, ground=1.0)
    assert np.array_equal(image.pixels[:20], pc.render(scene, **QUICK).pixels)


def test_subjects_are_drafts_fabrics_pictures_and_measured_yarns(tmp_path):
    draft = pc.Draft.from_pattern(pc.WeavePattern.twill(2, 2))
    pc.write_wif(draft, tmp_path / "a.wif")
    fabric = pc.Fabric.from_draft(draft)
    fabric.save(tmp_path / "a.json")
    flat(0.5).save(tmp_path / "a.exr")
    assert subject(str(tmp_path / "a.wif")) == fabric
    assert subject(str(tmp_path / "a.json")) == fabric
    assert subject(str(tmp_path / "a.exr")).pixels.shape == (12, 12, 3)
    cloth = subject("rayon1")
    assert cloth.warp.plies == pc.preset("rayon1").plies
    assert cloth.overlaps().count == 0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"subjects": []}, "at least one"),
        ({"subjects": [("a", "draft.wif")]}, "the subject 'a' must be a Fabric or Image"),
        ({"subjects": [plain_fabric()]}, "subjects must be pairs of a label and a fabric or"),
        ({"subjects": [(plain_fabric(), "a")]}, "subjects must be pairs"),
        ({"height": 4}, r"height must be in \[8, 65536\], not 4"),
        ({"size_mm": -1}, "size_mm"),
        ({"light": "dya"}, "a lighting must be one of"),
        ({"spp": 0}, "spp"),
    ],
)
def test_bad_input(given, message):
    with pytest.raises((ValueError, TypeError), match=message):
        pc.compare(**{"subjects": [("a", plain_fabric())], **QUICK, **given})
