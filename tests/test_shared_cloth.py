"""Cloth is relaxed once for all that share it."""

import gc
from dataclasses import replace
from weakref import WeakValueDictionary

import numpy as np
import plycloth as pc
import pytest
from plycloth import _plycloth, shared_cloth
from samples import plain_fabric

QUICK = {"spp": 1, "progress": False}


@pytest.fixture
def relaxations(monkeypatch):
    """The fabrics that were relaxed since."""
    fabrics = []

    def relax(fabric, threads=None, progress=None):
        # A copy, which does not hold the cloth.
        fabrics.append(replace(fabric))
        return _plycloth.CompiledCloth(fabric, threads, progress)

    module = type("Core", (), {**vars(_plycloth), "CompiledCloth": staticmethod(relax)})
    monkeypatch.setattr(shared_cloth, "_plycloth", module)
    # Whatever other tests still hold.
    monkeypatch.setattr(shared_cloth, "_shared", WeakValueDictionary())
    return fabrics


def twill(**changes):
    """A fabric that no other test has."""
    yarn = pc.RoundYarn(0.0411, pc.PlyBsdf(), plies=2)
    given = {"pattern": pc.WeavePattern.twill(2, 1), "warp": yarn, "weft": yarn}
    return pc.Fabric(**given | {"warp_spacing_mm": 0.2, "weft_spacing_mm": 0.21} | changes)


def view(fabric, light="day", **given):
    return pc.overview(fabric, light, **{"size_mm": 1.0, "width": 8, **given})


def test_optics_colours_lights_and_sizes_relax_nothing_again(relaxations):
    fabric = twill()
    pc.render(view(fabric), **QUICK)
    red = replace(fabric.warp, bsdf=pc.PlyBsdf(base_color=(0.9, 0.1, 0.1)))
    for other in (replace(fabric, warp=red), replace(fabric, warp_colors=np.full((3, 3), 0.5))):
        pc.render(view(other, "back", size_mm=(2.0, 1.5), width=12), **QUICK)
        other.overlaps()
        other.relaxed()
    assert relaxations == [fabric]


@pytest.mark.parametrize(
    "change",
    [
        {"weft_spacing_mm": 0.22},
        {"collision_stiffness": 50.0},
        {"pattern": pc.WeavePattern.twill(1, 2)},
        {"warp": pc.RoundYarn(0.04, pc.PlyBsdf(), plies=2)},
        {"weft": pc.RoundYarn(0.0411, pc.PlyBsdf(), plies=3)},
        {"weft": pc.RoundYarn(0.0411, pc.PlyBsdf(), plies=2, pitch_mm=1.0)},
        {"weft": pc.RoundYarn(0.0411, pc.PlyBsdf(), plies=2, stiffness=2.0)},
        {"weft": pc.FlatYarn(0.1, pc.PlyBsdf(), thickness_mm=0.08)},
    ],
)
def test_another_cloth_is_relaxed_itself(change, relaxations):
    fabric, other = twill(), twill(**change)
    for each in (fabric, other):
        pc.render(view(each), **QUICK)
    assert relaxations == [fabric, other]


def test_shared_cloth_renders_as_its_own(relaxations):
    fabric = twill()
    pc.render(view(fabric), **QUICK)
    dyed = replace(fabric, weft_colors=np.full((3, 3), 0.25))
    shared = pc.render(view(dyed), **QUICK)
    assert len(relaxations) == 1
    del fabric, dyed
    gc.collect()
    own = pc.render(view(twill(weft_colors=np.full((3, 3), 0.25))), **QUICK)
    # What nobody holds any more was let go.
    assert len(relaxations) == 2
    assert np.array_equal(shared.pixels, own.pixels)


def test_a_fit_relaxes_once(relaxations):
    fabric = twill()
    scenes = [pc.photo_rig(fabric, side, resolution=(16, 16)) for side in ("front", "back")]
    targets = [np.full((16, 16, 3), 0.3)] * 2
    found = pc.fit(
        scenes,
        targets,
        free=["base_color"],
        objective="average",
        paths=4,
        rounds=2,
        evaluations=2,
        progress=False,
    )
    found.predict(scenes[0], 4, paths=4)
    pc.render(scenes[1], **QUICK)
    assert relaxations == [fabric]


def test_heights_are_saved_and_relax_nothing(relaxations, tmp_path):
    fabric = twill(warp_colors=np.linspace(0, 1, 9).reshape(3, 3))
    expected = pc.render(view(fabric), **QUICK)
    known = replace(fabric, heights=fabric.relaxed())
    known.save(tmp_path / "known.json")
    del fabric
    gc.collect()
    loaded = pc.Fabric.load(tmp_path / "known.json")
    assert loaded == known
    assert loaded.relaxed() == known.heights
    assert np.array_equal(pc.render(view(loaded), **QUICK).pixels, expected.pixels)
    # Heights that are known cost no work, though they are read.
    assert [each.heights is None for each in relaxations] == [True, False]


def test_heights_are_taken_as_they_are():
    fabric = twill()
    heights = fabric.relaxed()
    flat = replace(heights, warp_height=0 * heights.warp_height, warp_slope=0 * heights.warp_slope)
    changed = replace(fabric, heights=flat)
    assert changed.relaxed() == flat
    assert changed.overlaps().worst > 0.1
    # They stay with yarns that do.
    thin = pc.RoundYarn(0.02, pc.PlyBsdf())
    slack = twill(warp=thin, weft=thin)
    kept = replace(slack, heights=slack.relaxed())
    assert kept.fitted() == kept
    assert replace(kept, warp=pc.RoundYarn(0.09, pc.PlyBsdf())).fitted().heights is None


def test_heights_turn_over_with_the_cloth():
    fabric = twill(weft_spacing_mm=np.array([0.2, 0.21, 0.25]))
    turned = replace(fabric, heights=fabric.relaxed()).turned_over()
    again = fabric.turned_over().relaxed()
    for name in ("warp_height", "warp_slope", "weft_height", "weft_slope", "warp_spacing"):
        assert getattr(turned.heights, name) == pytest.approx(getattr(again, name), abs=1e-6)


def test_heights_of_another_pattern_are_refused():
    heights = plain_fabric().relaxed()
    with pytest.raises(pc.ParameterError, match=r"heights\.warp_height must be 3 x 6 .* not 2 x 4"):
        twill(heights=heights)
    with pytest.raises(TypeError, match=r"Fabric\.heights must be a Relaxed"):
        twill(heights=np.zeros((3, 6)))


def test_heights_of_another_cloth_are_refused():
    fabric = twill()
    known = replace(fabric, heights=fabric.relaxed())
    with pytest.raises(pc.ParameterError, match=r"warp_spacing must be that of the fabric"):
        replace(known, warp_spacing_mm=np.array([0.1, 0.2, 0.3]))
    with pytest.raises(pc.ParameterError, match=r"heights must have the yarn on top .* at 3 cross"):
        replace(known, pattern=pc.WeavePattern.twill(1, 2))
    with pytest.raises(pc.ParameterError, match=r"warp_height\[0, 0\] must be in \[-1000, 1000\]"):
        replace(fabric.relaxed(), warp_height=np.full((3, 6), 1e9))
