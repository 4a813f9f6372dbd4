import json

import numpy as np
import plycloth as pc
import pytest
from PIL import Image as PillowImage
from samples import PLAIN, TALL, each_description, plain_fabric


@each_description
def test_what_is_saved_is_what_is_loaded(value, tmp_path):
    file = tmp_path / "value.json"
    pc.save(value, file)
    loaded = pc.load(file)
    assert loaded == value
    assert repr(loaded) == repr(value)


def test_fabrics_and_scenes_save_themselves(tmp_path):
    fabric = plain_fabric()
    fabric.save(tmp_path / "fabric.json")
    assert pc.Fabric.load(tmp_path / "fabric.json") == fabric
    scene = pc.Scene(
        pc.Swatch(fabric), pc.PerspectiveCamera((0, 0, 8), (0, 0, 0)), [pc.ConstantLight(1)]
    )
    scene.save(tmp_path / "scene.json")
    assert pc.Scene.load(tmp_path / "scene.json") == scene


def test_odd_floats_keep_every_bit(tmp_path):
    generator = np.random.default_rng(7)
    fabric = plain_fabric(
        pattern=TALL,
        warp_spacing_mm=generator.random(3) + 0.1,
        weft_colors=generator.random((4, 3)),
    )
    fabric.save(tmp_path / "fabric.json")
    assert pc.Fabric.load(tmp_path / "fabric.json") == fabric
    light = pc.EnvironmentLight(generator.random((64, 64, 3)))
    pc.save(light, tmp_path / "light.json")
    assert pc.load(tmp_path / "light.json") == light


def test_the_file_is_readable(tmp_path):
    file = tmp_path / "fabric.json"
    plain_fabric(pattern=TALL, warp_colors=np.full((3, 3), 0.5)).save(file)
    lines = [line.strip() for line in file.read_text(encoding="utf-8").splitlines()]
    rows = lines.index('"rows": [')
    assert lines[rows + 1 : rows + 5] == ['"#.#",', '".#.",', '"#.#",', '".#."']
    assert lines.count("[0.5, 0.5, 0.5],") == 2
    assert '"base_color": [0.5, 0.5, 0.5],' in lines
    document = json.loads(file.read_text(encoding="utf-8"))
    assert (document["plycloth"], document["type"]) == (1, "Fabric")


def test_a_file_from_before_yarns_were_pressed_holds_round_ones(tmp_path):
    file = tmp_path / "yarn.json"
    yarn = pc.RoundYarn(0.2, pc.PlyBsdf())
    pc.save(yarn, file)
    document = json.loads(file.read_text(encoding="utf-8"))
    del document["thickness_mm"], document["collision_radius_mm"]
    file.write_text(json.dumps(document), encoding="utf-8")
    assert pc.load(file) == yarn


def test_a_scene_from_before_there_were_backgrounds_has_none(tmp_path):
    file = tmp_path / "scene.json"
    scene = pc.overview(plain_fabric(), ground=None)
    pc.save(scene, file)
    document = json.loads(file.read_text(encoding="utf-8"))
    del document["background"]
    file.write_text(json.dumps(document), encoding="utf-8")
    assert pc.load(file) == scene


def test_patterns_are_saved_too(tmp_path):
    pc.save(PLAIN, tmp_path / "plain.json")
    assert pc.load(tmp_path / "plain.json") == PLAIN


def test_nothing_is_written_when_a_value_cannot_be(tmp_path):
    light = pc.EnvironmentLight(np.ones((65, 64, 3)))
    with pytest.raises(pc.FormatError, match="64 x 65 pixels"):
        pc.save(light, tmp_path / "light.json")
    assert not list(tmp_path.iterdir())


@pytest.fixture
def sky(tmp_path):
    pytest.importorskip("plycloth.image")
    file = tmp_path / "images" / "sky.png"
    file.parent.mkdir()
    pixels = np.random.default_rng(3).integers(0, 256, (80, 160, 3), np.uint8)
    PillowImage.fromarray(pixels).save(file)
    return pc.EnvironmentLight.load(file, scale=2.0, rotation=30.0)


def test_an_image_below_the_file_is_named_relative_to_it(sky, tmp_path):
    pc.save(sky, tmp_path / "sky.json")
    assert json.loads((tmp_path / "sky.json").read_text(encoding="utf-8"))["image"] == {
        "file": "images/sky.png"
    }
    moved = tmp_path.rename(tmp_path.with_name("moved"))
    assert pc.load(moved / "sky.json") == sky


def test_an_image_elsewhere_is_named_in_full(sky, tmp_path):
    (tmp_path / "scenes").mkdir()
    pc.save(sky, tmp_path / "scenes" / "sky.json")
    assert pc.load(tmp_path / "scenes" / "sky.json") == sky


def test_an_image_that_its_file_no_longer_holds_is_not_named(sky, tmp_path):
    PillowImage.new("RGB", (160, 80)).save(sky.path)
    with pytest.raises(pc.FormatError, match="is in no file"):
        pc.save(sky, tmp_path / "sky.json")


def test_a_missing_image_is_an_error_of_the_file(sky, tmp_path):
    pc.save(sky, tmp_path / "sky.json")
    (tmp_path / "images" / "sky.png").unlink()
    with pytest.raises(pc.FormatError, match=r"sky\.json: image: .*sky\.png"):
        pc.load(tmp_path / "sky.json")
