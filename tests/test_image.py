import io

import numpy as np
import plycloth as pc
import pytest
from PIL import Image as PilImage
from plycloth import _plycloth
from plycloth._color import decode, encode


@pytest.fixture
def picture():
    rng = np.random.default_rng(3)
    return pc.Image(rng.uniform(0, 1, (7, 5, 3)), rng.uniform(0.01, 0.02, (7, 5, 3)))


def test_an_image_is_an_array(picture):
    assert np.asarray(picture).shape == (7, 5, 3)
    assert np.asarray(picture).dtype == np.float32
    assert np.asarray(picture) is picture.pixels
    assert np.asarray(picture, dtype=np.float64).dtype == np.float64
    assert (picture.width, picture.height) == (5, 7)


def test_copies_are_made_when_asked_for(picture):
    copy = np.array(picture, copy=True)
    copy[:] = 0
    assert picture.pixels.max() > 0
    with pytest.raises(ValueError, match="copy=False"):
        picture.__array__(np.float64, copy=False)


def test_pixels_are_owned_and_read_only():
    source = np.ones((2, 2, 3), dtype=np.float32)
    image = pc.Image(source)
    source[:] = 0
    assert image.pixels.min() == 1
    with pytest.raises(ValueError, match="read-only"):
        image.pixels[0, 0, 0] = 2


def test_images_compare_by_value(picture):
    assert picture == pc.Image(picture.pixels, picture.variance)
    assert picture != pc.Image(picture.pixels)
    assert picture != pc.Image(picture.pixels + 1, picture.variance)
    assert picture != "a picture"


@pytest.mark.parametrize("shape", [(4, 4), (4, 4, 4), (0, 4, 3), (1, 4, 4, 3)])
def test_wrong_shapes_are_refused(shape):
    with pytest.raises(ValueError, match="pixels: has the shape"):
        pc.Image(np.zeros(shape))


def test_a_variance_is_checked():
    with pytest.raises(ValueError, match="variance: has the shape"):
        pc.Image(np.zeros((2, 2, 3)), np.zeros((2, 3, 3)))
    with pytest.raises(ValueError, match="variance: 12 values"):
        pc.Image(np.zeros((2, 2, 3)), np.full((2, 2, 3), -1.0))


def test_the_srgb_curve_has_its_published_values():
    # IEC 61966-2-1: the mid grey 0.5 is 0.21404 of white, 0.04045 the end of the straight part.
    assert decode(np.array([0.0, 0.04045, 0.5, 1.0])) == pytest.approx(
        [0, 0.0031308, 0.2140411, 1], abs=1e-7
    )
    codes = np.linspace(0, 1, 257)
    assert encode(decode(codes)) == pytest.approx(codes, abs=1e-6)
    assert encode(decode(codes, 2.2), 2.2) == pytest.approx(codes, abs=1e-12)


def test_exr_comes_back_bit_for_bit(tmp_path, picture):
    odd = picture.pixels.copy()
    odd[0, 0] = [np.nan, np.inf, -3]
    pc.Image(odd).save(tmp_path / "a.exr")
    assert pc.read_image(tmp_path / "a.exr") == pc.Image(odd)


@pytest.mark.parametrize("gamma", [None, 2.2])
def test_png_comes_back_to_half_a_code(tmp_path, picture, gamma):
    picture.save(tmp_path / "a.png", gamma=gamma)
    back = pc.read_image(tmp_path / "a.png", gamma=gamma)
    assert np.abs(encode(back.pixels, gamma) - encode(picture.pixels, gamma)).max() < 0.502 / 255


def test_png_clips_and_keeps_rows_and_channels(tmp_path):
    pixels = np.zeros((2, 3, 3))
    pixels[0, 2] = [5, 0, -1]
    pc.Image(pixels).save(str(tmp_path / "a.png"))
    stored = np.asarray(PilImage.open(tmp_path / "a.png"))
    assert stored[0, 2].tolist() == [255, 0, 0]
    assert stored.sum() == 255


def test_nan_in_a_png_is_refused_with_a_count(tmp_path):
    pixels = np.zeros((4, 4, 3))
    pixels[1, 1] = np.nan
    pixels[2, 3, 0] = np.nan
    image = pc.Image(pixels)
    with pytest.raises(pc.ImageError, match="2 of 16 are NaN"):
        image.save(tmp_path / "a.png")
    assert not (tmp_path / "a.png").exists()


def test_a_notebook_shows_nan_in_magenta():
    pixels = np.zeros((2, 2, 3))
    pixels[1, 0, 2] = np.nan
    shown = np.asarray(PilImage.open(io.BytesIO(pc.Image(pixels)._repr_png_())))
    assert shown[1, 0].tolist() == [255, 0, 255]
    assert shown[0].max() == 0


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".tif", ".webp", ".exr", ".hdr"])
def test_what_is_not_a_picture_is_an_error(tmp_path, suffix):
    (tmp_path / f"a{suffix}").write_bytes(b"not a picture at all")
    with pytest.raises(pc.ImageError, match=f"a{suffix}: "):
        pc.read_image(tmp_path / f"a{suffix}")
    with pytest.raises(FileNotFoundError):
        pc.read_image(tmp_path / f"gone{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(IsADirectoryError):
        pc.read_image(tmp_path / f"folder{suffix}")


def test_a_cut_file_is_an_error(tmp_path, picture):
    for suffix in (".png", ".exr"):
        file = tmp_path / f"a{suffix}"
        picture.save(file)
        file.write_bytes(file.read_bytes()[:-40])
        with pytest.raises(pc.ImageError):
            pc.read_image(file)


@pytest.mark.parametrize("name", ["a.exrr", "a.gif", "a.heic"])
def test_unknown_suffixes_come_with_those_there_are(picture, tmp_path, name):
    with pytest.raises(
        pc.ImageError, match=r"must be one of .exr, .png, .tif, .tiff, .jpg, .jpeg$"
    ):
        picture.save(tmp_path / name)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".tiff", ".jpg", ".jpeg"])
def test_a_resolution_is_noted_in_the_file(tmp_path, picture, suffix):
    picture.save(tmp_path / f"a{suffix}", dpi=300)
    with PilImage.open(tmp_path / f"a{suffix}") as stored:
        assert stored.info["dpi"] == pytest.approx((300, 300), abs=0.01)
    picture.save(tmp_path / f"b{suffix}")
    with PilImage.open(tmp_path / f"b{suffix}") as stored:
        # Of a TIFF without a resolution Pillow says that it is 1.
        assert stored.info.get("dpi", (1, 1)) == (1, 1)


def test_a_resolution_is_noted_in_an_exr(tmp_path, picture):
    picture.save(tmp_path / "a.exr", dpi=254.5)
    # OpenEXR, standard attributes: xDensity, a float of 4 bytes.
    assert (
        b"xDensity\0float\0\4\0\0\0" + np.float32(254.5).tobytes()
        in (tmp_path / "a.exr").read_bytes()
    )
    assert pc.read_image(tmp_path / "a.exr").pixels.tolist() == picture.pixels.tolist()


@pytest.mark.parametrize("dpi", [0, -1, 65536, np.nan, np.inf])
def test_resolutions_are_checked(tmp_path, picture, dpi):
    for name in ("a.png", "a.exr"):
        with pytest.raises(pc.ParameterError, match=r"dpi must be in \[1, 65535\]"):
            picture.save(tmp_path / name, dpi=dpi)
    assert not list(tmp_path.iterdir())


def test_tiff_is_written_without_loss_and_jpeg_with_little(tmp_path):
    # A yarn each two pixels wide: halved chroma would halve their colours.
    pixels = np.zeros((16, 16, 3))
    pixels[:, ::4, 0] = pixels[:, 1::4, 0] = 0.5
    pixels[:, 2::4, 2] = pixels[:, 3::4, 2] = 0.5
    picture = pc.Image(pixels)
    for name in ("a.png", "a.tif", "a.jpg"):
        picture.save(tmp_path / name)
    assert pc.read_image(tmp_path / "a.tif") == pc.read_image(tmp_path / "a.png")
    assert np.abs(pc.read_image(tmp_path / "a.jpg").pixels - pixels).max() < 0.06


def test_a_picture_too_large_for_its_format_is_an_error(tmp_path):
    with pytest.raises(pc.ImageError, match="70000 x 1 of them cannot be written as JPEG"):
        pc.Image(np.zeros((1, 70000, 3))).save(tmp_path / "a.jpg")
    assert not list(tmp_path.iterdir())


def test_gamma_is_checked(tmp_path, picture):
    picture.save(tmp_path / "a.exr")
    picture.save(tmp_path / "a.png")
    for gamma in (0.0, -1.0, np.nan):
        with pytest.raises(ValueError, match="gamma must be"):
            pc.read_image(tmp_path / "a.png", gamma=gamma)
    with pytest.raises(TypeError, match="gamma must be a number"):
        pc.read_image(tmp_path / "a.png", gamma="2.2")
    with pytest.raises(ValueError, match="EXR holds linear light"):
        pc.read_image(tmp_path / "a.exr", gamma=2.2)
    with pytest.raises(ValueError, match="EXR holds linear light"):
        picture.save(tmp_path / "b.exr", gamma=2.2)


def test_a_folder_that_does_not_exist_is_not_made(picture, tmp_path):
    with pytest.raises(FileNotFoundError):
        picture.save(tmp_path / "gone" / "a.exr")


def test_z_scores_are_standard_normal_for_equal_means():
    rng = np.random.default_rng(7)
    deviation = rng.uniform(0.1, 2, (64, 64, 3))
    one, two = (
        pc.Image(5 + deviation * scale * rng.standard_normal((64, 64, 3)), (deviation * scale) ** 2)
        for scale in (1.0, 0.5)
    )
    z = one.z_scores(two)
    # 12288 values: the mean is within 4 / sqrt(12288), the variance within 4 sqrt(2 / 12288).
    assert abs(z.mean()) < 0.036
    assert abs(z.var() - 1) < 0.051


def test_z_scores_without_noise():
    one = pc.Image(np.zeros((1, 2, 3)), np.zeros((1, 2, 3)))
    two = pc.Image([[[0, 0, 0], [1, -1, 0]]], np.zeros((1, 2, 3)))
    assert one.z_scores(two).tolist() == [[[0, 0, 0], [-np.inf, np.inf, 0]]]


def test_z_scores_need_two_variances_and_equal_sizes(picture):
    with pytest.raises(ValueError, match="variance: both"):
        picture.z_scores(pc.Image(picture.pixels))
    with pytest.raises(ValueError, match="other: has the shape"):
        picture.z_scores(pc.Image(np.zeros((2, 2, 3))))


def test_the_core_refuses_other_shapes():
    with pytest.raises(ValueError, match="4 channels"):
        _plycloth.encode_exr(np.zeros((2, 2, 4), dtype=np.float32))
    with pytest.raises(ValueError, match="at least 1"):
        _plycloth.encode_exr(np.zeros((0, 2, 3), dtype=np.float32))
