"""EXR and Radiance pictures as other programs write them."""

import struct

import numpy as np
import plycloth as pc
import pytest
from exr_file import attribute, exr
from plycloth import datasets

# SMPTE ST 2065-1, and its matrix to Rec. 709 as the ACES project prints it (Bradford).
ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.0770, 0.32168, 0.33767)
ACES_TO_REC_709 = [
    [2.52169, -1.13413, -0.38756],
    [-0.27648, 1.37272, -0.09624],
    [-0.01538, -0.15298, 1.16835],
]


def rgb(prefix="", factor=1.0):
    values = zip("RGB", ([1.0, 0.5], [2.0, 0.25], [3.0, 0.125]), strict=True)
    return {f"{prefix}{name}": [factor * value for value in row] for name, row in values}


PIXELS = np.array([[[1, 2, 3], [0.5, 0.25, 0.125]]])


def saved(tmp_path, channels, attributes=b""):
    (tmp_path / "a.exr").write_bytes(exr(channels, attributes))
    return tmp_path / "a.exr"


def test_layers_are_read_by_name_or_the_first_with_colour(tmp_path):
    depth = {"ViewLayer.Depth.Z": [9.0, 9.0], "Normal.X": [1.0] * 2}
    normal = {"Normal.Y": [1.0] * 2, "Normal.Z": [1.0] * 2}
    file = saved(tmp_path, rgb("ViewLayer.Combined.") | depth | normal)
    assert (pc.read_image(file).pixels == PIXELS).all()
    assert (pc.read_image(file, layer="ViewLayer.Combined").pixels == PIXELS).all()
    with pytest.raises(pc.ImageError, match=r"a\.exr: channels: .* in 'ViewLayer\.Depth' \(Z\)"):
        pc.read_image(file, layer="ViewLayer.Depth")
    with pytest.raises(pc.ImageError, match=r"layer: is 'Beauty', .*'ViewLayer\.Combined' \(B, G"):
        pc.read_image(file, layer="Beauty")


def test_a_choice_among_layers_is_said(tmp_path):
    file = saved(tmp_path, rgb("AO.") | rgb("Diffuse.", 2))
    with pytest.warns(pc.ImageWarning, match=r"a\.exr: the layer 'AO' is read; .* 'Diffuse'"):
        assert (pc.read_image(file).pixels == PIXELS).all()
    assert (pc.read_image(file, layer="Diffuse").pixels == 2 * PIXELS).all()
    # Channels without a prefix are the picture itself.
    file = saved(tmp_path, rgb("AO.", 3) | rgb())
    assert (pc.read_image(file).pixels == PIXELS).all()


@pytest.mark.parametrize("channels", [["Z"], ["N.X", "N.Y", "N.Z"], ["R", "G"], ["RY", "Y"]])
def test_what_is_no_colour_is_never_grey(tmp_path, channels):
    file = saved(tmp_path, {name: [0.5, 0.5] for name in channels})
    with pytest.raises(pc.ImageError, match=r"a\.exr: channels: has no colours"):
        pc.read_image(file)


def test_chroma_of_fewer_samples_is_refused(tmp_path):
    channels = {"Y": [0.5] * 4, "RY": [0.1] * 2, "BY": [0.1] * 2}
    (tmp_path / "a.exr").write_bytes(exr(channels, sampling=2))
    with pytest.raises(pc.ImageError, match=r"a\.exr: .*subsampling"):
        pc.read_image(tmp_path / "a.exr")


def test_luminance_alone_is_grey(tmp_path):
    file = saved(tmp_path, {"Y": [0.5, 2.0]})
    assert pc.read_image(file).pixels.tolist() == [[[0.5] * 3, [2.0] * 3]]


def test_other_chromaticities_are_converted(tmp_path):
    aces = attribute("chromaticities", "chromaticities", struct.pack("<8f", *ACES))
    read = pc.read_image(saved(tmp_path, rgb(), aces)).pixels
    assert read == pytest.approx(PIXELS @ np.transpose(ACES_TO_REC_709), abs=1e-3)
    white = {name: [1.0] for name in "RGB"}
    assert pc.read_image(saved(tmp_path, white, aces)).pixels == pytest.approx(np.ones((1, 1, 3)))


def case(name):
    return datasets.path(f"cases/{name}")


@pytest.mark.data
@pytest.mark.parametrize("name", ["layer_prefix", "multipart_beauty_first", "nan_inf_neg"])
def test_layers_and_parts_hold_the_same_picture(name):
    one, other = (pc.read_image(case(f"{each}.exr")) for each in (name, "blender_multilayer"))
    same = one.pixels == other.pixels
    assert np.count_nonzero(~same) == (3 if name == "nan_inf_neg" else 0)


@pytest.mark.data
def test_layers_and_parts_have_names():
    for file, layer in (("blender_multilayer", "ViewLayer.Combined"), ("layer_prefix", "beauty")):
        assert pc.read_image(case(f"{file}.exr"), layer=layer) == pc.read_image(case(f"{file}.exr"))
    with pytest.raises(pc.ImageError, match=r"multipart_beauty_first\.exr: .*'depth' \(Z\)"):
        pc.read_image(case("multipart_beauty_first.exr"), layer="depth")


@pytest.mark.data
def test_a_real_file_with_the_primaries_of_aces():
    stored = pc.read_image(case("layer_prefix.exr")).pixels
    read = pc.read_image(case("chromaticities_aces.exr")).pixels
    assert read == pytest.approx(stored @ np.transpose(ACES_TO_REC_709), abs=3e-3)


def as_mitsuba_has_it(file):
    mi = pytest.importorskip("mitsuba")
    mi.set_variant("scalar_rgb")
    return np.array(mi.Bitmap(str(file)))[:, :, :3].astype(np.float32)


@pytest.mark.data
@pytest.mark.parametrize("name", ["yryby.exr", "sky.hdr"])
def test_other_encodings_read_as_another_reader_has_them(name):
    assert pc.read_image(case(name)).pixels == pytest.approx(
        as_mitsuba_has_it(case(name)), rel=1e-4, abs=1e-5
    )


@pytest.mark.data
@pytest.mark.parametrize("name", ["forest", "studio"])
def test_environment_maps_read_as_another_reader_has_them(name):
    ours = pc.read_image(datasets.hdri(name)).pixels
    theirs = as_mitsuba_has_it(datasets.hdri(name))
    assert ours.shape == (256, 512, 3)
    # The file holds half floats; the two inverse cosine transforms may round a few of them apart.
    step = np.spacing(np.abs(theirs).astype(np.float16)).astype(np.float32)
    assert (np.abs(ours - theirs) <= 2 * step).all()
    assert np.count_nonzero(ours != theirs) < 10
