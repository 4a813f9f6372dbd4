import io
import sys
import zlib

import numpy as np
import plycloth as pc
import pytest
from icc import grey_profile, ink_profile, profile
from PIL import Image as PilImage
from PIL import ImageCms
from PIL.PngImagePlugin import PngInfo
from plycloth import datasets
from plycloth._color import decode, encode

RNG = np.random.default_rng(5)
CODES = RNG.integers(0, 256, (6, 9, 3), np.uint8)


def chunk(kind, body):
    return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")


def png_of_16_bits(codes, icc=None):
    height, width, channels = codes.shape
    kind = {1: 0, 3: 2, 4: 6}[channels]
    head = width.to_bytes(4, "big") + height.to_bytes(4, "big") + bytes([16, kind, 0, 0, 0])
    rows = b"".join(b"\0" + row.astype(">u2").tobytes() for row in codes)
    named = b"" if icc is None else chunk(b"iCCP", b"icc\0\0" + zlib.compress(icc))
    body = named + chunk(b"IDAT", zlib.compress(rows))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + body + chunk(b"IEND", b"")


def tiff(samples, sample_format=1, orientation=1, icc=None):
    """A TIFF of one strip, uncompressed, as TIFF 6.0 lays it out."""
    height, width, channels = samples.shape
    data = samples.astype(samples.dtype.newbyteorder("<")).tobytes()
    bits = 8 * samples.dtype.itemsize
    entries = {
        256: (3, [width]),
        257: (3, [height]),
        258: (3, [bits] * channels),
        259: (3, [1]),
        262: (3, [2 if channels >= 3 else 1]),
        273: (4, [0]),
        274: (3, [orientation]),
        277: (3, [channels]),
        278: (3, [height]),
        279: (4, [len(data)]),
        339: (3, [sample_format] * channels),
    }
    if icc is not None:
        entries[34675] = (7, list(icc))
    size, types = {3: 2, 4: 4, 7: 1}, {3: "<u2", 4: "<u4", 7: "u1"}
    offset = 8 + 2 + 12 * len(entries) + 4
    lengths = {tag: size[kind] * len(values) for tag, (kind, values) in entries.items()}
    entries[273] = (4, [offset + sum(n + n % 2 for n in lengths.values() if n > 4)])
    table, extra = len(entries).to_bytes(2, "little"), b""
    for tag, (kind, values) in entries.items():
        body = np.array(values).astype(types[kind]).tobytes()
        if len(body) > 4:
            body, place = b"", (offset + len(extra)).to_bytes(4, "little")
            content = np.array(values).astype(types[kind]).tobytes()
            extra += content + bytes(len(content) % 2)
        else:
            place = body.ljust(4, b"\0")
        table += tag.to_bytes(2, "little") + kind.to_bytes(2, "little")
        table += len(values).to_bytes(4, "little") + place
    return b"II*\0" + (8).to_bytes(4, "little") + table + bytes(4) + extra + data


@pytest.mark.parametrize("mode", ["L", "P", "RGBA", "LA", "1", "CMYK"])
def test_other_modes_read_as_rgb(tmp_path, mode):
    grey = PilImage.fromarray(np.full((4, 4), 255, dtype=np.uint8))
    file = tmp_path / ("a.tif" if mode == "CMYK" else "a.png")
    grey.convert("RGB").convert(mode).save(file)
    assert np.asarray(pc.read_image(file)) == pytest.approx(np.ones((4, 4, 3)))


@pytest.mark.parametrize("suffix", [".tif", ".tiff", ".webp"])
def test_other_lossless_files_read_as_a_png_does(tmp_path, suffix):
    PilImage.fromarray(CODES).save(tmp_path / "a.png")
    PilImage.fromarray(CODES).save(tmp_path / f"a{suffix}", lossless=True)
    for gamma in (None, 2.2):
        read = pc.read_image(tmp_path / f"a{suffix}", gamma)
        assert read == pc.read_image(tmp_path / "a.png", gamma)
        assert read.pixels == pytest.approx(decode(CODES / 255, gamma), abs=1e-7)


@pytest.mark.parametrize("channels", [1, 3, 4])
@pytest.mark.parametrize(("suffix", "file"), [(".png", png_of_16_bits), (".tif", tiff)])
def test_16_bits_keep_their_precision(tmp_path, suffix, file, channels):
    codes = RNG.integers(0, 65536, (4, 5, channels), np.uint16)
    codes[0, 0] = 257
    codes[0, 1] = 258
    (tmp_path / f"a{suffix}").write_bytes(file(codes))
    read = pc.read_image(tmp_path / f"a{suffix}", gamma=1.0).pixels
    shown = np.broadcast_to(codes[:, :, :3], (4, 5, 3))
    assert read == pytest.approx(shown / 65535, abs=1e-7)


def test_16_bits_follow_the_srgb_curve(tmp_path):
    codes = np.array([[[30, 3000, 40000]]], np.uint16)
    (tmp_path / "a.png").write_bytes(png_of_16_bits(codes))
    assert pc.read_image(tmp_path / "a.png").pixels == pytest.approx(decode(codes / 65535))


@pytest.mark.parametrize(("exponent", "gamma"), [(1.0, 1.0), (0.55556, 1.8), (0.45455, None)])
def test_a_png_may_name_its_gamma(tmp_path, exponent, gamma):
    named = PngInfo()
    named.add(b"gAMA", round(exponent * 100_000).to_bytes(4, "big"))
    PilImage.fromarray(CODES).save(tmp_path / "a.png", pnginfo=named)
    read = pc.read_image(tmp_path / "a.png").pixels
    assert read == pytest.approx(decode(CODES / 255, gamma), abs=1e-4)
    asked = pc.read_image(tmp_path / "a.png", gamma=2.2).pixels
    assert asked == pytest.approx(decode(CODES / 255, 2.2), abs=1e-6)


def test_a_tiff_of_floats_is_linear(tmp_path):
    light = np.array([[[-0.5, 0.25, 70.0]]], np.float32)
    (tmp_path / "a.tif").write_bytes(tiff(light, sample_format=3))
    assert (pc.read_image(tmp_path / "a.tif").pixels == light).all()
    with pytest.raises(ValueError, match="a TIFF of floats holds linear light"):
        pc.read_image(tmp_path / "a.tif", gamma=2.2)


def test_a_grey_tiff_of_floats_is_linear(tmp_path):
    light = np.array([[-0.5, 0.25, 70.0]], np.float32)
    PilImage.fromarray(light).save(tmp_path / "a.tif")
    assert (pc.read_image(tmp_path / "a.tif").pixels == light[..., None]).all()


def test_a_rotated_photograph_is_turned_upright(tmp_path):
    picture = PilImage.new("RGB", (16, 8))
    exif = picture.getexif()
    exif[0x0112] = 6
    picture.save(tmp_path / "a.jpg", exif=exif)
    assert pc.read_image(tmp_path / "a.jpg").pixels.shape == (16, 8, 3)


def test_a_rotated_tiff_of_16_bits_is_turned_upright(tmp_path):
    codes = np.zeros((2, 3, 3), np.uint16)
    codes[0, 0] = 65535
    (tmp_path / "a.tif").write_bytes(tiff(codes, orientation=6))
    read = pc.read_image(tmp_path / "a.tif").pixels
    # What is stored at the top left is shown at the top right.
    assert read.shape == (3, 2, 3)
    assert read[0, 1].tolist() == [1, 1, 1]
    assert read.sum() == 3


def as_littlecms_has_it(codes, icc):
    """Light of codes with a profile, by another colour management."""
    picture, own = PilImage.fromarray(codes), ImageCms.ImageCmsProfile(io.BytesIO(icc))
    return np.asarray(ImageCms.profileToProfile(picture, own, ImageCms.createProfile("sRGB"))) / 255


@pytest.mark.parametrize("suffix", [".png", ".tif", ".jpg", ".webp"])
def test_a_profile_is_applied(tmp_path, suffix):
    file = tmp_path / f"a{suffix}"
    flat = np.broadcast_to(np.array([180, 90, 60], np.uint8), (16, 16, 3))
    PilImage.fromarray(flat).save(file, icc_profile=profile(), quality=100, lossless=True)
    expected = as_littlecms_has_it(flat, profile())
    # JPEG may be a code off, and each side is rounded to half of one.
    assert encode(pc.read_image(file).pixels) == pytest.approx(expected, abs=2.1 / 255)
    assert np.abs(expected - flat / 255).max() > 15 / 255
    gamma = pc.read_image(file, gamma=2.2).pixels
    assert gamma ** (1 / 2.2) == pytest.approx(expected, abs=2.1 / 255)


def test_a_profile_moves_every_colour_as_littlecms_does(tmp_path):
    PilImage.fromarray(CODES).save(tmp_path / "a.png", icc_profile=profile())
    read = encode(pc.read_image(tmp_path / "a.png").pixels)
    assert read == pytest.approx(as_littlecms_has_it(CODES, profile()), abs=1.01 / 255)


@pytest.mark.parametrize(("suffix", "file"), [(".png", png_of_16_bits), (".tif", tiff)])
def test_a_profile_is_applied_to_16_bits(tmp_path, suffix, file):
    PilImage.fromarray(CODES).save(tmp_path / "eight.png", icc_profile=profile())
    codes = CODES.astype(np.uint16) * 257
    (tmp_path / f"a{suffix}").write_bytes(file(codes, icc=profile()))
    read = pc.read_image(tmp_path / f"a{suffix}").pixels
    assert read == pytest.approx(pc.read_image(tmp_path / "eight.png").pixels, abs=1e-6)
    # One code of 16 bits more is not lost on the way.
    (tmp_path / f"a{suffix}").write_bytes(
        file(np.array([[[40, 40, 40], [41, 41, 41]]], np.uint16), icc=profile())
    )
    dark = pc.read_image(tmp_path / f"a{suffix}").pixels
    assert (dark[0, 1] > dark[0, 0]).all()


def test_grey_has_a_profile_too(tmp_path):
    grey = PilImage.fromarray(np.full((2, 2), 128, np.uint8))
    grey.save(tmp_path / "a.png", icc_profile=grey_profile(1.0))
    assert pc.read_image(tmp_path / "a.png").pixels == pytest.approx(
        np.full((2, 2, 3), 128 / 255), abs=2e-3
    )


def test_inks_have_a_profile_too(tmp_path):
    inks = PilImage.fromarray(RNG.integers(0, 256, (8, 8, 4), np.uint8), mode="CMYK")
    inks.save(tmp_path / "a.tif", icc_profile=ink_profile())
    own = ImageCms.ImageCmsProfile(io.BytesIO(ink_profile()))
    srgb = ImageCms.createProfile("sRGB")
    expected = ImageCms.profileToProfile(inks, own, srgb, outputMode="RGB")
    read = encode(pc.read_image(tmp_path / "a.tif").pixels)
    assert read == pytest.approx(np.asarray(expected) / 255, abs=1e-6)
    inks.save(tmp_path / "a.tif", icc_profile=profile())
    with pytest.warns(pc.ImageWarning, match=r"a\.tif: its colour profile is of no use"):
        pc.read_image(tmp_path / "a.tif")


@pytest.mark.parametrize("icc", [b"no profile at all", grey_profile(1.0)])
def test_a_profile_of_no_use_warns(tmp_path, icc):
    PilImage.fromarray(CODES).save(tmp_path / "a.png", icc_profile=icc)
    with pytest.warns(
        pc.ImageWarning, match=r"a\.png: its colour profile is of no use .*: profile"
    ):
        read = pc.read_image(tmp_path / "a.png")
    assert read.pixels == pytest.approx(decode(CODES / 255), abs=1e-7)


def test_heic_says_what_it_needs(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pillow_heif", None)
    (tmp_path / "a.heic").write_bytes(bytes(100))
    with pytest.raises(pc.ImageError, match=r"a\.heic: to read HEIC, install .*pillow-heif"):
        pc.read_image(tmp_path / "a.heic")


def test_heic_is_read_where_pillow_heif_is_installed(tmp_path):
    heif = pytest.importorskip("pillow_heif")
    heif.register_heif_opener()
    flat = np.broadcast_to(np.array([180, 90, 60], np.uint8), (64, 64, 3))
    PilImage.fromarray(flat).save(tmp_path / "a.heic", quality=100)
    read = encode(pc.read_image(tmp_path / "a.heic").pixels)
    assert read == pytest.approx(flat / 255, abs=3 / 255)


def test_a_photograph_has_a_gamma_unless_it_is_linear(tmp_path):
    from plycloth.image_read import read_photograph

    picture = pc.Image(np.full((2, 2, 3), 0.25))
    picture.save(tmp_path / "a.png", gamma=2.2)
    picture.save(tmp_path / "a.exr")
    (tmp_path / "a.tif").write_bytes(tiff(picture.pixels, sample_format=3))
    for name in ("a.png", "a.exr", "a.tif"):
        read = read_photograph(tmp_path / name, 2.2).pixels
        assert read == pytest.approx(picture.pixels, abs=2e-3)


def test_layers_are_for_exr(tmp_path):
    pc.Image(np.zeros((2, 2, 3))).save(tmp_path / "a.png")
    with pytest.raises(pc.ImageError, match=r"a\.png: has no layers"):
        pc.read_image(tmp_path / "a.png", layer="beauty")
    with pytest.raises(TypeError, match="layer must be a str"):
        pc.read_image(tmp_path / "a.exr", layer=5)


@pytest.mark.data
def test_a_red_of_display_p3():
    file = datasets.path("cases/p3.png")
    with PilImage.open(file) as stored:
        codes = np.asarray(stored)
        expected = as_littlecms_has_it(codes, stored.info["icc_profile"])
    assert np.abs(expected - codes / 255).max() > 10 / 255
    assert encode(pc.read_image(file).pixels) == pytest.approx(expected, abs=1.01 / 255)


@pytest.mark.data
def test_16_bits_of_a_real_file():
    read = pc.read_image(datasets.path("cases/rgb16.png"), gamma=1.0).pixels * 65535
    assert read == pytest.approx(read.round(), abs=0.01)
    assert len(np.unique(read.round())) > 256
