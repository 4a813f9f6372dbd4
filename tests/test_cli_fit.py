"""`plycloth fit`, with a stand-in for the search."""

import inspect
import json
import sys
import types

import numpy as np
import plycloth as pc
import pytest
from fits import SmallPhotoFit
from PIL import Image as PillowImage
from plycloth.cli import main


@pytest.fixture
def photographs(tmp_path):
    paths = []
    for name in ("a", "b"):
        paths.append(tmp_path / f"{name}.png")
        pc.Image(np.full((12, 12, 3), 0.25, np.float32)).save(paths[-1], gamma=2.2)
    return paths


@pytest.fixture
def fits(monkeypatch, request):
    """Puts a quick stand-in, stopped by its parameter, in place of the search; gives its calls."""
    calls = []

    def fit_photographs(front, back, **options):
        calls.append((front, back, options))
        sides = [side for side, given in (("front", front), ("back", back)) if given is not None]
        return SmallPhotoFit(sides, stopped)

    stopped = getattr(request, "param", None)

    module = types.ModuleType("plycloth.photo_fit")
    module.fit_photographs = fit_photographs
    monkeypatch.setitem(sys.modules, "plycloth.photo_fit", module)
    return calls


def test_fit_leaves_json_pictures_and_page(photographs, fits, tmp_path, capsys):
    folder = tmp_path / "new" / "found"
    assert main(["fit", *map(str, photographs), "-o", str(folder), "--seed", "5"]) == 0
    assert fits[0][:2] == tuple(photographs)
    options = fits[0][2]
    assert options == {"seed": 5, "progress": None, "rig": pc.PhotoRig()}
    assert {path.name for path in folder.iterdir()} == {
        "fit.json", "fabric.json", "front.png", "back.png", "index.html"
    }  # fmt: skip
    assert json.loads((folder / "fit.json").read_text(encoding="utf-8"))["candidates"][0][
        "errors"
    ] == [0.1, 0.2]
    # 8 bit, encoded as light ** (1 / 2.2), in the photographs' size.
    picture = pc.read_image(folder / "front.png", gamma=2.2)
    assert picture.pixels.shape == (12, 12, 3)
    assert picture.pixels[0, 0, 0] == pytest.approx(0.5, abs=0.005)
    assert pc.Fabric.load(folder / "fabric.json") == SmallPhotoFit().fabric
    out, page = capsys.readouterr().out, (folder / "index.html").read_text(encoding="utf-8")
    assert "index.html: relative errors front" in out
    assert "The cloth is as large as it is." in out
    for note in SmallPhotoFit.notes:
        assert note in page


def test_fit_hands_on_what_is_chosen(photographs, fits, draft, tmp_path):
    rig = pc.PhotoRig(camera_height=300.0, back_lamp=(0, 0, -250), gamma=1.0)
    pc.save(rig, tmp_path / "rig.json")
    options = ["--tie", "--draft", str(draft), "--threads", "1", "--quiet"]
    options += ["--rig", str(tmp_path / "rig.json")]
    assert main(["fit", *map(str, photographs), "-o", str(tmp_path / "out"), *options]) == 0
    assert fits[0][2] == {
        "seed": 0,
        "tie": True,
        "threads": 1,
        "pattern": pc.WeavePattern.twill(2, 2),
        "rig": rig,
        "progress": False,
    }
    # Encoded by the gamma of that rig.
    written = pc.read_image(tmp_path / "out" / "front.png", gamma=1.0)
    assert written.pixels[0, 0, 0] == pytest.approx(0.5, abs=0.005)


def test_what_is_known_of_cloth_and_light_is_handed_on(photographs, fits, tmp_path):
    arguments = ["fit", *map(str, photographs), "-o", str(tmp_path / "out"), "--quiet"]
    options = ["--width-mm", "80", "--cover", "0.6", "0.8", "--quick", "--seconds", "20"]
    assert main([*arguments, *options, "--exposure", "2"]) == 0
    assert main([*arguments, "--grey-card", "118", "118", "118"]) == 0
    assert main([*arguments, "--white", "255", "255", "255"]) == 0
    assert main([*arguments, "--ends", "50.8/in", "--picks", "18/cm"]) == 0
    known, grey, white, counted = (call[2] for call in fits)
    assert counted["ends"] == pytest.approx(20.0)
    assert (counted["picks"], counted["per"]) == (18.0, "cm")
    assert known["width_mm"] == 80.0
    assert known["covers"] == (0.6, 0.8)
    assert (known["quick"], known["seconds"], known["exposure"]) == (True, 20.0, 2.0)
    assert grey["exposure"] == pc.GreyCard((118 / 255) ** 2.2, reflectance=0.18)
    assert white["exposure"] == pc.GreyCard(1.0, reflectance=0.9)


@pytest.mark.parametrize(("lit", "side"), [((), "front"), (("--lit", "back"), "back")])
def test_a_single_photograph_is_fitted(lit, side, photographs, fits, tmp_path, capsys):
    folder = tmp_path / "out"
    assert main(["fit", str(photographs[0]), *lit, "-o", str(folder)]) == 0
    given = dict(zip(("front", "back"), fits[0][:2], strict=True))
    assert given == {"front": None, "back": None} | {side: photographs[0]}
    assert {path.name for path in folder.glob("*.png")} == {f"{side}.png"}
    assert f"relative errors {side} " in capsys.readouterr().out


@pytest.mark.parametrize("fits", ["interrupted"], indirect=True)
def test_ctrl_c_leaves_the_best_fit_so_far(photographs, fits, tmp_path, capsys):
    folder = tmp_path / "out"
    assert main(["fit", *map(str, photographs), "-o", str(folder)]) == 130
    assert (folder / "fabric.json").exists()
    out, err = capsys.readouterr()
    assert "(interrupted: the best so far)" in out
    assert err.splitlines() == [
        f"plycloth: interrupted: {folder} holds the best so far; its pictures follow, unless Ctrl-C"
        " again",
        f"plycloth: interrupted: {folder} holds the best so far",
    ]


def test_ctrl_c_while_pictures_are_made_leaves_the_fabric(
    photographs, fits, tmp_path, monkeypatch, capsys
):
    def picture(self, side, **_):
        raise KeyboardInterrupt

    monkeypatch.setattr(SmallPhotoFit, "picture", picture)
    folder = tmp_path / "out"
    assert main(["fit", *map(str, photographs), "-o", str(folder)]) == 130
    assert pc.Fabric.load(folder / "fabric.json") == SmallPhotoFit().fabric
    assert {path.name for path in folder.iterdir()} == {"fit.json", "fabric.json"}
    assert f"{folder} holds the fabric, but no pictures" in capsys.readouterr().err


@pytest.mark.parametrize("fits", ["out of time"], indirect=True)
def test_a_fit_that_ran_out_of_time_is_marked(photographs, fits, tmp_path, capsys):
    assert main(["fit", *map(str, photographs), "-o", str(tmp_path / "out")]) == 0
    assert "(out of time: the best so far)" in capsys.readouterr().out


def test_photographs_are_never_replaced(photographs, fits, tmp_path, capsys):
    front = photographs[0].rename(tmp_path / "front.png")
    before = front.read_bytes()
    assert main(["fit", str(front), str(photographs[1]), "-o", str(tmp_path)]) == 2
    assert "front.png there is a photograph to fit" in capsys.readouterr().err
    assert front.read_bytes() == before
    assert not fits


FITS = [
    (["a.png", "b.png", "-o", "out", "--dpi", "nan"], "--dpi must be in [1, 65535], not nan"),
    (["a.png", "b.png", "-o", "a.png"], "a.png: is a file, but must be a folder"),
    (["a.png", "b.png", "-o", "out", "--lit", "back"], "--lit: is for a single photograph"),
    (["a.png", "b.png", "-o", "out", "--white", "1", "0", "300"], "--white: must be three codes"),
    (["a.png", "b.png", "-o", "out", "--strict"], "--strict: is for the draft that --draft names"),
    (["a.png", "b.png", "-o", "out", "--draft", "none.wif"], "none.wif: No such file"),
]


OPTIONS_OF_FIT = [
    (["--width-mm", "-1"], "--width-mm must be in [0.001, 1e+06], not -1.0"),
    (["--cover", "0.8", "0.5"], "--cover must be the lower one first, not 0.8, 0.5"),
    (["--ends", "2e5/cm"], "--ends must be in [0.1, 10000], not 200000.0"),
    (["--exposure", "nan"], "--exposure must be finite and greater than 0, not nan"),
    (["--seconds", "0"], "--seconds must be finite and greater than 0, not 0.0"),
    (["--threads", "0"], "--threads must be in [1, 1024], not 0"),
]


@pytest.mark.parametrize(("given", "message"), OPTIONS_OF_FIT, ids=lambda value: str(value)[:20])
def test_fit_names_its_own_options(given, message, photographs, tmp_path, capsys):
    arguments = ["fit", *map(str, photographs), "-o", str(tmp_path / "out"), "--quiet"]
    assert main([*arguments, *given]) == 2
    assert capsys.readouterr().err == f"plycloth: error: {message}\n"


@pytest.mark.parametrize(("arguments", "message"), FITS, ids=lambda value: str(value)[:50])
def test_bad_input_of_fit_is_one_line(
    arguments, message, photographs, draft, fits, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.png").write_text("no picture", encoding="utf-8")
    assert main(["fit", *arguments]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("plycloth: error: ")
    assert message in line
    assert fits == []


UNREADABLE = [
    ("none.png", "none.png: No such file"),
    ("draft.wif", "draft.wif: has the suffix '.wif'"),
    ("text.png", "text.png: not a readable picture"),
    ("a.png", "a.png: shows one colour all over"),
]


@pytest.mark.parametrize(("name", "message"), UNREADABLE)
def test_photographs_that_cannot_be_fitted_are_named(
    name, message, photographs, draft, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.png").write_text("no picture", encoding="utf-8")
    for arguments in ([name], [name, "--lit", "back"], [name, "b.png"]):
        assert main(["fit", *arguments, "-o", "out"]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("plycloth: error: ")
        assert message in line
    assert not (tmp_path / "out").exists()


def test_the_search_takes_what_is_chosen():
    from plycloth.photo_fit import fit_photographs

    taken = inspect.signature(fit_photographs).parameters
    named = {"seed", "tie", "threads", "pattern", "progress", "width_mm", "exposure", "covers"}
    assert named | {"quick", "seconds", "rig"} <= set(taken)


def test_a_resolution_is_noted_in_the_pictures_of_a_fit(photographs, fits, tmp_path):
    output = tmp_path / "out"
    assert main(["fit", *map(str, photographs), "-o", str(output), "--quiet", "--dpi", "254"]) == 0
    with PillowImage.open(output / "front.png") as stored:
        assert stored.info["dpi"] == pytest.approx((254, 254), abs=0.01)
