"""Reading WIF: made-up files here, other people's files in test_wif_data."""

import pickle
import re

import numpy as np
import plycloth as pc
import pytest
import wif_text
from wif_text import BLUE, GREEN, LIFTPLAN, RED, TWILL, read, text_of

__all__ = ["read"]  # a fixture


def rows(draft: pc.Draft) -> str:
    return str(draft.pattern).replace("\n", " ")


def test_the_twill_reads_without_a_warning(read):
    draft = read({})
    assert draft == pc.Draft.from_pattern(
        pc.WeavePattern.twill(2, 2),
        warp_colors=RED,
        weft_colors=GREEN,
        warp_spacing=1.0,
        weft_spacing=2.0,
        warp_thickness=0.8,
        weft_thickness=1.6,
    )


@pytest.mark.parametrize(
    "text",
    [
        text_of().replace("\n", "\r\n"),
        text_of().replace("\n", "\r"),
        text_of().replace("=", " = ").replace(",", " , ").replace("\n", " \n\n"),
        text_of().upper(),
        text_of().lower(),
        text_of().replace("[", "  [ ").replace("]", " ] ; section").replace(" SHED", "   Shed"),
        text_of().replace("\n", "; note, 1\n").replace("]; note, 1", "]"),
        ";=[\n" + text_of().replace("\n", "\n; a comment = 1\n"),
        text_of({"WIF": None}),
        text_of({"WIF": "Version=99 beta"}),
        text_of({"CONTENTS": "TIEUP=false\nLIFTPLAN=true\nTREADLING=no\nWARP=0"}),
        text_of({"PRIVATE STUFF": "1\nanything\n=\n1=2\n1=3", "WARP SYMBOLS": "junk"}),
        text_of({"LIFTPLAN": "1=2,1\n3=3,4,9\n4=2,3"}),
        text_of({"LIFTPLAN": "; nothing"}),
        text_of(LIFTPLAN),
        text_of({**LIFTPLAN, "TREADLING": "1=3"}),
        text_of({**LIFTPLAN, "TIEUP": "1=3"}),
        text_of({"TREADLING": None}) + "[TREADLING]\n4=4\n02=2\n1=1\n3=3\n",
        text_of({"WEAVING": "Shafts=4\nTreadles=4"}),
        text_of({"WEAVING": None}),
        text_of({"COLOR PALETTE": None}),
        text_of({"COLOR TABLE": TWILL["COLOR TABLE"] + "\n7=\n9=1,2,3"}),
        text_of({"TIEUP": "1=1 2\n2=4,1,,0\n3=3,4,4\n4=2,3,99"}),
        "\n".join(f"[{name}]\n{rows}" for name, rows in reversed(TWILL.items())),
    ],
)
def test_the_twill_in_other_writings(read, text):
    assert read(text) == read({})


@pytest.mark.parametrize("word", ["true", "on", "yes", "1", "TRUE", "Yes ; rising"])
def test_rising_sheds(read, word):
    assert rows(read({"WEAVING": f"Rising Shed={word}"})) == "##.. #..# ..## .##."


@pytest.mark.parametrize("changes", [{}, LIFTPLAN])
@pytest.mark.parametrize("word", ["false", "off", "no", "0", "False ; sinking"])
def test_sinking_sheds_flip_the_drawdown(read, word, changes):
    assert rows(read({**changes, "WEAVING": f"Rising Shed={word}"})) == "..## .##. ##.. #..#"


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"TREADLING": "1=1,3\n2=0\n3=\n4=2,0,4"}, "#### .... .... ####"),
        ({"THREADING": "1=1,3\n2=0\n3=\n4=4"}, "#... #..# #..# #..."),
        ({"TIEUP": "1=0\n2=\n4=2"}, ".... .... .... .#.."),
        ({"TIEUP": "1=0\n2=1", "THREADING": "1=0\n2=1\n3=0\n4=0"}, ".... .#.. .... ...."),
        (
            {**LIFTPLAN, "LIFTPLAN": "1=0\n2=0,2\n3=0\n4=0", "THREADING": "1=0\n2=2\n3=2\n4=0,1"},
            ".... .##. .... ....",
        ),
        ({"THREADING": "1=1,2,3,4,4\n2=2,1\n3=1\n4=4"}, "###. #### #..# ##.."),
    ],
)
def test_several_or_no_shafts_and_treadles(read, changes, expected):
    assert rows(read(changes)) == expected


def test_absent_rows_of_the_weave_are_empty(read):
    with pytest.warns(pc.WifWarning) as caught:
        draft = read({"THREADING": "2=2", "TREADLING": "4=4"})
    assert rows(draft) == ".... .... .... .#.."
    assert [str(one.message).split(": ", 1)[1] for one in caught] == [
        "[THREADING]: 3 of 4 rows are absent, the first 1; they are taken for empty",
        "[TREADLING]: 3 of 4 rows are absent, the first 1; they are taken for empty",
    ]
    assert {one.filename for one in caught} == {wif_text.__file__}


def test_sparse_rows_lie_over_the_default(read):
    draft = read(
        {
            "WARP COLORS": "2=3\n4=; none",
            "WEFT COLORS": "3=1",
            "WARP SPACING": "1=0.3\n2=",
            "WEFT SPACING": "4=0.4",
            "WARP THICKNESS": "3=0.05",
            "WEFT THICKNESS": "2=0.15",
        }
    )
    assert (draft.warp_colors == [RED, BLUE, RED, RED]).all()
    assert (draft.weft_colors == [GREEN, GREEN, RED, GREEN]).all()
    assert draft.warp_spacing.tolist() == [3.0, 1.0, 1.0, 1.0]
    assert draft.weft_spacing.tolist() == [2.0, 2.0, 2.0, 4.0]
    assert draft.warp_thickness.tolist() == [0.8, 0.8, 0.5, 0.8]
    assert draft.weft_thickness.tolist() == [1.6, 1.5, 1.6, 1.6]


@pytest.mark.parametrize(
    ("unit", "mm"),
    [
        ("Decipoints", 25.4 / 720),
        ("INCHES", 25.4),
        ("inch", 25.4),
        ("centimeters", 10.0),
        ("Centimetres ; metric", 10.0),
        ("cm", 10.0),
    ],
)
def test_units(read, unit, mm):
    draft = read({"WARP": f"Threads=4\nColor=1\nUnits={unit}\nSpacing=2\nThickness=1"})
    assert draft.warp_spacing == pytest.approx(2 * mm, rel=1e-15)
    assert draft.warp_thickness == pytest.approx(mm, rel=1e-15)


def test_colours_are_scaled_by_the_range(read):
    draft = read(
        {
            "COLOR PALETTE": "Range=20,1200",
            "COLOR TABLE": "1=20,1200,610\n2=138,256,20",
            "WEFT COLORS": "1=1,1200,20,610\n3=7,20,20,20",
        }
    )
    assert draft.warp_colors == pytest.approx(np.tile([0, 1, 0.5], (4, 1)), abs=1e-15)
    expected = [[1, 0, 0.5], [0.1, 0.2, 0], [0, 0, 0], [0.1, 0.2, 0]]
    assert draft.weft_colors == pytest.approx(np.array(expected), abs=1e-15)


def test_a_default_colour_with_its_rgb_needs_no_table(read):
    draft = read(
        {
            "COLOR TABLE": None,
            "WARP": TWILL["WARP"].replace("Color=1", "Color=5,255,0,51"),
            "WEFT": TWILL["WEFT"].replace("Color=2", "Color = 0, 0 , 0, 255 ; blue"),
        }
    )
    assert (draft.warp_colors == (1.0, 0.0, 0.2)).all()
    assert (draft.weft_colors == (0.0, 0.0, 1.0)).all()


@pytest.mark.parametrize(
    "encoding",
    ["utf-8", "utf-8-sig", "latin-1", "utf-16", "utf-16-le", "utf-16-be", "utf-32"],
)
def test_texts_in_every_encoding(read, encoding):
    text = "[TEXT]\nTitle= Köper; grün=1 \n[NOTES]\n3=drei; 3\n1=\n2= zwei\nx=no\n" + text_of()
    with pytest.warns(pc.WifWarning, match=r"\[NOTES\] x: not the number of a row"):
        draft = read(text.encode(encoding))
    assert draft.title == "Köper; grün=1"
    assert draft.notes == "zwei\ndrei; 3"


@pytest.mark.parametrize(
    ("changes", "message", "check"),
    [
        (
            {"WARP": "Color=1\nUnits=cm\nSpacing=.1\nThickness=.08"},
            r"\[WARP\]: no Threads: 4 are taken, the last row of \[THREADING\]",
            lambda draft: draft.pattern.ends == 4,
        ),
        (
            {"WARP": "Threads=3\n" + TWILL["WARP"][9:]},
            r"line \d+: \[THREADING\] 4: not the number of a row from 1 to 3",
            lambda draft: rows(draft) == "##. #.. ..# .##",
        ),
        (
            {"THREADING": TWILL["THREADING"] + "\n0=1\nfive=5\n-1=1\n99999999999=1"},
            r"\[THREADING\] 0: .* 1 to 4 \(and 3 more lines\)",
            lambda draft: rows(draft) == "##.. #..# ..## .##.",
        ),
        (
            {"WEAVING": "Shafts=3\nTreadles=4"},
            r"\[THREADING\] 4: shaft 4 is beyond Shafts=3",
            lambda draft: rows(draft) == "##.. #..# ..## .##.",
        ),
        (
            {"WEAVING": "Shafts=4\nTreadles=3"},
            r"\[TREADLING\] 4: treadle 4 is beyond Treadles=3",
            lambda draft: rows(draft) == "##.. #..# ..## .##.",
        ),
        (
            {"WEAVING": "Shafts=4", "TIEUP": "1=1,2\n2=2,3\n3=3,4"},
            r"\[TREADLING\] 4: treadle 4 has no row in \[TIEUP\]: it is taken to lift nothing",
            lambda draft: rows(draft) == "##.. .##. ..## ....",
        ),
        (
            {"WARP": "Threads=4\nColor=1\nUnits=cm\nSpacing=; unknown\nThickness=.08"},
            r"\[WARP\]: no spacing: thickness / 0.8 is taken",
            lambda draft: draft.warp_spacing == pytest.approx(1.0),
        ),
        (
            {"WARP": "Threads=4\nColor=1\nUnits=cm\nSpacing=0\nThickness=.08"},
            r"\[WARP\] Spacing: is 0: it is taken for not given",
            lambda draft: draft.warp_spacing == pytest.approx(1.0),
        ),
        (
            {"WEFT": "Threads=4\nColor=2\nUnits=cm\nSpacing=.2"},
            r"\[WEFT\]: no thickness: 0.8 of the spacing is taken",
            lambda draft: draft.weft_thickness == pytest.approx(1.6),
        ),
        (
            {"WEFT": "Threads=4\nColor=2"},
            r"\[WEFT\]: no spacing: 1 mm is taken",
            lambda draft: draft.weft_spacing == pytest.approx(1.0),
        ),
        (
            {"WEFT": "Threads=4\nColor=2\nSpacing=.2\nThickness=.1"},
            r"\[WEFT\]: no units: those of \[WARP\] are taken",
            lambda draft: draft.weft_spacing == pytest.approx(2.0),
        ),
        (
            {
                "WARP": "Threads=4\nColor=1\nSpacing=.1\nThickness=.1",
                "WEFT": "Threads=4\nColor=2\nSpacing=.2\nThickness=.2",
            },
            r"\[WARP\]: no units: centimeters are taken",
            lambda draft: draft.warp_spacing == pytest.approx(1.0),
        ),
        (
            {"WARP THICKNESS": "2=0.25"},
            r"\[WARP\]: yarns thicker than their spacing: 1, the first 2: 2.5 mm against 1 mm",
            lambda draft: draft.warp_thickness.tolist() == [0.8, 2.5, 0.8, 0.8],
        ),
        (
            {"WARP": TWILL["WARP"].replace("Color=1\n", "")},
            r"\[WARP\]: no colour for 4 yarns: \(0.2, 0.2, 0.2\) is taken",
            lambda draft: (draft.warp_colors == 0.2).all(),
        ),
        (
            {"COLOR TABLE": None},
            r"\[WEFT\] Color: there is no \[COLOR TABLE\]",
            lambda draft: (draft.weft_colors == 0.9).all(),
        ),
        (
            {
                "WARP": TWILL["WARP"].replace("Color=1", "Color=9"),
                "WARP COLORS": "1=1\n2=1\n3=2\n4=3",
            },
            r"\[WARP\] Color: there is no colour 9 in \[COLOR TABLE\]",
            lambda draft: (draft.warp_colors == [RED, RED, GREEN, BLUE]).all(),
        ),
        (
            {"COLOR TABLE": "1=300,-5,0\n2=0,255,0"},
            r"\[COLOR TABLE\] 1: is clipped to the range 0,255",
            lambda draft: (draft.warp_colors == RED).all(),
        ),
        (
            {"THREADING": "stray words\n" + TWILL["THREADING"] + "\n=7"},
            r"2 lines, this the first, are neither \[section\] nor key=value",
            lambda draft: rows(draft) == "##.. #..# ..## .##.",
        ),
        (
            {"TREADLING": "1=1\n2=1\n3=3\n4=4\n2 = 2"},
            r"line 41: \[TREADLING\] 2: replaces an earlier value",
            lambda draft: rows(draft) == "##.. #..# ..## .##.",
        ),
        (
            {"TREADLING": "1=1\n2=2\n[Treadling]\n3=3\n4=4"},
            r"\[TREADLING\]: appears again in line 39; both count",
            lambda draft: rows(draft) == "##.. #..# ..## .##.",
        ),
    ],
)
def test_what_is_odd_is_read_with_a_warning(read, changes, message, check):
    with pytest.warns(pc.WifWarning) as caught:
        draft = read(changes)
    messages = [str(one.message) for one in caught]
    assert any(re.search(message, one) for one in messages), messages
    assert all("draft.wif" in one for one in messages)
    assert check(draft)


@pytest.mark.parametrize(
    ("content", "place", "message"),
    [
        (b"", (None, None, None), "is not a WIF: it has no section"),
        (b"\x00\xff\xfe\x81 garbage \x00" * 50, (None, None, None), "is not a WIF"),
        (b"[PRIVATE]\n1=2\n", (None, None, None), "is not a WIF"),
        (
            b"\xff\xfe" + text_of().encode("utf-16-le")[:-1],
            (None, None, None),
            "no UTF-16-LE: trunc",
        ),
        (b"\xfe\xff\xd8\x00\xd8\x00", (None, None, None), "is no UTF-16-BE: .* at byte 0"),
        (b"\xff\xfe\x00\x00[WIF", (None, None, None), "is no UTF-32-LE"),
        ({"THREADING": None}, ("THREADING", None, None), "has no rows"),
        ({"THREADING": "; nothing"}, ("THREADING", None, None), "has no rows"),
        ({"TIEUP": None}, ("TIEUP", None, None), r"has no rows, and \[TREADLING\] needs it"),
        ({"TREADLING": None}, ("TREADLING", None, None), r"and \[TIEUP\] needs it"),
        ({"TIEUP": None, "TREADLING": None}, ("LIFTPLAN", None, None), "has no rows, nor have"),
        ({"WARP": "Threads=0"}, ("WARP", "Threads", 8), "must be from 1 to 1,000,000, not 0"),
        ({"WARP": "Threads=-4"}, ("WARP", "Threads", 8), "must be a whole number, not '-4'"),
        ({"WEFT": "Threads=many"}, ("WEFT", "Threads", 14), "must be a whole number"),
        ({"WEFT": "Threads=9999999999"}, ("WEFT", "Threads", 14), "must be a whole number"),
        ({"WEFT": "Threads=1000001"}, ("WEFT", "Threads", 14), "must be from 1 to 1,000,000"),
        (
            {"WARP": "Threads=101", "WEFT": "Threads=1000000"},
            (None, None, None),
            "1000000 x 101 crossings are too many",
        ),
        ({"WARP": "Color=1", "THREADING": "a=1"}, ("WARP", None, None), "no numbered row"),
        ({"THREADING": "1=1\n2=two"}, ("THREADING", "2", 28), "whole numbers .*, not 'two'"),
        ({"THREADING": "1=1\n2=-2"}, ("THREADING", "2", 28), "whole numbers .*, not '-2'"),
        ({"TIEUP": "1=1.5"}, ("TIEUP", "1", 32), "whole numbers"),
        ({"TREADLING": "1=1\n2=1,7"}, ("TREADLING", "2", 38), "treadle 7 has no row in"),
        ({"TREADLING": "1=99999999999999999999"}, ("TREADLING", "1", 37), "has no row in"),
        ({"WEAVING": "Rising Shed=perhaps"}, ("WEAVING", "Rising Shed", 4), "one of true, on"),
        ({"WEAVING": "Shafts=x"}, ("WEAVING", "Shafts", 4), "must be a whole number"),
    ],
)
def test_what_cannot_be_read_is_an_error_with_its_place(read, content, place, message):
    with pytest.raises(pc.WifError, match=message) as caught:
        read(content)
    error = caught.value
    section, key, line = place
    assert (error.section, error.key, error.line) == place
    assert error.file.endswith("draft.wif")
    assert isinstance(error, ValueError)
    assert section is None or f"[{section}]" in str(error)
    assert key is None or f"[{section}] {key}: " in str(error)
    assert line is None or f"draft.wif, line {line}: " in str(error)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_a_byte_order_mark_before_latin_1_hides_no_section(read):
    text = text_of({"WIF": None}) + "[TEXT]\nTitle=Köper\n"
    assert read(b"\xef\xbb\xbf" + text.encode("latin-1")).title == "Köper"


@pytest.mark.filterwarnings("ignore::plycloth.WifWarning")
@pytest.mark.parametrize("seed", range(100))
def test_a_damaged_file_reads_or_is_refused(read, seed):
    rng = np.random.default_rng(seed)
    junk = list(b"0199=,;.-[]\n\xff\x00 eW")
    damaged = bytearray(text_of({"WARP COLORS": "2=3", "WEFT SPACING": "1=0.3"}), "ascii")
    for at in rng.integers(0, len(damaged), rng.integers(1, 8)):
        damaged[at : at + rng.integers(0, 3)] = bytes(rng.choice(junk, 2).tolist())
    try:
        draft = read(bytes(damaged))
    except pc.WifError:
        return
    assert isinstance(draft, pc.Draft)


def test_a_path_that_is_no_file_raises_what_opening_it_raises(tmp_path):
    with pytest.raises(FileNotFoundError):
        pc.read_wif(tmp_path / "absent.wif")
    with pytest.raises(OSError, match=tmp_path.name):
        pc.read_wif(tmp_path)


PADDED = {
    "WARP": "Threads=9\nColor=1\nUnits=Centimeters\nSpacing=0.1\nThickness=0.08",
    "WARP COLORS": "3=3\n8=3",
    "WEFT": "Threads=7\nColor=2\nUnits=Centimeters\nSpacing=0.2\nThickness=0.16",
    "THREADING": "3=1\n4=2\n5=3\n6=4",
    "TREADLING": "2=1\n3=2\n4=3\n5=4",
}


@pytest.mark.filterwarnings("ignore::plycloth.WifWarning")  # others, of the same file
def test_threads_that_hold_nothing_at_the_margins_are_left_out_with_a_warning(read):
    message = "of 7 picks x 9 ends 4 x 4 are kept: .* interlace with nothing"
    with pytest.warns(pc.WifWarning, match=message):
        draft = read(PADDED, trim=True)
    assert draft.pattern == pc.WeavePattern.twill(2, 2)
    assert (draft.warp_colors[0] == BLUE).all()
    assert (draft.warp_colors[1:] == RED).all()
    assert draft.warp_spacing.shape == draft.weft_thickness.shape == (4,)


@pytest.mark.filterwarnings("ignore::plycloth.WifWarning")
def test_untrimmed_they_stay(read):
    draft = read(PADDED)
    assert draft.pattern.warp_up.shape == (7, 9)
    assert draft.trimmed() == read(PADDED, trim=True)


def test_trim_is_a_bool(read):
    with pytest.raises(TypeError, match="trim must be a bool"):
        read({}, trim="no")
