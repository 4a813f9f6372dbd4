"""What is told apart by its type is never taken for something that it only looks like."""

from copy import copy
from types import SimpleNamespace

import numpy as np
import plycloth as pc
import pytest
from plycloth import mitsuba
from plycloth.shared_cloth import compiled_scene
from samples import plain_fabric

SCENE = pc.overview(plain_fabric(), width=4)


def look_alike(value, *names, **more):
    """An object with attributes of a description, but of another type."""
    return SimpleNamespace(**{name: getattr(value, name) for name in names}, **more)


def scene(**changes):
    names = {"swatch", "camera", "lights"} - set(changes)
    return look_alike(SCENE, *names, **changes)


def fabric_with(**changes):
    fabric = plain_fabric()
    names = {name for name in dir(fabric) if not name.startswith("_")} - set(changes)
    swatch = look_alike(SCENE.swatch, "extent_mm", fabric=look_alike(fabric, *names, **changes))
    return scene(swatch=swatch)


def yarn(**changes):
    own = plain_fabric().warp
    names = {name for name in dir(own) if not name.startswith("_")} - set(changes)
    return look_alike(own, *names, **changes)


def yarn_of(bsdf):
    made = copy(plain_fabric().warp)
    object.__setattr__(made, "bsdf", bsdf)
    return made


LIGHTS = "PointLight or DirectionalLight or RectangleLight or ConstantLight or EnvironmentLight"
NOT = "not a value of type SimpleNamespace"
LAMP = SimpleNamespace(radiance=(1.0, 1.0, 1.0), position=(0.0, 0.0, 1.0), beam=3)
CAMERA = look_alike(SCENE.camera, "origin", "target", "up", "resolution", "width_mm", fov=30.0)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (
            scene(lights=[pc.ConstantLight(1), LAMP]),
            rf"Scene\.lights\[1\] must be a {LIGHTS}, {NOT}",
        ),
        (scene(camera=CAMERA), rf"Scene\.camera must be a Persp\w+ or Ortho\w+, {NOT}"),
        (
            fabric_with(weft_kinds=(yarn(),)),
            rf"Fabric\.weft must be a RoundYarn or FlatYarn, {NOT}",
        ),
        (
            fabric_with(warp_kinds=(plain_fabric().warp, yarn())),
            rf"Fabric\.warp_kinds\[1\] must be a RoundYarn or FlatYarn, {NOT}",
        ),
        (
            fabric_with(warp_kinds=(yarn_of(LAMP),)),
            rf"Fabric\.warp\.bsdf must be a PlyBsdf or DiffuseBsdf, {NOT}",
        ),
    ],
    ids=["light", "camera", "yarn", "kind", "bsdf"],
)
def test_the_core_takes_no_look_alikes(given, message):
    with pytest.raises(TypeError, match=message):
        compiled_scene(given)


class Sun(pc.DirectionalLight):
    pass


def test_what_could_not_be_loaded_is_not_saved(tmp_path):
    scene = pc.Scene(SCENE.swatch, SCENE.camera, [Sun((0, 0, -1), 1.0)])
    with pytest.raises(TypeError, match=r"save takes one of .*, not a value of type Sun"):
        pc.save(scene, tmp_path / "scene.json")
    assert not list(tmp_path.iterdir())


def test_kinds_that_extend_known_ones_are_those():
    suns = pc.Scene(SCENE.swatch, SCENE.camera, [Sun((0, 0, -1), 1.0)])
    plain = pc.Scene(SCENE.swatch, SCENE.camera, [pc.DirectionalLight((0, 0, -1), 1.0)])
    assert np.array_equal(pc.render(suns, spp=1), pc.render(plain, spp=1))


@pytest.mark.parametrize("lights", [pc.ConstantLight(1), LAMP, 3, [LAMP], (LAMP,)])
def test_overview_says_what_lights_are(lights):
    with pytest.raises(TypeError, match=r"lights?(\[0\])? must be"):
        pc.overview(plain_fabric(), lights)


def test_a_scene_takes_no_look_alikes():
    with pytest.raises(TypeError, match=r"Scene\.lights\[0\] must be a PointLight or"):
        pc.Scene(SCENE.swatch, SCENE.camera, [LAMP])
    with pytest.raises(TypeError, match=r"Scene\.camera must be a"):
        pc.Scene(SCENE.swatch, CAMERA, SCENE.lights)


def test_mitsuba_is_told_of_no_look_alikes():
    pytest.importorskip("mitsuba")
    with pytest.raises(TypeError, match=rf"camera must be a .*OrthographicCamera, {NOT}"):
        mitsuba.camera(CAMERA)
    with pytest.raises(TypeError, match=rf"light must be a {LIGHTS}, {NOT}"):
        mitsuba.light(LAMP)
