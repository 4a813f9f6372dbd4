"""Environment maps as people have them: with values that no sky can have."""

import warnings

import numpy as np
import plycloth as pc
import pytest
from plycloth import cli, datasets
from samples import plain_fabric


def saved(tmp_path, pixels):
    pc.Image(pixels).save(tmp_path / "sky.exr")
    return tmp_path / "sky.exr"


def odd_pixels():
    pixels = np.full((4, 8, 3), 0.5, np.float32)
    pixels[0, 0] = [-149, -0.25, 7]
    pixels[1, 1] = [np.inf, -np.inf, np.nan]
    pixels[2, 2, 0] = 1e20
    return pixels


def test_values_that_are_no_radiance_are_replaced_with_one_warning(tmp_path):
    file = saved(tmp_path, odd_pixels())
    with pytest.warns(pc.ImageWarning) as caught:
        light = pc.EnvironmentLight.load(file)
    assert [str(each.message) for each in caught] == [
        f"{file}: 6 of 96 values are no radiance: 3 negative, down to -inf (now 0), "
        "2 above 1e15, up to inf (now 7), 1 NaN (now 0)"
    ]
    expected = odd_pixels()
    expected[0, 0], expected[1, 1], expected[2, 2, 0] = [0, 0, 7], [7, 0, 0], 7
    assert (light.image == expected).all()


def test_a_good_map_is_read_without_a_word(tmp_path):
    pixels = np.full((2, 4, 3), 0.5)
    assert (pc.EnvironmentLight.load(saved(tmp_path, pixels)).image == 0.5).all()


def test_how_low_is_said(tmp_path):
    pixels = np.ones((2, 4, 3))
    pixels[0, 0, :2] = [-149.0, -1e-6]
    with pytest.warns(pc.ImageWarning, match=r"sky\.exr: 2 of 24 .* 2 negative, down to -149"):
        pc.EnvironmentLight.load(saved(tmp_path, pixels))


@pytest.mark.parametrize("value", [np.nan, np.inf, -1.0])
def test_a_map_without_any_radiance_is_an_error(tmp_path, value):
    file = saved(tmp_path, np.full((2, 4, 3), value))
    with pytest.raises(pc.ImageError, match=r"sky\.exr: holds no radiance"):
        pc.EnvironmentLight.load(file)


def test_a_mended_map_still_is_that_of_its_file(tmp_path):
    with pytest.warns(pc.ImageWarning):
        light = pc.EnvironmentLight.load(saved(tmp_path, odd_pixels()))
    # Of a file that was read once, nothing is said a second time.
    assert light.current_file() == tmp_path / "sky.exr"
    pc.save(light, tmp_path / "sky.json")
    with pytest.warns(pc.ImageWarning, match=r"sky\.exr"):
        assert pc.load(tmp_path / "sky.json") == light


def test_a_render_has_none_of_it(tmp_path):
    with pytest.warns(pc.ImageWarning):
        light = pc.EnvironmentLight.load(saved(tmp_path, odd_pixels()))
    pixels = pc.render(pc.overview(plain_fabric(), [light], width=8), spp=2).pixels
    assert np.isfinite(pixels).all()
    assert pixels.min() >= 0


def rgbe(pixels):
    """A Radiance picture, uncompressed (Ward, Graphics Gems II.5)."""
    height, width, _ = pixels.shape
    _, exponent = np.frexp(pixels.max(axis=2))
    mantissas = np.floor(np.ldexp(pixels, (8 - exponent)[:, :, None]))
    body = np.concatenate([mantissas, (exponent + 128)[:, :, None]], axis=2).astype(np.uint8)
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n", body.tobytes()


def test_radiance_pictures_are_read(tmp_path):
    pixels = np.array([[[1.0, 2.0, 3.0], [0.25, 0.5, 0.0625]], [[1024.0, 512.0, 8.0], [1.0] * 3]])
    head, body = rgbe(pixels)
    (tmp_path / "sky.hdr").write_bytes(head.encode() + body)
    assert pc.EnvironmentLight.load(tmp_path / "sky.hdr").image.tolist() == pixels.tolist()
    assert pc.read_image(tmp_path / "sky.hdr").pixels.tolist() == pixels.tolist()
    with pytest.raises(ValueError, match="a Radiance picture holds linear light"):
        pc.read_image(tmp_path / "sky.hdr", gamma=2.2)
    for size in ("-Y 1000000 +X 1000000", "-Y 60000 +X 60000"):
        (tmp_path / "vast.hdr").write_text(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{size}\n")
        with pytest.raises(pc.ImageError, match=r"vast\.hdr: .*has too many pixels: \d+ x \d+"):
            pc.read_image(tmp_path / "vast.hdr")
    (tmp_path / "cut.hdr").write_bytes(head.encode() + body[:-1])
    with pytest.raises(pc.ImageError, match=r"cut\.hdr: .*not a readable Radiance picture"):
        pc.EnvironmentLight.load(tmp_path / "cut.hdr")


def test_the_command_line_takes_maps_of_any_kind(tmp_path, capsys):
    fabric = tmp_path / "fabric.json"
    plain_fabric().save(fabric)
    head, body = rgbe(np.ones((2, 4, 3)))
    (tmp_path / "sky.hdr").write_bytes(head.encode() + body)
    saved(tmp_path, odd_pixels())
    given = ["render", str(fabric), "--spp", "1", "--width", "8", "--quiet", "-o"]
    for name, said in (("sky.hdr", ""), ("sky.exr", "plycloth: warning: ")):
        output = str(tmp_path / f"{name}.png")
        assert cli.main([*given, output, "--light", str(tmp_path / name)]) == 0
        errors = capsys.readouterr().err.splitlines()
        assert [line.startswith(said) and name in line for line in errors] == [True] * bool(said)
    assert cli.main([*given, output, "--light", str(tmp_path / "gone.hdr")]) == 2
    assert "gone.hdr: No such file" in capsys.readouterr().err


@pytest.mark.data
@pytest.mark.parametrize("name", ["forest", "studio"])
def test_real_maps_light_a_scene(name):
    with pytest.warns(pc.ImageWarning, match=rf"{name}\.exr: \d+ of 393216 values .* negative"):
        light = pc.EnvironmentLight.load(datasets.hdri(name))
    assert light.image.min() == 0
    pixels = pc.render(pc.overview(plain_fabric(), [light], width=8), spp=2).pixels
    assert np.isfinite(pixels).all()


@pytest.mark.data
def test_a_real_radiance_picture():
    light = pc.EnvironmentLight.load(datasets.path("cases/sky.hdr"))
    assert light.image.shape == (8, 16, 3)
    # Of the same pixels as they stand in the file, by another reader.
    assert light.image.mean() > 0


@pytest.mark.data
def test_a_real_file_of_nan_and_infinities():
    file = datasets.path("cases/nan_inf_neg.exr")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        raw = pc.read_image(file).pixels
    assert not np.isfinite(raw).all()
    with pytest.warns(pc.ImageWarning, match=r"nan_inf_neg\.exr") as caught:
        light = pc.EnvironmentLight.load(file)
    assert len(caught) == 1
    valid = np.isfinite(raw) & (raw >= 0)
    assert (light.image[valid] == raw[valid]).all()
    assert light.image.max() == raw[valid].max()
