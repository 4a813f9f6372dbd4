"""Writing WIF: what weavers and other programs read, and what comes back."""

import numpy as np
import plycloth as pc
import pytest

RED, GREEN, BLUE = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.2, 0.4, 0.8)


def random_draft(seed: int) -> pc.Draft:
    rng = np.random.default_rng(seed)
    picks, ends = rng.integers(1, 60, 2)
    # Repeats of a few rows and columns as often as rows that are all different.
    warp_up = rng.random((picks, ends)) < rng.choice(
        [0.0, 0.3, 0.7, 1.0], p=[0.05, 0.45, 0.45, 0.05]
    )
    if seed % 2:
        warp_up = warp_up[rng.integers(0, picks, picks)][:, rng.integers(0, ends, ends)]
    levels = rng.choice([1, 255, 999, 65535, 2**30 - 1])
    lengths = [10 ** rng.uniform(-3, 3, n) for n in (ends, picks, ends, picks)]
    if seed % 3 == 0:
        lengths = [np.full_like(length, length[0]) for length in lengths]
    warp_spacing, weft_spacing, warp_thickness, weft_thickness = lengths
    return pc.Draft(
        pc.WeavePattern(warp_up),
        rng.integers(0, levels, (ends, 3), endpoint=True) / levels,
        rng.integers(0, levels, 3, endpoint=True) / levels,
        warp_spacing,
        weft_spacing,
        np.minimum(warp_thickness, warp_spacing),
        np.minimum(weft_thickness, weft_spacing),
        title="; Ünïcode = [x] ; \u2028" * (seed % 2) + "end",
        notes="[WARP]\n\n; 1=2\n  = \x0c|" * (seed % 4 > 1),
    )


@pytest.mark.parametrize("seed", range(80))
def test_what_is_written_reads_back_equal(tmp_path, seed):
    draft = random_draft(seed)
    path = tmp_path / "draft.wif"
    pc.write_wif(draft, path)
    assert pc.read_wif(path, trim=False) == draft


def test_a_thickness_beyond_the_spacing_survives_and_warns(tmp_path):
    draft = pc.Draft.from_pattern(pc.WeavePattern.plain(), warp_thickness=1.7)
    pc.write_wif(draft, tmp_path / "draft.wif")
    with pytest.warns(pc.WifWarning, match="yarns thicker than their spacing: 2"):
        assert pc.read_wif(tmp_path / "draft.wif") == draft


def test_a_written_file_is_what_a_weaver_would_write(tmp_path):
    path = tmp_path / "draft.wif"
    draft = pc.Draft.from_pattern(
        pc.WeavePattern(np.tile(pc.WeavePattern.twill(2, 1).warp_up, (2, 2))),
        warp_colors=[RED, RED, RED, BLUE, RED, RED],
        weft_colors=GREEN,
        warp_spacing=0.53,
        warp_thickness=0.4,
        title="Twill",
        notes="first\n\nthird",
    )
    pc.write_wif(draft, path)
    assert path.read_bytes().decode() == (
        "[WIF]\nVersion=1.1\nDate=April 20, 1997\nDevelopers=wif@mhsoft.com\n"
        f"Source Program=plycloth\nSource Version={pc.__version__}\n\n"
        "[CONTENTS]\nTEXT=true\nNOTES=true\nWEAVING=true\nTHREADING=true\nTIEUP=true\n"
        "TREADLING=true\nCOLOR PALETTE=true\nCOLOR TABLE=true\nWARP=true\nWARP COLORS=true\n"
        "WEFT=true\n\n"
        "[TEXT]\nTitle=Twill\n\n"
        "[NOTES]\n1=first\n2=\n3=third\n\n"
        "[WEAVING]\nRising Shed=true\nShafts=3\nTreadles=3\n\n"
        "[THREADING]\n1=1\n2=2\n3=3\n4=1\n5=2\n6=3\n\n"
        "[TIEUP]\n1=1,2\n2=1,3\n3=2,3\n\n"
        "[TREADLING]\n1=1\n2=2\n3=3\n4=1\n5=2\n6=3\n\n"
        "[COLOR PALETTE]\nRange=0,255\nEntries=3\n\n"
        "[COLOR TABLE]\n1=0,255,0\n2=51,102,204\n3=255,0,0\n\n"
        "[WARP]\nThreads=6\nUnits=Centimeters\nColor=3\nSpacing=0.053\n"
        "Thickness=0.04\n\n"
        "[WARP COLORS]\n1=3\n2=3\n3=3\n4=2\n5=3\n6=3\n\n"
        "[WEFT]\nThreads=6\nUnits=Centimeters\nColor=1\nSpacing=0.1\nThickness=0.08\n"
    )


def test_colours_that_the_table_rounds_are_kept_beside_it(tmp_path):
    path = tmp_path / "draft.wif"
    draft = pc.Draft.from_pattern(
        pc.WeavePattern.plain(), warp_colors=RED, weft_colors=(0.9, 0.9, 0.9)
    )
    pc.write_wif(draft, path)
    text = path.read_text("utf-8")
    assert "[COLOR PALETTE]\nRange=0,255\n" in text
    assert "[COLOR TABLE]\n1=230,230,230\n2=255,0,0\n" in text
    assert "[PRIVATE PLYCLOTH COLORS]\n1=0.9,0.9,0.9\n" in text
    # Whoever changes the table does not know the section, which is stale then.
    path.write_text(text.replace("1=230,230,230", "1=0,0,255"), "utf-8")
    assert (pc.read_wif(path).weft_colors == (0.0, 0.0, 1.0)).all()


def written(tmp_path, different):
    """A draft of so many different picks, in colours that eight bits round, and its file."""
    rng = np.random.default_rng(different)
    warp_up = np.eye(different, dtype=bool)
    warp_up[:, 0] = True
    draft = pc.Draft.from_pattern(
        pc.WeavePattern(warp_up),
        warp_colors=rng.random((different, 3)),
        weft_colors=(0.9, 0.9, 0.9),
        weft_spacing=rng.random(different) + 1.0,
        title="A draft",
    )
    pc.write_wif(draft, tmp_path / "draft.wif")
    return draft, tmp_path / "draft.wif"


@pytest.mark.parametrize("different", [5, 40])
def test_pyweaving_reads_what_is_written(tmp_path, different):
    wif = pytest.importorskip("pyweaving.wif")
    draft, path = written(tmp_path, different)
    read = wif.WIFReader(str(path)).read()
    seen = [thread.color.rgb for thread in read.warp]
    assert np.array_equal(seen, np.rint(255 * draft.warp_colors))
    lifted = [pick.connected_shafts for pick in read.weft]
    warp_up = [[end.shaft in shafts for end in read.warp] for shafts in lifted]
    assert np.array_equal(warp_up, draft.pattern.warp_up)


@pytest.mark.parametrize("different", [5, 40])
def test_dtx_to_wif_reads_what_is_written(tmp_path, different):
    wif = pytest.importorskip("dtx_to_wif")
    draft, path = written(tmp_path, different)
    with path.open(encoding="utf-8") as file:
        read = wif.read_wif(file)
    assert (read.name, read.color_range, read.source_program) == ("A draft", (0, 255), "plycloth")
    colors = [
        read.color_table[read.warp_colors.get(end, read.warp.color)]
        for end in range(1, different + 1)
    ]
    assert np.array_equal(colors, np.rint(255 * draft.warp_colors))
    spacing = [
        10 * read.weft_spacing.get(pick, read.weft.spacing) for pick in range(1, different + 1)
    ]
    assert spacing == pytest.approx(draft.weft_spacing)
    lifts = read.liftplan or {
        pick: set().union(*(read.tieup[t] for t in treadles))
        for pick, treadles in read.treadling.items()
    }
    warp_up = [
        [bool(read.threading[end] & lifts[pick]) for end in range(1, different + 1)]
        for pick in range(1, different + 1)
    ]
    assert np.array_equal(warp_up, draft.pattern.warp_up)


@pytest.mark.parametrize(("different", "section"), [(32, "[TIEUP]"), (33, "[LIFTPLAN]")])
def test_many_treadles_become_a_lift_plan(tmp_path, different, section):
    path = tmp_path / "draft.wif"
    draft = pc.Draft.from_pattern(pc.WeavePattern(np.eye(different)))
    pc.write_wif(draft, path)
    assert section in path.read_text(encoding="utf-8")
    assert pc.read_wif(path) == draft


def test_only_drafts_are_written(tmp_path):
    with pytest.raises(TypeError, match="must be a Draft, not a WeavePattern"):
        pc.write_wif(pc.WeavePattern.plain(), tmp_path / "draft.wif")
