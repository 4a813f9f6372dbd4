import copy
import math
import pickle
from dataclasses import FrozenInstanceError, replace

import numpy as np
import plycloth as pc
import pytest
from PIL import Image as PillowImage
from plycloth.weave import WeavePattern
from samples import PLAIN, TALL, each_description, every_description, plain_fabric


@each_description
def test_copies_are_equal_and_hash_alike(value):
    for twin in (pickle.loads(pickle.dumps(value)), copy.deepcopy(value), replace(value)):
        assert twin == value
        assert hash(twin) == hash(value)
        assert repr(twin) == repr(value)


@each_description
def test_frozen_and_unlike_all_others(value):
    with pytest.raises(FrozenInstanceError):
        value.eta = 1.0
    assert [other for other in every_description() if other == value] == [value]
    assert value != "a string"


@pytest.mark.parametrize(
    ("field", "other"),
    [
        ("pattern", WeavePattern([[False, True], [True, False]])),
        ("warp", pc.RoundYarn(0.11, pc.PlyBsdf())),
        ("weft", pc.FlatYarn(0.1, pc.PlyBsdf())),
        ("warp_spacing_mm", 0.26),
        ("warp_spacing_mm", [0.25, 0.25]),
        ("warp_colors", [[1, 1, 1], [1, 1, 1]]),
        ("weft_colors", [[1, 1, 1], [1, 1, 1]]),
        ("collision_stiffness", 2.0),
    ],
)
def test_fabrics_differ_when_a_field_does(field, other):
    assert plain_fabric(**{field: other}) != plain_fabric()


def test_a_pickled_array_stays_read_only():
    fabric = pickle.loads(pickle.dumps(plain_fabric(warp_spacing_mm=[0.2, 0.3])))
    with pytest.raises(ValueError, match="read-only"):
        fabric.warp_spacing_mm[0] = 1.0


def test_arrays_are_copies():
    colors = np.ones((2, 3))
    fabric = plain_fabric(warp_colors=colors)
    colors[:] = 0.0
    assert (fabric.warp_colors == 1.0).all()


def test_minus_zero_is_zero():
    a, b = (plain_fabric(warp_colors=np.full((2, 3), zero)) for zero in (0.0, -0.0))
    assert a == b
    assert hash(a) == hash(b)


def test_numbers_become_tuples_of_floats():
    bsdf = pc.PlyBsdf(eta=np.float32(1.5), base_color=1, roughness=0.5, exit_roughness=[0.5, 1])
    assert bsdf.base_color == (1.0, 1.0, 1.0)
    assert bsdf.roughness == (0.5, 0.5)
    assert bsdf.exit_roughness == (0.5, 1.0)
    stored = [bsdf.eta, *bsdf.base_color, *bsdf.roughness, *bsdf.exit_roughness]
    assert {type(number) for number in stored} == {float}
    assert pc.PlyBsdf(base_color=np.array([0.1, 0.2, 0.3])).base_color == (0.1, 0.2, 0.3)


def test_the_printed_form_names_what_is_not_a_default():
    assert repr(pc.PlyBsdf()) == "PlyBsdf()"
    assert repr(pc.PlyBsdf(eta=1.5, roughness=0.4)) == "PlyBsdf(roughness=(0.4, 0.4))"
    fabric = plain_fabric(pattern=TALL, warp_colors=np.full((3, 3), 0.5))
    assert "warp_colors=<3 x 3 array>" in repr(fabric)
    assert "weft_colors" not in repr(fabric)


@pytest.mark.parametrize("plies", range(2, 13))
def test_default_plies_touch_each_other_and_the_yarn(plies):
    for pitch in (-0.3, 0.9, 1.6, 30.0):
        yarn = pc.RoundYarn(0.2, pc.PlyBsdf(), plies=plies, pitch_mm=pitch)
        # From a point of one helix to many of the next.
        turn = np.linspace(-2.0 * math.pi, 2.0 * math.pi, 400_001)
        angle = turn + 2.0 * math.pi / plies
        x = yarn.helix_radius * np.cos(angle) - yarn.helix_radius
        y, z = yarn.helix_radius * np.sin(angle), pitch * turn / (2.0 * math.pi)
        least = np.sqrt(x**2 + y**2 + z**2).min()
        assert least == pytest.approx(2.0 * yarn.ply_radius, rel=1e-5)
        assert yarn.helix_radius + yarn.ply_radius == pytest.approx(0.2, rel=1e-12)


@pytest.mark.parametrize("plies", range(2, 13))
def test_plies_of_hardly_any_twist_touch_where_the_cross_section_says(plies):
    yarn = pc.RoundYarn(0.2, pc.PlyBsdf(), plies=plies, pitch_mm=1e6)
    side = 2.0 * yarn.helix_radius * math.sin(math.pi / plies)
    assert side == pytest.approx(2.0 * yarn.ply_radius, rel=1e-6)


def test_a_pressed_yarn_is_a_round_one_stretched():
    round_yarn = pc.RoundYarn(0.2, pc.PlyBsdf(), plies=5, pitch_mm=0.9)
    pressed = replace(round_yarn, radius_mm=0.5, thickness_mm=0.4)
    assert pressed.ply_radius == pytest.approx(2.5 * round_yarn.ply_radius, rel=1e-12)
    assert pressed.helix_radius == pytest.approx(2.5 * round_yarn.helix_radius, rel=1e-12)
    assert (pressed.half_width, pressed.thickness, pressed.collision_radius) == (0.5, 0.4, 0.2)
    assert replace(pressed, collision_radius_mm=0.3).collision_radius == 0.3


def test_a_single_ply_is_the_yarn():
    yarn = pc.RoundYarn(0.2, pc.PlyBsdf(), plies=1)
    assert (yarn.ply_radius, yarn.helix_radius) == (0.2, 0.0)
    assert pc.RoundYarn(0.2, pc.PlyBsdf(), plies=1, ply_radius_mm=0.1).helix_radius == 0.0


def test_the_largest_ply_radius_can_be_named():
    yarn = pc.RoundYarn(0.2, pc.PlyBsdf())
    named = replace(yarn, ply_radius_mm=yarn.ply_radius)
    assert named.helix_radius == yarn.helix_radius


def test_yarn_lengths_that_follow_from_others():
    yarn = pc.RoundYarn(0.2, pc.PlyBsdf())
    assert yarn.pitch == pytest.approx(1.6)
    assert replace(yarn, radius_mm=0.1).pitch == pytest.approx(0.8)
    assert replace(yarn, pitch_mm=-3.0).pitch == -3.0
    assert (yarn.half_width, yarn.collision_radius) == (0.2, 0.2)
    flat = pc.FlatYarn(0.4, pc.PlyBsdf())
    assert flat.thickness == pytest.approx(0.04)
    assert flat.half_width == pytest.approx(0.2)
    assert flat.collision_radius == pytest.approx(0.02)
    assert replace(flat, thickness_mm=0.1).collision_radius == pytest.approx(0.05)


def test_spacings_of_a_fabric():
    fabric = plain_fabric(pattern=TALL, weft_spacing_mm=[0.1, 0.2, 0.3, 0.4])
    np.testing.assert_array_equal(fabric.end_spacing, [0.25, 0.25, 0.25])
    np.testing.assert_array_equal(fabric.pick_spacing, [0.1, 0.2, 0.3, 0.4])
    assert fabric.repeat_mm == pytest.approx((0.75, 1.0))
    assert fabric.unit_mm == pytest.approx(0.25)


def test_a_swatch_is_one_repeat_unless_it_has_a_size():
    fabric = plain_fabric()
    assert pc.Swatch(fabric).extent_mm == pytest.approx((0.5, 1.0))
    assert pc.Swatch(fabric, 7).extent_mm == (7.0, 7.0)
    assert pc.Swatch(fabric, (7, 8)).extent_mm == (7.0, 8.0)


def test_a_fabric_relaxes_in_units_of_its_spacing():
    flat = pc.FlatYarn(0.4, pc.PlyBsdf(), thickness_mm=0.15, stiffness=3)
    fabric = plain_fabric(weft=flat, warp_spacing_mm=[0.2, 0.3], collision_stiffness=2)
    seen = fabric.relaxed()
    assert fabric.unit_mm == pytest.approx(0.375)
    expected = pc.relax(
        fabric.pattern,
        warp_radius=0.1 / 0.375,
        weft_radius=0.075 / 0.375,
        weft_stiffness=3.0,
        collision_stiffness=2.0,
        warp_spacing=np.array([0.2, 0.3]) / 0.375,
        weft_spacing=0.5 / 0.375,
    )
    assert seen.energy == pytest.approx(expected.energy, rel=1e-9)
    for name in ("warp_height", "warp_slope", "weft_height", "weft_slope"):
        assert getattr(seen, name) == pytest.approx(getattr(expected, name), abs=1e-9), name
    assert seen.warp_spacing == pytest.approx(expected.warp_spacing)
    assert seen.weft_spacing == pytest.approx(expected.weft_spacing)


def draft(**changes):
    given = {
        "pattern": PLAIN,
        "warp_colors": np.array([[1.0, 0.5, 0.0], [0.04045, 0.02, 1.0]]),
        "weft_colors": np.ones((2, 3)),
        "warp_spacing": np.array([0.5, 0.5]),
        "weft_spacing": np.array([0.4, 0.6]),
        "warp_thickness": np.array([0.3, 0.5]),
        "weft_thickness": np.array([0.2, 0.2]),
    }
    return pc.Draft(**(given | changes))


def test_a_draft_gives_linear_colors_spacings_and_radii():
    fabric = pc.Fabric.from_draft(draft())
    # sRGB 0.5 is 0.21404 in linear light; below 0.04045 the curve is the line v / 12.92.
    expected = [[1.0, 0.2140411, 0.0], [0.0031308, 0.0015480, 1.0]]
    np.testing.assert_allclose(fabric.warp_colors, expected, atol=1e-7)
    assert fabric.warp_spacing_mm == 0.5
    np.testing.assert_array_equal(fabric.weft_spacing_mm, [0.4, 0.6])
    assert [yarn.radius_mm for yarn in fabric.warp_kinds] == pytest.approx([0.15, 0.25])
    assert [yarn.radius_mm for yarn in fabric.weft_kinds] == pytest.approx([0.1])


def test_a_draft_takes_the_yarns_it_is_given():
    yarn = pc.FlatYarn(0.3, pc.DiffuseBsdf())
    fabric = pc.Fabric.from_draft(draft(), weft=yarn)
    assert fabric.weft == yarn
    assert [end.radius_mm for end in fabric.warp] == pytest.approx([0.15, 0.25])


def test_presets_are_yarns():
    assert len(pc.presets()) == 9
    yarns = {name: pc.preset(name) for name in pc.presets()}
    assert yarns["cotton1"] == pc.RoundYarn(0.0378238, pc.PlyBsdf(), plies=3, pitch_mm=0.452737)
    clockwise = {name for name, yarn in yarns.items() if yarn.pitch < 0.0}
    assert clockwise == {"rayon1", "rayon3", "rayon4"}
    assert {name for name, yarn in yarns.items() if yarn.plies == 2} == {
        "polyester1",
        "rayon1",
        "rayon2",
        "rayon3",
        "rayon4",
    }


def test_an_environment_is_its_image_not_its_file(tmp_path):
    pytest.importorskip("plycloth.image")
    file = tmp_path / "sky.png"
    PillowImage.fromarray(np.full((2, 4, 3), 255, np.uint8)).save(file)
    loaded = pc.EnvironmentLight.load(file, scale=2.0, rotation=10.0)
    assert loaded == pc.EnvironmentLight(np.ones((2, 4, 3)), 2.0, 10.0)
    assert loaded.current_file() == file
    assert replace(loaded, image=np.zeros((2, 4, 3))).current_file() is None


def test_tiny_and_huge_vectors_have_directions():
    pc.PerspectiveCamera((0, 0, 1e-200), (0, 0, 0), up=(0, 1e200, 0))
    pc.RectangleLight((0, 0, 0), (1e-9, 0, 0), (0, 1e9, 0), 1)
    assert pc.DirectionalLight((0, 0, -1e-200), 1).direction == (0, 0, -1)
