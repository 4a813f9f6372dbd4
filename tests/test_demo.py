import json

import plycloth as pc
import pytest
from fits import SmallPhotoFit
from plycloth import demo

SMALL = demo.Effort(
    cloth_width=24, cloth_spp=1, photo_width=16, photo_spp=4, paths=4, rounds=1, evaluations=2
)

FILES = {
    "back-target.png",
    "back.png",
    "cloth.png",
    "draft.png",
    "fabric.json",
    "fit.json",
    "front-target.png",
    "front.png",
    "index.html",
}


def test_without_data_it_recovers_what_it_made_up(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("PLYCLOTH_DATA", raising=False)
    assert demo.main([str(tmp_path)], SMALL) == 0
    assert {path.name for path in tmp_path.iterdir()} == FILES
    said = capsys.readouterr().out
    assert "PLYCLOTH_DATA is not set" in said
    assert "7 hidden parameters recovered" in said
    parameters = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))["parameters"]
    assert len(parameters) == 7
    assert parameters[0]["label"] == "base_color.red"
    assert parameters[0]["hidden"] == 0.75
    assert "hidden value" in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_with_data_it_fits_photographs(tmp_path, monkeypatch, capsys):
    photos = tmp_path / "data" / "photos"
    photos.mkdir(parents=True)
    for name in ("satin1_R.png", "satin1_T.png"):
        pc.render(pc.overview(pc.Fabric.from_draft(example()), width=8), spp=1).save(photos / name)
    monkeypatch.setenv("PLYCLOTH_DATA", str(tmp_path / "data"))
    photo_fit = pytest.importorskip("plycloth.photo_fit")
    monkeypatch.setattr(photo_fit, "fit_photographs", lambda f, b, **_: SmallPhotoFit((f, b)))
    assert demo.main([str(tmp_path / "out")]) == 0
    assert "PLYCLOTH_DATA is set: fits the photographs" in capsys.readouterr().out
    assert (tmp_path / "out" / "index.html").exists()


def test_with_a_folder_that_lacks_photographs_it_says_so(tmp_path, monkeypatch, capsys):
    (tmp_path / "wif").mkdir()
    (tmp_path / "wif" / "a.wif").touch()
    monkeypatch.setenv("PLYCLOTH_DATA", str(tmp_path))
    assert demo.main([str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err.startswith("demo: error: ")


@pytest.mark.parametrize("option", ["--help", "--folder"])
def test_options_are_no_folders(tmp_path, monkeypatch, option):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit):
        demo.main([option])
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_what_is_hidden_is_found(monkeypatch):
    """The demo's own fit, on smaller pictures; it starts from colours of 0.5 and 10 per mm."""
    effort = demo.Effort(photo_width=96, photo_spp=128, paths=512, rounds=6, evaluations=6)
    photographs = demo.photograph(demo.made_up(example(), demo.HIDDEN), effort, seed=1)
    result = demo.recover(example(), photographs, effort)
    hidden = demo.hidden_values()
    for estimate in result.estimates:
        within = {"rel": 0.05} if "extinction" in estimate.label else {"abs": 0.03}
        assert estimate.value == pytest.approx(hidden[estimate.label], **within)


def example():
    return pc.read_wif(pc.datasets.example_draft())
