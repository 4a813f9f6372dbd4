"""The command line, but for fits and counts of the trade."""

import subprocess
import sys
import types
from dataclasses import replace
from pathlib import Path

import numpy as np
import plycloth as pc
import pytest
from PIL import Image as PillowImage
from plycloth import cli
from plycloth.cli import main

SMALL = ["--spp", "1", "--width", "24", "--threads", "1", "--quiet"]


def render(draft, output, *options):
    return main(["render", str(draft), "-o", str(output), *SMALL, *options])


def test_a_draft_renders_whole_with_its_aspect(draft, tmp_path, capsys):
    assert render(draft, tmp_path / "out.png") == 0
    # 4 ends 1 mm apart, 4 picks half a millimetre apart.
    assert pc.read_image(tmp_path / "out.png").pixels.shape == (12, 24, 3)
    assert capsys.readouterr().out == ""


def test_render_is_that_of_the_package(draft, tmp_path):
    assert render(draft, tmp_path / "out.exr", "--seed", "3", "--light", "raking") == 0
    fabric = pc.Fabric.from_draft(pc.read_wif(draft))
    scene = pc.overview(fabric, "raking", width=24)
    expected = pc.render(scene, spp=1, seed=3, progress=False)
    assert np.array_equal(pc.read_image(tmp_path / "out.exr").pixels, expected.pixels)


def test_untrimmed_keeps_what_interlaces_with_nothing(tmp_path, capsys):
    weave = np.pad(pc.WeavePattern.twill(2, 2).warp_up, [(0, 0), (0, 4)])
    path = tmp_path / "padded.wif"
    options = ["--width", "8", "--spp", "1"]
    pc.write_wif(pc.Draft.from_pattern(pc.WeavePattern(weave)), path)
    assert main(["render", str(path), "-o", str(tmp_path / "a.png"), *options]) == 0
    captured = capsys.readouterr()
    assert "4 picks x 4 ends" in captured.out
    assert "of 4 picks x 8 ends 4 x 4 are kept" in captured.err
    assert main(["render", str(path), "-o", str(tmp_path / "b.png"), *options, "--untrimmed"]) == 0
    captured = capsys.readouterr()
    assert "4 picks x 8 ends" in captured.out
    assert "are kept" not in captured.err


def test_render_takes_a_size_a_yarn_and_an_environment(draft, tmp_path):
    pc.Image(np.ones((2, 4, 3), np.float32)).save(tmp_path / "sky.exr")
    options = ["--size-mm", "8", "2", "--yarn", "rayon1", "--light", str(tmp_path / "sky.exr")]
    assert render(draft, tmp_path / "out.exr", *options) == 0
    assert pc.read_image(tmp_path / "out.exr").pixels.shape == (6, 24, 3)


def test_a_named_yarn_keeps_its_twist_at_the_thickness_of_the_draft(draft):
    named = types.SimpleNamespace(yarn="rayon1")
    yarn, weft = cli.render._yarns(named, {}, pc.read_wif(draft))
    assert weft.radius_mm == pytest.approx(0.2)  # picks are half as far apart
    measured = pc.preset("rayon1")
    assert yarn.radius_mm == pytest.approx(0.4)  # 0.8 of the spacing of 1 mm is its diameter
    assert yarn.plies == 2
    assert yarn.pitch / yarn.radius_mm == pytest.approx(measured.pitch / measured.radius_mm)


def test_render_shows_the_back_on_a_ground(draft, tmp_path):
    options = ["--side", "back", "--ground", "#ff8000"]
    assert render(draft, tmp_path / "out.exr", *options) == 0
    fabric = pc.Fabric.from_draft(pc.read_wif(draft)).turned_over()
    # Decoded to linear light.
    scene = pc.overview(fabric, width=24, ground=(1.0, ((128 / 255 + 0.055) / 1.055) ** 2.4, 0.0))
    expected = pc.render(scene, spp=1, progress=False)
    assert np.array_equal(pc.read_image(tmp_path / "out.exr").pixels, expected.pixels)


def test_the_ground_may_be_what_shines_there(draft, tmp_path):
    assert render(draft, tmp_path / "out.exr", "--ground", "none") == 0
    scene = pc.overview(pc.Fabric.from_draft(pc.read_wif(draft)), width=24, ground=None)
    expected = pc.render(scene, spp=1, progress=False)
    assert np.array_equal(pc.read_image(tmp_path / "out.exr").pixels, expected.pixels)


def test_a_saved_scene_gets_another_ground(draft, tmp_path, capsys):
    scene = pc.overview(pc.Fabric.from_draft(pc.read_wif(draft)), width=6)
    pc.save(scene, tmp_path / "scene.json")
    assert render(tmp_path / "scene.json", tmp_path / "out.exr", "--ground", "white") == 0
    expected = pc.render(replace(scene, background=1.0), spp=1, progress=False)
    assert np.array_equal(pc.read_image(tmp_path / "out.exr").pixels, expected.pixels)
    assert render(tmp_path / "scene.json", tmp_path / "b.exr", "--side", "back") == 2
    assert "--side: is for a draft or a fabric" in capsys.readouterr().err


def test_compare_puts_inputs_side_by_side(draft, tmp_path, capsys):
    pc.Image(np.full((8, 8, 3), 0.5)).save(tmp_path / "photo.png")
    inputs = [str(draft), "cotton1", str(tmp_path / "photo.png")]
    options = ["--spp", "1", "--height", "16", "--threads", "1", "--ground", "white"]
    assert main(["compare", *inputs, "-o", str(tmp_path / "out.exr"), *options]) == 0
    out = capsys.readouterr().out
    assert out == f"{tmp_path / 'out.exr'}: draft.wif, cotton1, photo.png\n"
    image = pc.read_image(tmp_path / "out.exr")
    assert (image.width, image.height) == (3 * 16 + 2, 16 + 14)
    fabric = pc.Fabric.from_draft(pc.read_wif(draft))
    scene = pc.overview(fabric, size_mm=16 * fabric.unit_mm, width=16, ground=1.0)
    expected = pc.render(scene, spp=1, progress=False)
    assert np.array_equal(image.pixels[:16, :16], expected.pixels)


def test_cloth_that_cannot_be_relaxed_is_one_line(tmp_path, monkeypatch, capsys):
    def fitted(self, *, progress=None):
        raise pc.ConvergenceError("no convergence in 99 iterations")

    monkeypatch.setattr(pc.Fabric, "fitted", fitted)
    pc.write_wif(pc.Draft.from_pattern(pc.WeavePattern.plain()), tmp_path / "a.wif")
    assert main(["render", str(tmp_path / "a.wif"), "-o", str(tmp_path / "a.png")]) == 2
    assert capsys.readouterr().err == "plycloth: error: no convergence in 99 iterations\n"


def test_the_record_of_a_fit_points_to_its_fabric(tmp_path, capsys):
    (tmp_path / "fit.json").write_text("{}", encoding="utf-8")
    (tmp_path / "fabric.json").write_text("{}", encoding="utf-8")
    assert main(["render", str(tmp_path / "fit.json"), "-o", str(tmp_path / "a.png")]) == 2
    assert f"the fabric of this fit is {tmp_path / 'fabric.json'}" in capsys.readouterr().err


COMPARISONS = [
    (["a.wif", "none.wif", "-o", "out.png"], "none.wif: No such file"),
    (["cotton", "-o", "out.png"], "cotton: must be a draft (.wif), a fabric (.json), a picture"),
    (["rig.json", "-o", "out.png"], "rig.json: holds a PhotoRig, not a Fabric"),
    (["a.wif", "-o", "out.bmp"], "out.bmp: must end in one of"),
    (["a.wif", "-o", "out.png", "--height", "2"], "error: --height must be in [8, 65536]"),
    (
        ["a.wif", "-o", "out.png", "--size-mm", "0", "1"],
        "error: --size-mm[0] must be in (0, 1e+08)",
    ),
    (["a.wif", "-o", "out.png", "--size-mm", "9e7", "1"], "--height must be less for cloth of"),
    (["a.wif", "-o", "out.png", "--ground", "reddish"], "--ground: must be a colour such as"),
    (["cotton1", "kept.png", "-o", "./kept.png"], "kept.png: is an input, and would be replaced"),
    (["odd.wif", "-o", "out.png", "--strict"], "[WARP COLORS] 1: "),
    (["cotton1", "--light", "sky.exr", "-o", "sky.exr"], "sky.exr: is an input, and would be"),
]


@pytest.mark.parametrize(("arguments", "message"), COMPARISONS, ids=lambda value: str(value)[:50])
def test_bad_input_of_compare_is_one_line(arguments, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    pc.save(pc.PhotoRig(), "rig.json")
    pc.write_wif(pc.Draft.from_pattern(pc.WeavePattern.plain()), "a.wif")
    for name in ("kept.png", "sky.exr"):
        pc.Image(np.ones((8, 8, 3))).save(name)
    text = Path("a.wif").read_text(encoding="utf-8")
    Path("odd.wif").write_text(text + "[WARP COLORS]\n1=red\n", encoding="utf-8")
    assert main(["compare", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("plycloth: error: ")
    assert message in line
    assert not (tmp_path / "out.png").exists()


def test_render_takes_other_colours_and_end_one_at_the_right(draft, tmp_path):
    given = pc.read_wif(draft)
    changed = given.mirrored().recolored({1: "#aa3322"})
    pc.write_wif(changed, tmp_path / "changed.wif")
    options = ["--end-one", "right", "--recolor", "1=#aa3322"]
    assert render(draft, tmp_path / "a.exr", *options) == 0
    assert render(tmp_path / "changed.wif", tmp_path / "b.exr") == 0
    assert pc.read_image(tmp_path / "a.exr") == pc.read_image(tmp_path / "b.exr")
    assert render(draft, tmp_path / "c.exr") == 0
    assert pc.read_image(tmp_path / "a.exr") != pc.read_image(tmp_path / "c.exr")


@pytest.mark.parametrize("text", ["3", "red=#aa3322", "-1=#aa3322"])
def test_a_colour_to_replace_has_a_number(draft, tmp_path, capsys, text):
    with pytest.raises(SystemExit, match="2"):
        render(draft, tmp_path / "out.png", f"--recolor={text}")
    assert "--recolor: must be NUMBER=#RRGGBB, such as 3=#aa3322" in capsys.readouterr().err


def test_render_says_what_it_did(draft, tmp_path, capsys):
    arguments = [a for a in SMALL if a != "--quiet"]
    assert main(["render", str(draft), "-o", str(tmp_path / "out.png"), *arguments]) == 0
    assert "out.png: 24 x 12 pixels" in capsys.readouterr().out


def test_what_is_odd_about_a_draft_is_a_line(draft, tmp_path, capsys):
    text = draft.read_text(encoding="utf-8").replace("Thickness=", "Thickness=0 ;")
    lines = [line for line in text.splitlines() if not line.startswith("Thickness")]
    draft.write_text("\n".join(lines), encoding="utf-8")
    assert render(draft, tmp_path / "out.png") == 0
    warning, *_ = capsys.readouterr().err.splitlines()
    assert warning.startswith("plycloth: warning: ")
    assert "thickness" in warning


def test_saved_fabrics_and_scenes_render(draft, tmp_path):
    fabric = pc.Fabric.from_draft(pc.read_wif(draft))
    fabric.save(tmp_path / "fabric.json")
    assert render(tmp_path / "fabric.json", tmp_path / "fabric.exr") == 0
    assert render(draft, tmp_path / "draft.exr") == 0
    pictures = [pc.read_image(tmp_path / f"{name}.exr") for name in ("fabric", "draft")]
    assert pictures[0] == pictures[1]
    pc.save(pc.overview(fabric, width=6), tmp_path / "scene.json")
    assert render(tmp_path / "scene.json", tmp_path / "scene.exr") == 0
    assert pc.read_image(tmp_path / "scene.exr").pixels.shape == (3, 6, 3)


def test_yarns_of_a_saved_fabric_are_fitted_if_wanted(draft, tmp_path, capsys):
    thick = pc.RoundYarn(0.45, pc.PlyBsdf())
    given = pc.Fabric.from_draft(pc.read_wif(draft), thick, thick)
    for name, fabric in (("given", given), ("fitted", given.fitted())):
        fabric.save(tmp_path / f"{name}.json")
    assert render(tmp_path / "given.json", tmp_path / "given.exr") == 0
    warning = capsys.readouterr().err
    assert warning.startswith("plycloth: warning: yarns overlap at 16 of 16 crossings")
    assert warning.count("\n") == 1
    assert render(tmp_path / "given.json", tmp_path / "a.exr", "--fit-yarns") == 0
    assert render(tmp_path / "fitted.json", tmp_path / "b.exr") == 0
    assert capsys.readouterr().err == ""
    assert pc.read_image(tmp_path / "a.exr") == pc.read_image(tmp_path / "b.exr")


BROKEN = "[WIF]\nVersion=1.1\n[WEAVING]\nShafts=two\n"

RENDERS = [
    (["none.wif", "-o", "out.png"], "none.wif: No such file"),
    (["draft.wif", "-o", "out.gif"], "out.gif: must end in one of .exr, .png, .tif"),
    (["draft.wif", "-o", "out"], "out: must end in one of .exr, .png"),
    (["draft.wif", "-o", "nowhere/out.png"], "there is no folder nowhere"),
    (["broken.wif", "-o", "out.png"], "broken.wif"),
    (["draft.wif", "-o", "out.png", "--light", "dya"], "--light must be one of 'day'"),
    (["draft.wif", "-o", "out.png", "--light", "dya"], "the nearest is 'day'"),
    (["draft.wif", "-o", "out.png", "--light", "none.exr"], "none.exr: No such file"),
    (["draft.wif", "-o", "out.png", "--yarn", "coton1"], "the nearest is 'cotton1'"),
    (["draft.wif", "-o", "out.png", "--ground", "#12"], "--ground: must be a colour such as"),
    (["fabric.json", "-o", "out.png", "--recolor", "1=#aa3322"], "--recolor: is for a draft"),
    (["fabric.json", "-o", "out.png", "--end-one", "right"], "--end-one: is for a draft"),
    (["draft.wif", "-o", "out.png", "--dpi", "0"], "--dpi must be in [1, 65535], not 0.0"),
    (["draft.wif", "-o", "out.png", "--light", "none.hdr"], "none.hdr: No such file"),
    (["draft.wif", "-o", "out.png", "--yarn", "wool"], "--yarn must be one of 'cotton1'"),
    (["draft.wif", "-o", "out.png", "--recolor", "9=#aa3322"], "--recolor: the draft has no"),
    (["draft.wif", "-o", "out.png", "--recolor", "1=red"], "--recolor must be # and six"),
    (["draft.wif", "-o", "out.png", "--spp", "0"], "error: --spp must be"),
    (["draft.wif", "-o", "out.png", "--width", "0"], "error: --width must be"),
    (["draft.wif", "-o", "out.png", "--size-mm", "1", "nan"], "error: --size-mm"),
    (["draft.wif", "-o", "out.png", "--seed", "-1"], "error: --seed must be"),
    (["draft.wif", "-o", "out.png", "--threads", "0"], "error: --threads must be"),
]


@pytest.mark.parametrize(("arguments", "message"), RENDERS, ids=lambda value: str(value)[:50])
def test_bad_input_of_render_is_one_line(arguments, message, draft, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "broken.wif").write_text(BROKEN, encoding="utf-8")
    assert main(["render", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("plycloth: error: ")
    assert message in line
    assert not (tmp_path / "out.png").exists()


@pytest.mark.parametrize(
    "arguments", [[], ["rendr"], ["render"], ["render", "a.wif", "-o", "b.png", "--spp", "many"]]
)
def test_unknown_arguments_end_with_2(arguments, capsys):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2
    assert "usage: plycloth" in capsys.readouterr().err


def test_ctrl_c_ends_with_130(draft, tmp_path, monkeypatch, capsys):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(cli.render, "render_to", interrupted)
    assert render(draft, tmp_path / "out.png") == 130
    assert capsys.readouterr().err == "plycloth: interrupted\n"


def test_ctrl_c_keeps_the_picture_so_far(draft, tmp_path, monkeypatch, capsys):
    run = pc.Renderer.run

    def interrupted(renderer, spp, **options):
        if renderer.samples == 2:
            raise KeyboardInterrupt
        run(renderer, spp, **options)

    monkeypatch.setattr(pc.Renderer, "run", interrupted)
    assert render(draft, tmp_path / "out.exr", "--spp", "9") == 130
    assert "out.exr holds the picture after 2 of 9 samples per pixel" in capsys.readouterr().err
    monkeypatch.setattr(pc.Renderer, "run", run)
    assert render(draft, tmp_path / "two.exr", "--spp", "2") == 0
    assert pc.read_image(tmp_path / "out.exr") == pc.read_image(tmp_path / "two.exr")


def test_errors_of_the_program_itself_are_not_hidden(draft, tmp_path, monkeypatch):
    def failing(*_, **__):
        raise TypeError("a mistake in the code")

    monkeypatch.setattr(cli.render, "render_to", failing)
    with pytest.raises(TypeError, match="mistake"):
        render(draft, tmp_path / "out.png")


def test_the_module_runs_as_the_command_does(draft, tmp_path):
    command = [sys.executable, "-m", "plycloth"]
    version = subprocess.run([*command, "--version"], capture_output=True, text=True, check=True)
    assert version.stdout == f"plycloth {pc.__version__}\n"
    picture = tmp_path / "out.png"
    subprocess.run([*command, "render", str(draft), "-o", str(picture), *SMALL], check=True)
    assert pc.read_image(picture).width == 24
    missing = subprocess.run(
        [*command, "render", "none.wif", "-o", "a.png"], capture_output=True, text=True, check=False
    )
    assert missing.returncode == 2
    assert missing.stderr == "plycloth: error: none.wif: No such file or directory\n"


def test_a_resolution_is_noted_in_the_picture(draft, tmp_path):
    given = ["render", str(draft), *SMALL, "-o"]
    for name in ("a.png", "a.tif", "a.jpg"):
        assert main([*given, str(tmp_path / name), "--dpi", "300"]) == 0
        with PillowImage.open(tmp_path / name) as stored:
            assert stored.info["dpi"] == pytest.approx((300, 300), abs=0.01)
