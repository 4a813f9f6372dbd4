"""Reading WIF whose colours, lengths or numbering cannot be taken at their word."""

import re

import numpy as np
import plycloth as pc
import pytest
from wif_text import BLUE, GREEN, LIFTPLAN, RED, TWILL, read

__all__ = ["read"]  # a fixture

# What is changed, where that is a guess, what is wrong there, what is taken: the warp's and the
# weft's colours, spacings and thicknesses.
DEFAULT_WARP, DEFAULT_WEFT = (0.2, 0.2, 0.2), (0.9, 0.9, 0.9)
WARP_IN = TWILL["WARP"].replace("Centimeters", "{}").format
SPACED = TWILL["WARP"].replace("Spacing=0.1", "Spacing={}").format
THICK = TWILL["WARP"].replace("Thickness=0.08", "Thickness={}").format
GUESSED = [
    (
        {"WARP": TWILL["WARP"][len("Threads=4\n") :], "THREADING": "0=1\n1=2\n2=3\n3=4"},
        ("THREADING", None, None),
        "counted from 0 and there is none at 4",
        {},
    ),
    (
        {"WARP": TWILL["WARP"].replace("Color=1", "Color=9")},
        ("WARP", "Color", 9),
        "no colour 9 .* from 1 to 3",
        {"warp_colors": DEFAULT_WARP},
    ),
    (
        {"WARP": TWILL["WARP"].replace("Color=1", "Color=red")},
        ("WARP", "Color", 9),
        "must be numbers",
        {"warp_colors": DEFAULT_WARP},
    ),
    (
        {"WEFT": TWILL["WEFT"].replace("Color=2", "Color=NaN")},
        ("WEFT", "Color", 15),
        "must be finite",
        {"weft_colors": DEFAULT_WEFT},
    ),
    ({"WEFT COLORS": "2=0"}, ("WEFT COLORS", "2", 42), "no colour 0 in", {}),
    (
        {"WEFT COLORS": "2=4\n3=3\n4=5"},
        ("WEFT COLORS", "2", 42),
        r"colour 4 in .*from 1 to 3 \(and 1 more lines\): the default is taken",
        {"weft_colors": [GREEN, GREEN, BLUE, GREEN]},
    ),
    ({"WEFT COLORS": "2=1.5"}, ("WEFT COLORS", "2", 42), "no colour 1.5 in", {}),
    ({"WEFT COLORS": "2=-1"}, ("WEFT COLORS", "2", 42), "no colour -1 in", {}),
    ({"WEFT COLORS": "2=1,2"}, ("WEFT COLORS", "2", 42), "must be index or index,R,G,B", {}),
    ({"WEFT COLORS": "2=red"}, ("WEFT COLORS", "2", 42), "must be numbers, not 'red'", {}),
    (
        {"WARP COLORS": "1=NaN\n2=NaN\n3=3\n4=NaN"},
        ("WARP COLORS", "1", 42),
        r"finite, not 'NaN' \(and 2 more lines\)",
        {"warp_colors": [RED, RED, BLUE, RED]},
    ),
    ({"WARP COLORS": "2=1,255,0,0,0"}, ("WARP COLORS", "2", 42), "must be index or", {}),
    ({"WARP COLORS": "2=3,,"}, ("WARP COLORS", "2", 42), "must be numbers, not '3,,'", {}),
    ({"WARP COLORS": "2=" + 500 * "9"}, ("WARP COLORS", "2", 42), "too large or too small", {}),
    (
        {"COLOR TABLE": None, "WARP COLORS": "3=1"},
        ("WARP COLORS", "3", 38),
        r"there is no \[COLOR TABLE\]",
        {"warp_colors": DEFAULT_WARP, "weft_colors": DEFAULT_WEFT},
    ),
    (
        {"COLOR TABLE": None},
        ("WARP", "Color", 9),
        r"there is no \[COLOR TABLE\]",
        {"warp_colors": DEFAULT_WARP, "weft_colors": DEFAULT_WEFT},
    ),
    (
        {"COLOR TABLE": "1=1,2\n2=0,255,0"},
        ("COLOR TABLE", "1", 23),
        "must be R,G,B, not '1,2': there is no such colour",
        {"warp_colors": DEFAULT_WARP},
    ),
    (
        {"COLOR TABLE": "1=a,b,c\n2=0,255,0"},
        ("COLOR TABLE", "1", 23),
        "must be numbers",
        {"warp_colors": DEFAULT_WARP},
    ),
    (
        {"COLOR TABLE": "1=#ff0000\n2=0,255,0"},
        ("COLOR TABLE", "1", 23),
        "must be numbers",
        {"warp_colors": DEFAULT_WARP},
    ),
    (
        {"COLOR TABLE": "1=NaN,0,0\n2=0,255,0"},
        ("COLOR TABLE", "1", 23),
        "must be finite",
        {"warp_colors": DEFAULT_WARP},
    ),
    (
        {"COLOR TABLE": "1=1e9999999,0,0\n2=0,255,0"},
        ("COLOR TABLE", "1", 23),
        "too large or too small",
        {"warp_colors": DEFAULT_WARP},
    ),
    ({"COLOR TABLE": "1=255,0,0\n2=0,255,0\n3=x"}, ("COLOR TABLE", "3", 25), "must be numbers", {}),
    (
        {"COLOR PALETTE": "Range=255"},
        ("COLOR PALETTE", "Range", 20),
        "lowest,highest, not '255': 0,255 is taken",
        {},
    ),
    ({"COLOR PALETTE": "Range=9,9"}, ("COLOR PALETTE", "Range", 20), "lowest,highest", {}),
    ({"COLOR PALETTE": "Range=255,0"}, ("COLOR PALETTE", "Range", 20), "lowest,highest", {}),
    ({"COLOR PALETTE": "Range=0-255"}, ("COLOR PALETTE", "Range", 20), "must be numbers", {}),
    ({"COLOR PALETTE": "Range=0,NaN"}, ("COLOR PALETTE", "Range", 20), "must be finite", {}),
    (
        {"PRIVATE PLYCLOTH COLORS": "1=x"},
        ("PRIVATE PLYCLOTH COLORS", "1", 42),
        "must be numbers",
        {},
    ),
    ({"WARP SPACING": "2=1e-99999999"}, ("WARP SPACING", "2", 42), "too large or too small", {}),
    ({"WARP SPACING": "2=-1"}, ("WARP SPACING", "2", 42), "one number of at least 0", {}),
    (
        {"WARP SPACING": "2=0,1"},
        ("WARP SPACING", "2", 42),
        "one number of at least 0, not '0,1': the default",
        {},
    ),
    (
        {"WARP SPACING": "1=0.3\n2=0,1\n3=0,2"},
        ("WARP SPACING", "2", 43),
        r"\(and 1 more lines\)",
        {"warp_spacing": [3, 1, 1, 1]},
    ),
    ({"WARP THICKNESS": "2=wide"}, ("WARP THICKNESS", "2", 42), "must be numbers", {}),
    ({"WARP THICKNESS": "2=inf"}, ("WARP THICKNESS", "2", 42), "must be finite", {}),
    ({"WARP THICKNESS": "2=1e400"}, ("WARP THICKNESS", "2", 42), "is too large", {}),
    (
        {"WARP": SPACED("0,1")},
        ("WARP", "Spacing", 11),
        "one number of at least 0, not '0,1': it is taken for not given",
        {},
    ),
    ({"WARP": SPACED("NaN")}, ("WARP", "Spacing", 11), "must be finite", {}),
    ({"WARP": SPACED("0.1 cm")}, ("WARP", "Spacing", 11), "must be numbers", {}),
    ({"WARP": THICK("0,08")}, ("WARP", "Thickness", 12), "one number of at least 0", {}),
    ({"WARP": THICK("-1")}, ("WARP", "Thickness", 12), "one number of at least 0", {}),
    (
        {"WARP": WARP_IN("mm")},
        ("WARP", "Units", 10),
        "Decipoints, Inches or Centimeters, not 'mm': no spacing or",
        {},
    ),
    ({"WARP": WARP_IN("Ells"), "WARP SPACING": "1=7"}, ("WARP", "Units", 10), "not 'Ells'", {}),
    (
        {"LIFTPLAN": "1=1,2\n2=1\n4=2"},
        ("LIFTPLAN", "2", 43),
        "disagrees .* as the first of 2 picks: the tie-up and treadling are taken",
        {},
    ),
    (
        {"LIFTPLAN": "1=one"},
        ("LIFTPLAN", "1", 42),
        "whole numbers .* the tie-up and treadling are taken",
        {},
    ),
    (
        {"THREADING": "0=1\n1=2\n2=3\n3=4"},
        ("THREADING", None, None),
        "counted from 0 and there is none at 4: each is taken for the next",
        {},
    ),
    ({"TREADLING": "0=1\n1=2\n2=3\n3=4"}, ("TREADLING", None, None), "counted from 0", {}),
    (
        {"TIEUP": "0=1,2\n1=1,4\n2=3,4\n3=2,3"},
        ("TIEUP", None, None),
        "counted from 0 and there is none at 4",
        {},
    ),
    (
        {"TIEUP": "0=1,2\n1=1,4\n2=3,4\n3=2,3", "TREADLING": "1=0\n2=1\n3=2\n4=3"},
        ("TIEUP", None, None),
        r"0 in \[TREADLING\] is taken for the first treadle",
        {},
    ),
    (
        {"TIEUP": "1=0,1\n2=0,3\n3=2,3\n4=1,2", "THREADING": "0=0\n1=1\n2=2\n3=3"},
        ("THREADING", None, None),
        "shafts are counted from 0, as are rows: 0 is taken for a shaft",
        {},
    ),
    (
        {**LIFTPLAN, "LIFTPLAN": "0=1,2\n1=1,4\n2=3,4\n3=2,3"},
        ("LIFTPLAN", None, None),
        "counted from 0",
        {},
    ),
    (
        {"WARP COLORS": "0=3\n2=2"},
        ("WARP COLORS", None, None),
        "counted from 0",
        {"warp_colors": [BLUE, RED, GREEN, RED]},
    ),
    ({"WARP": SPACED("0")}, ("WARP", "Spacing", 11), "is 0: it is taken for not given", {}),
    (
        {"WEFT THICKNESS": "2=0"},
        ("WEFT THICKNESS", "2", 42),
        "is 0: the default is taken",
        {},
    ),
    (
        {"WEAVING": "Shafts=3\nTreadles=4\nRising Shed=true"},
        ("THREADING", "4", 30),
        "shaft 4 is beyond Shafts=3: it is taken for one more",
        {},
    ),
    (
        {"WEAVING": "Shafts=4\nTreadles=3\nRising Shed=true"},
        ("TREADLING", "4", 40),
        "treadle 4 is beyond Treadles=3: it is taken as tied up",
        {},
    ),
    (
        {"WEFT COLORS": "5=1"},
        ("WEFT COLORS", "5", 42),
        "not the number of a row from 1 to 4: left out",
        {},
    ),
    (
        {"WEFT SPACING": "0=0.3"},
        ("WEFT SPACING", None, None),
        "counted from 0",
        {"weft_spacing": [3, 2, 2, 2]},
    ),
]


@pytest.mark.parametrize(("changes", "place", "message", "taken"), GUESSED)
def test_what_cannot_be_read_beside_the_weave_is_guessed_with_a_warning(
    read, changes, place, message, taken
):
    with pytest.warns(pc.WifWarning) as caught:
        draft = read(changes)
    messages = [str(one.message) for one in caught]
    assert any(re.search(message, one) for one in messages), messages
    for name, value in vars(read({})).items():
        stored = getattr(draft, name)
        if isinstance(stored, np.ndarray):
            expected = np.broadcast_to(taken.get(name, value), stored.shape)
            assert stored == pytest.approx(expected, rel=1e-12), name
        else:
            assert stored == value


@pytest.mark.parametrize(("changes", "place"), [case[:2] for case in GUESSED])
def test_strictly_it_is_an_error_with_its_place(read, changes, place):
    with pytest.raises(pc.WifError) as caught:
        read(changes, strict=True)
    assert (caught.value.section, caught.value.key, caught.value.line) == place


def test_strictly_the_twill_reads_as_ever(read):
    assert read({}, strict=True) == read({})
    with pytest.raises(TypeError, match="strict must be a bool"):
        read({}, strict="no")


@pytest.mark.parametrize(
    "changes",
    [
        {"WARP": TWILL["WARP"] + "\nSpacing Zoom=3"},
        {"WEFT": TWILL["WEFT"] + "\nThickness Zoom=2"},
        {"WARP SPACING ZOOM": "1=2\n2=3"},
        {"WEFT THICKNESS ZOOM": "1=2"},
    ],
)
@pytest.mark.parametrize("strict", [False, True])
def test_zooms_are_not_applied_with_a_warning(read, changes, strict):
    with pytest.warns(pc.WifWarning, match="Z.*: zooms are not applied: .* taken as it is"):
        assert read(changes, strict=strict) == read({})


def test_a_table_counted_from_zero_names_colours_by_its_rows(read):
    table = {"COLOR TABLE": "0=51,102,204\n1=255,0,0\n2=0,255,0", "WARP COLORS": "4=0"}
    with pytest.warns(pc.WifWarning, match="counted from 0: colour 0 is that of row 0"):
        draft = read(table)
    assert (draft.warp_colors == [RED, RED, RED, BLUE]).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"THREADING": "1=1\n2=" + 500 * "x"},
        {"THREADING": "1=1\n2=" + 500 * "\x01"},
        {"THREADING": "1=1\n2=" + 500 * "'"},
        {"WARP": "Threads=" + 500 * "9"},
        {"WEAVING": "Rising Shed=" + 500 * "y"},
        {"WARP COLORS": "1=" + 500 * "x"},
        {"WARP COLORS": "1=" + ",".join(500 * ["1"])},
        {"COLOR TABLE": "1=" + 500 * "1"},
        {"COLOR PALETTE": "Range=" + 500 * "z"},
        {"WARP": WARP_IN(500 * "z")},
        {"WARP": SPACED(500 * "1,")},
        {"WARP": SPACED(50 * "1" + 500 * "0")},
    ],
)
@pytest.mark.filterwarnings("ignore::plycloth.WifWarning")
def test_errors_quote_80_characters(read, changes, tmp_path):
    with pytest.raises(pc.WifError) as caught:
        read(changes, strict=True)
    message = str(caught.value).removeprefix(str(tmp_path))
    assert len(message) < 190
    assert "..." in message


def test_warnings_quote_names_in_part(read):
    with pytest.warns(pc.WifWarning) as caught:
        read({"THREADING": TWILL["THREADING"] + "\n" + 500 * "k" + "=1"})
    assert "[THREADING] kkk" in str(caught[0].message)
    assert len(str(caught[0].message).rpartition("draft.wif")[2]) < 190


def test_none_stays_none_where_the_last_shaft_is_named(read):
    changes = {"THREADING": "0=1\n1=0\n2=3\n3=4", "TIEUP": "1=0,1\n2=0\n3=3\n4=4"}
    with pytest.warns(pc.WifWarning, match="counted from 0"):
        draft = read(changes)
    assert str(draft.pattern).split() == ["#...", "....", "..#.", "...#"]
