import dataclasses
import io
import pickle

import numpy as np
import plycloth as pc
import pytest
from PIL import Image

PATTERN = pc.WeavePattern([[1, 0, 1], [0, 1, 0]])


def test_a_draft_has_defaults():
    draft = pc.Draft.from_pattern(PATTERN, warp_spacing=[0.5, 1.0, 2.0])
    assert draft.warp_colors.shape == (3, 3)
    assert draft.weft_colors.shape == (2, 3)
    assert (draft.warp_colors < draft.weft_colors[0]).all()
    assert (draft.warp_thickness == 0.8 * draft.warp_spacing).all()
    assert (draft.weft_spacing == [1.0, 1.0]).all()
    assert (draft.title, draft.notes) == ("", "")


def test_a_draft_is_a_value():
    draft = pc.Draft.from_pattern(PATTERN, title=" Twill ", notes="one \r\n\n two\n")
    assert (draft.title, draft.notes) == ("Twill", "one\n\ntwo")
    assert repr(draft) == "Draft('Twill', 2 picks x 3 ends)"
    assert repr(pc.Draft.from_pattern(PATTERN)) == "Draft(2 picks x 3 ends)"
    copy = pickle.loads(pickle.dumps(draft))
    assert copy == draft
    assert hash(copy) == hash(draft)
    assert not copy.warp_colors.flags.writeable
    assert draft != 1
    with pytest.raises(dataclasses.FrozenInstanceError):
        draft.title = "Other"
    with pytest.raises(ValueError, match="read-only"):
        draft.warp_spacing[0] = 2


@pytest.mark.parametrize(
    "change",
    [
        {"pattern": PATTERN.flipped()},
        {"warp_colors": np.full((3, 3), 0.3)},
        {"weft_colors": np.full((2, 3), 0.3)},
        {"warp_spacing": np.full(3, 0.7)},
        {"weft_spacing": np.full(2, 0.7)},
        {"warp_thickness": np.full(3, 0.7)},
        {"weft_thickness": np.full(2, 0.7)},
        {"title": "Other"},
        {"notes": "Other"},
    ],
)
def test_every_field_counts_when_drafts_are_compared(change):
    draft = pc.Draft.from_pattern(PATTERN)
    assert dataclasses.replace(draft, **change) != draft


def test_minus_zero_is_zero():
    plus, minus = (pc.Draft.from_pattern(PATTERN, warp_colors=[z, 1, 1]) for z in (0.0, -0.0))
    assert plus == minus
    assert hash(plus) == hash(minus)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"pattern": PATTERN.warp_up}, TypeError, "must be a WeavePattern, not a ndarray"),
        ({"warp_colors": [0.1, 0.2]}, ValueError, r"warp_colors must be of shape \(3, 3\)"),
        ({"warp_colors": np.zeros((2, 3))}, ValueError, "warp_colors must be of shape"),
        ({"weft_colors": [0, 0, 1.01]}, ValueError, r"weft_colors must be in \[0, 1\]"),
        ({"weft_colors": [0, 0, np.nan]}, ValueError, r"weft_colors must be in \[0, 1\]"),
        ({"weft_colors": "red"}, ValueError, "weft_colors must hold real numbers"),
        ({"warp_spacing": 0.0}, ValueError, "warp_spacing must be finite and above 0"),
        ({"weft_spacing": -1}, ValueError, "weft_spacing must be finite and above 0"),
        ({"weft_spacing": np.inf}, ValueError, "weft_spacing must be finite and above 0"),
        ({"warp_thickness": [1, 1, np.nan]}, ValueError, "warp_thickness must be finite"),
        ({"weft_thickness": [1, 1, 1]}, ValueError, r"weft_thickness must be of shape \(2,\)"),
        ({"title": "two\nlines"}, ValueError, "title must be one line"),
        ({"title": 3}, TypeError, "title must be text"),
        ({"notes": None}, TypeError, "notes must be text"),
    ],
)
def test_bad_drafts(change, error, message):
    with pytest.raises(error, match=message):
        pc.Draft.from_pattern(**{"pattern": PATTERN, **change})


def test_the_drawdown_has_the_colours_of_the_yarns():
    warp = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255]])
    weft = np.array([[10, 20, 30], [200, 210, 220]])
    draft = pc.Draft.from_pattern(PATTERN, warp_colors=warp / 255, weft_colors=weft / 255)
    shown = np.asarray(Image.open(io.BytesIO(draft._repr_png_())))[8::16, 8::16]
    assert (shown[0] == [warp[0], weft[0], warp[2]]).all()
    assert (shown[1] == [weft[1], warp[1], weft[1]]).all()


def padded(before, after, *, picks_up=False, ends_up=False):
    """Return a 2/1 twill of 3 x 6 between threads that hold nothing, all up or all down."""
    twill = np.tile(pc.WeavePattern.twill(2, 1).warp_up, (1, 2))
    margins = [(before, after), (after, before)]
    wide = np.pad(twill, [(0, 0), margins[0]], constant_values=ends_up)
    return twill, np.pad(wide, [margins[1], (0, 0)], constant_values=picks_up)


@pytest.mark.parametrize("picks_up", [False, True])
@pytest.mark.parametrize("ends_up", [False, True])
@pytest.mark.parametrize(("before", "after"), [(0, 3), (2, 0), (1, 2)])
def test_threads_that_interlace_with_nothing_are_trimmed(before, after, picks_up, ends_up):
    twill, weave = padded(before, after, picks_up=picks_up, ends_up=ends_up)
    picks, ends = weave.shape
    draft = pc.Draft.from_pattern(
        pc.WeavePattern(weave),
        warp_spacing=np.arange(1.0, ends + 1),
        weft_colors=np.linspace(0, 1, 3 * picks).reshape(picks, 3),
        title="padded",
    )
    trimmed = draft.trimmed()
    assert (trimmed.pattern.warp_up == twill).all()
    assert (trimmed.warp_spacing == np.arange(1.0, ends + 1)[before : before + 6]).all()
    assert (trimmed.weft_colors == draft.weft_colors[after : after + 3]).all()
    assert trimmed.title == "padded"
    assert trimmed.trimmed() is trimmed


def test_threads_between_others_stay_and_nothing_is_left_of_nothing():
    gap = pc.WeavePattern([[1, 0, 0], [0, 0, 1]])
    for weave in (gap, pc.WeavePattern(np.ones((4, 5))), pc.WeavePattern(np.tri(5))):
        draft = pc.Draft.from_pattern(weave)
        assert draft.trimmed() is draft


def test_mirrored_ends_are_the_same_ends_from_the_right():
    draft = pc.Draft.from_pattern(
        pc.WeavePattern([[1, 0, 0], [0, 1, 0]]),
        warp_colors=[[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        warp_spacing=[1.0, 2.0, 3.0],
        warp_thickness=[0.1, 0.2, 0.3],
        weft_spacing=[4.0, 5.0],
        title="kept",
    )
    turned = draft.mirrored()
    assert np.array_equal(turned.pattern.warp_up, [[0, 0, 1], [0, 1, 0]])
    assert np.array_equal(turned.warp_colors, draft.warp_colors[::-1])
    assert turned.warp_spacing.tolist() == [3.0, 2.0, 1.0]
    assert turned.warp_thickness.tolist() == [0.3, 0.2, 0.1]
    assert turned.weft_spacing.tolist() == [4.0, 5.0]
    assert turned.title == "kept"
    assert turned.mirrored() == draft


RED, GREEN, BLUE = [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]


def test_a_colour_is_changed_wherever_it_is():
    draft = pc.Draft.from_pattern(
        pc.WeavePattern.twill(2, 1), warp_colors=[GREEN, RED, GREEN], weft_colors=[RED, BLUE, RED]
    )
    assert draft.colors.tolist() == [GREEN, RED, BLUE]
    changed = draft.recolored({2: "#3366CC", 1: (0.5, 0.5, 0.5)})
    grey, blue = [0.5, 0.5, 0.5], [0.2, 0.4, 0.8]
    assert changed.warp_colors.tolist() == [grey, blue, grey]
    assert changed.weft_colors.tolist() == [blue, BLUE, blue]
    # Each number is that of the draft before, so that two colours can change places.
    swapped = draft.recolored({1: RED, 2: GREEN})
    assert swapped.warp_colors.tolist() == [RED, GREEN, RED]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({4: RED}, r"no colour 4: it has 1 #333333, 2 #e6e6e6$"),
        ({0: RED}, "no colour 0"),
        ({1: "#12345"}, "# and six hexadecimal digits, not '#12345'"),
        ({1: "red"}, "not 'red'"),
        ({1: (2.0, 0.0, 0.0)}, r"a colour must be in \[0, 1\]"),
    ],
)
def test_bad_colours_are_named(changes, message):
    with pytest.raises(ValueError, match=message):
        pc.Draft.from_pattern(pc.WeavePattern.plain()).recolored(changes)


def test_recoloring_takes_a_mapping():
    with pytest.raises(TypeError, match="changes must be a mapping of numbers to colours"):
        pc.Draft.from_pattern(pc.WeavePattern.plain()).recolored(["#aa3322"])
