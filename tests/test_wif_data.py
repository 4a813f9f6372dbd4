"""Drafts that other people's programs wrote: each file reads, warns or is refused as listed."""

import os
import re
import warnings
from pathlib import Path

import numpy as np
import plycloth as pc
import pytest

pytestmark = [
    pytest.mark.data,
    pytest.mark.skipif(
        "PLYCLOTH_DATA" not in os.environ, reason="PLYCLOTH_DATA names no folder of real data"
    ),
]

FOLDER = Path(os.environ.get("PLYCLOTH_DATA", "")) / "wif"
DTX = "dtx_to_wif/src_test_data_"

# What most files lack. The other oddities stand beside each file.
NO_THICKNESS = {"[WARP]: no thickness", "[WEFT]: no thickness"}
FEW_ENDS = "[THREADING]: {} rows are absent"
FEW_PICKS = "[TREADLING]: {} rows are absent"
FEW_LIFTS = "[LIFTPLAN]: {} rows are absent"
SPARSE = {FEW_ENDS.format("8 of 12"), FEW_PICKS.format("7 of 13"), *NO_THICKNESS}

# File: picks, ends, warnings.
READ = {
    "base_loom_server/32-shaft_twill.wif": (62, 62, set()),
    "base_loom_server/eighteen_shaft_liftplan.wif": (
        6,
        4,
        {"[THREADING] 3: shaft 18 is beyond Shafts=4", *NO_THICKNESS},
    ),
    "base_loom_server/many_color_liftplan_and_zeros.wif": (6, 5, NO_THICKNESS),
    "base_loom_server/many_color_multiple_treadles_and_zeros.wif": (
        6,
        5,
        {FEW_ENDS.format("1 of 5"), *NO_THICKNESS},
    ),
    "base_loom_server/many_color_single_treadles.wif": (13, 12, SPARSE),
    "base_loom_server/two_color_liftplan.wif": (6, 4, NO_THICKNESS),
    "base_loom_server/two_color_multiple_treadles.wif": (6, 4, NO_THICKNESS),
    "base_loom_server/two_color_single_treadles.wif": (6, 4, NO_THICKNESS),
    DTX + "basic_wif_liftplan_with_defaults.wif": (
        6,
        4,
        {
            "line 1: 3 lines, this the first, are neither [section] nor key=value",
            "[THREADING] 5: not the number of a row from 1 to 4",
            FEW_ENDS.format("2 of 4"),
            FEW_LIFTS.format("2 of 6"),
            *NO_THICKNESS,
        },
    ),
    DTX + "basic_wif_treadles_with_defaults_and_private_sections.wif": (
        6,
        5,
        {FEW_ENDS.format("1 of 5"), FEW_PICKS.format("1 of 6"), *NO_THICKNESS},
    ),
    DTX + "basic_wpo_level2_two_color_liftplan.wpo.wif": (
        1200,
        1200,
        {FEW_ENDS.format("1196 of 1200"), FEW_LIFTS.format("1194 of 1200"), *NO_THICKNESS},
    ),
    DTX + "basic_wpo_level2_two_color_multiple_treadles.wpo.wif": (
        1200,
        1200,
        {FEW_ENDS.format("1196 of 1200"), FEW_PICKS.format("1194 of 1200"), *NO_THICKNESS},
    ),
    DTX + "basic_wpo_level2_two_color_single_treadles.wpo.wif": (
        1200,
        1200,
        {FEW_ENDS.format("1196 of 1200"), FEW_PICKS.format("1194 of 1200"), *NO_THICKNESS},
    ),
    DTX + "basic_wpo_many_color_liftplan_and_zeros.wpo.wif": (
        1200,
        1200,
        {
            "line 30: 4 lines, this the first, are neither [section] nor key=value",
            "[WARP COLORS]: appears again in line 42",
            "[WARP COLORS] (4: not the number of a row from 1 to 1200",
            FEW_ENDS.format("1195 of 1200"),
            FEW_LIFTS.format("1194 of 1200"),
            *NO_THICKNESS,
        },
    ),
    DTX + "basic_wpo_many_color_multiple_treadles_and_zeros.wpo.wif": (
        1200,
        1200,
        {FEW_ENDS.format("1196 of 1200"), FEW_PICKS.format("1194 of 1200"), *NO_THICKNESS},
    ),
    DTX + "basic_wpo_many_color_single_treadles.wpo.wif": (
        1200,
        1200,
        {FEW_ENDS.format("1196 of 1200"), FEW_PICKS.format("1194 of 1200"), *NO_THICKNESS},
    ),
    DTX + "desired_basic_wif_many_color_liftplan_and_zeros.wif": (6, 5, NO_THICKNESS),
    DTX + "desired_basic_wif_many_color_multiple_treadles_and_zeros.wif": (
        6,
        5,
        {FEW_ENDS.format("1 of 5"), *NO_THICKNESS},
    ),
    DTX + "desired_basic_wif_many_color_single_treadles.wif": (13, 12, SPARSE),
    DTX + "desired_basic_wif_multi-byte_liftplan.wif": (641, 641, set()),
    DTX + "desired_basic_wif_multi-byte_multi_treadled.wif": (641, 641, set()),
    DTX + "desired_basic_wif_multi-byte_single_treadled.wif": (641, 641, set()),
    DTX + "desired_basic_wif_two_color_liftplan.wif": (6, 4, NO_THICKNESS),
    DTX + "desired_basic_wif_two_color_multiple_treadles.wif": (6, 4, NO_THICKNESS),
    DTX + "desired_basic_wif_two_color_single_treadles.wif": (6, 4, NO_THICKNESS),
    # A default that is no colour, but which only yarns need that are never threaded or trodden.
    DTX + "warn_wif_default_warp_color_too_big.wif": (
        13,
        12,
        {"line 83: [WARP] Color: there is no colour 11", "[WARP]: no colour for 8 yarns", *SPARSE},
    ),
    DTX + "warn_wif_default_warp_color_too_small.wif": (
        13,
        12,
        {"line 83: [WARP] Color: there is no colour 0", "[WARP]: no colour for 8 yarns", *SPARSE},
    ),
    DTX + "warn_wif_default_weft_color_too_big.wif": (
        13,
        12,
        {"line 89: [WEFT] Color: there is no colour 11", "[WEFT]: no colour for 7 yarns", *SPARSE},
    ),
    DTX + "warn_wif_default_weft_color_too_small.wif": (
        13,
        12,
        {"line 89: [WEFT] Color: there is no colour 0", "[WEFT]: no colour for 7 yarns", *SPARSE},
    ),
}

# File: section, key, line, problem. Those of the weave are refused, the others when read strictly.
REFUSED = {
    "default_warp_color_too_big": ("WARP", "Color", 82, "there is no colour 11 in"),
    "default_warp_color_too_small": ("WARP", "Color", 82, "there is no colour 0 in"),
    "default_weft_color_too_big": ("WEFT", "Color", 88, "there is no colour 11 in"),
    "default_weft_color_too_small": ("WEFT", "Color", 88, "there is no colour 0 in"),
    "missing_color_table_warp": ("WARP COLORS", "1", 69, "there is no [COLOR TABLE]"),
    "missing_color_table_weft": ("WARP", "Color", 58, "there is no [COLOR TABLE]"),
    "missing_liftplan": ("LIFTPLAN", None, None, "has no rows, nor have [TIEUP] and [TREADLING]"),
    "missing_tieup": ("TIEUP", None, None, "has no rows, and [TREADLING] needs it"),
    "missing_treadling": ("TREADLING", None, None, "has no rows, and [TIEUP] needs it"),
    "too_many_treadles_in_treadline": ("TREADLING", "1", 44, "treadle 7 has no row in [TIEUP]"),
    # The sections of these two are not those that the names say.
    "warp_color_too_big": ("WEFT COLORS", "6", 39, "there is no colour 11 in"),
    "warp_color_too_small": ("WARP COLORS", "1", 30, "there is no colour 0 in"),
    "weft_color_too_big": ("WEFT COLORS", "1", 35, "there is no colour 11 in"),
    "weft_color_too_small": ("WARP COLORS", "4", 32, "there is no colour 0 in"),
}


def test_every_file_is_in_a_table():
    files = {str(path.relative_to(FOLDER)) for path in FOLDER.rglob("*.wif")}
    assert files == {*READ, *(f"{DTX}bad_wif_{name}.wif" for name in REFUSED)}


def quietly_read(name: str) -> tuple[pc.Draft, list[str]]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        draft = pc.read_wif(FOLDER / name, trim=False)
    assert all(one.category is pc.WifWarning for one in caught)
    return draft, [str(one.message) for one in caught]


@pytest.mark.parametrize("name", READ)
def test_files_that_read(name):
    picks, ends, expected = READ[name]
    draft, messages = quietly_read(name)
    assert draft.pattern.warp_up.shape == (picks, ends)
    assert len(messages) == len(expected), messages
    for part in expected:
        assert any(part in message for message in messages), (part, messages)


WEAVE = {"LIFTPLAN", "TIEUP", "TREADLING"}


@pytest.mark.parametrize("name", [name for name, place in REFUSED.items() if place[0] not in WEAVE])
def test_files_whose_colours_are_guessed(name):
    section, key, line, problem = REFUSED[name]
    draft, messages = quietly_read(f"{DTX}bad_wif_{name}.wif")
    assert draft.pattern.warp_up.shape in {(13, 12), (6, 5), (6, 4)}
    place = f".wif, line {line}: [{section}] {key}: {problem}"
    assert any(place in message for message in messages), messages


@pytest.mark.parametrize(
    ("name", "strict"),
    [(name, strict) for name in REFUSED for strict in {True, REFUSED[name][0] not in WEAVE}],
)
def test_files_that_are_refused(name, strict):
    section, key, line, problem = REFUSED[name]
    with pytest.raises(pc.WifError) as caught:
        pc.read_wif(FOLDER / f"{DTX}bad_wif_{name}.wif", strict=strict)
    error = caught.value
    assert (error.section, error.key, error.line) == (section, key, line)
    assert problem in str(error)


class PlainReader:
    """A WIF as a person reads it: line by line, yarn by yarn, crossing by crossing."""

    def __init__(self, path: Path) -> None:
        self.values: dict[tuple[str, str], str] = {}
        section = ""
        for line in path.read_text(encoding="utf-8").splitlines():
            if heading := re.match(r"\[(.*)\]", line):
                section = heading[1]
            elif "=" in line and not line.startswith(";"):
                key, value = line.split("=", 1)
                self.values[section, key.strip()] = value.strip()

    def row(self, section: str, number: int) -> set[int]:
        value = self.values.get((section, str(number)), "")
        return {int(part) for part in value.split(",") if part} - {0}

    def is_warp_up(self, pick: int, end: int) -> bool:
        lifted = self.row("LIFTPLAN", pick)
        for treadle in self.row("TREADLING", pick):
            lifted |= self.row("TIEUP", treadle)
        return bool(lifted & self.row("THREADING", end))

    def color(self, side: str, yarn: int) -> list[float]:
        default = self.values[side, "Color"]
        index = self.values.get((f"{side} COLORS", str(yarn))) or default
        low, high = map(int, self.values["COLOR PALETTE", "Range"].split(","))
        rgb = self.values["COLOR TABLE", index].split(",")
        return [(int(value) - low) / (high - low) for value in rgb]

    def spacing(self, side: str, yarn: int) -> float:
        default = self.values[side, "Spacing"]
        value = float(self.values.get((f"{side} SPACING", str(yarn))) or default)
        return value * {"inches": 25.4, "centimeters": 10}[self.values[side, "Units"].lower()]


@pytest.mark.parametrize("name", READ)
def test_files_read_as_a_person_reads_them(name):
    draft, _ = quietly_read(name)
    plain = PlainReader(FOLDER / name)
    rng = np.random.default_rng(5)
    # All of the small drafts, and all but the empty rest of the large ones, with samples of that.
    picks, ends = (
        sorted({*range(1, min(n, 70) + 1), *rng.integers(1, n + 1, 20).tolist()})
        for n in draft.pattern.warp_up.shape
    )
    expected = [[plain.is_warp_up(pick, end) for end in ends] for pick in picks]
    crossings = np.ix_(np.array(picks) - 1, np.array(ends) - 1)
    assert (draft.pattern.warp_up[crossings] == expected).all()
    for side, yarns in (("WARP", ends), ("WEFT", picks)):
        index = np.array(yarns) - 1
        spacing = getattr(draft, f"{side.lower()}_spacing")[index]
        assert spacing == pytest.approx([plain.spacing(side, yarn) for yarn in yarns], rel=1e-14)
        if f"warn_wif_default_{side.lower()}" not in name:
            colors = getattr(draft, f"{side.lower()}_colors")[index]
            assert colors.tolist() == [plain.color(side, yarn) for yarn in yarns]


@pytest.mark.parametrize("name", READ)
def test_files_survive_being_written(name, tmp_path):
    draft, _ = quietly_read(name)
    pc.write_wif(draft, tmp_path / "draft.wif")
    assert pc.read_wif(tmp_path / "draft.wif", trim=False) == draft


def test_two_writings_of_one_draft_agree():
    plan, treadled = (
        pc.read_wif(FOLDER / f"{DTX}desired_basic_wif_multi-byte_{kind}.wif")
        for kind in ("liftplan", "single_treadled")
    )
    assert plan == treadled
    assert plan.notes == "iWeaveIt Import"


@pytest.mark.filterwarnings("ignore::plycloth.WifWarning", "ignore::plycloth.OverlapWarning")
@pytest.mark.parametrize("trim", [True, False])
@pytest.mark.parametrize("name", READ)
def test_every_file_renders(name, trim):
    draft = pc.read_wif(FOLDER / name, trim=trim)
    yarn = pc.RoundYarn(radius_mm=0.3 * draft.warp_spacing.min(), bsdf=pc.PlyBsdf(), plies=1)
    fabric = pc.Fabric.from_draft(draft, yarn, yarn)
    picture = pc.render(pc.overview(fabric, width=16), spp=1, progress=False)
    assert np.isfinite(picture.pixels).all()
    assert picture.pixels.mean() > 0
