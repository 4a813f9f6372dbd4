"""The command line's counts of the trade, and its strictness about drafts."""

import plycloth as pc
import pytest
from plycloth.cli import main
from plycloth.trade import diameter_mm, spacing_mm, to_tex

SMALL = ["--spp", "1", "--width", "24", "--threads", "1"]
COTTON = ["--material", "cotton"]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder to work in, with a draft, a faulty one and a fabric."""
    monkeypatch.chdir(tmp_path)
    draft = pc.Draft.from_pattern(pc.WeavePattern.twill(2, 2))
    pc.write_wif(draft, "draft.wif")
    faulty = (tmp_path / "draft.wif").read_text().replace("Spacing=0.1", "Spacing=0,1")
    (tmp_path / "faulty.wif").write_text(faulty)
    pc.Fabric.from_draft(draft).save("fabric.json")
    return tmp_path


@pytest.fixture
def rendered(monkeypatch):
    """Gives the fabrics that are rendered."""
    fabrics = []
    overview = pc.overview

    def watched(fabric, *arguments, **options):
        fabrics.append(fabric)
        return overview(fabric, *arguments, **options)

    monkeypatch.setattr("plycloth.cli.render.overview", watched)
    return fabrics


def test_ends_and_picks_are_taken_per_length(folder, rendered):
    options = ["--ends", "60/inch", "--picks", "20/cm", "--quiet"]
    assert main(["render", "draft.wif", "-o", "out.png", *SMALL, *options]) == 0
    (fabric,) = rendered
    assert fabric.warp_spacing_mm == pytest.approx(spacing_mm(60, "inch"))
    assert fabric.weft_spacing_mm == pytest.approx(0.5)


def test_sizes_of_yarns_are_taken_and_said(folder, rendered, capsys):
    options = ["--warp", "30/2 Ne", "--weft", "20 tex", *COTTON]
    assert main(["render", "draft.wif", "-o", "out.png", *SMALL, *options]) == 0
    (fabric,) = rendered
    warp = pc.RoundYarn.of_size("30/2 Ne", pc.PlyBsdf(), material="cotton")
    assert fabric.warp.radius_mm == pytest.approx(warp.radius_mm)
    assert (fabric.warp.plies, fabric.weft.plies) == (2, 1)
    assert fabric.weft.radius_mm == pytest.approx(0.5 * diameter_mm(20, "cotton"))
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("warp: 30/2 Ne of cotton is 0.332 mm thick, in the cloth 0.332 x 0.3")
    assert said[1].startswith("weft: 20 tex of cotton is 0.167 mm thick")


def test_yarns_that_the_sett_leaves_no_room_for_are_pressed_and_it_is_said(
    folder, rendered, capsys
):
    options = ["--warp", "30/2 Ne", *COTTON, "--ends", "100/inch", "--picks", "100/inch"]
    assert main(["render", "draft.wif", "-o", "out.png", *SMALL, *options]) == 0
    (fabric,) = rendered
    assert fabric.overlaps().count == 0
    assert "0.332 mm thick, in the cloth 0.2" in capsys.readouterr().out


def test_a_density_and_a_packing_are_taken(folder, rendered):
    options = ["--weft", "150 den", "--material", "1.2", "--packing", "0.8", "--quiet"]
    assert main(["render", "draft.wif", "-o", "out.png", *SMALL, *options]) == 0
    diameter = diameter_mm(to_tex(150, "denier"), 1.2, 0.8)
    assert rendered[0].weft.radius_mm == pytest.approx(0.5 * diameter)
    assert rendered[0].warp.plies == 3


def test_a_thin_yarn_in_an_open_sett_is_no_matter_of_pitch(folder, rendered):
    options = ["--warp", "2 tex x 2", *COTTON, "--picks", "1/cm", "--quiet"]
    assert main(["render", "draft.wif", "-o", "out.png", *SMALL, *options]) == 0


def test_strictly_a_faulty_draft_is_an_error(folder, capsys):
    assert main(["render", "faulty.wif", "-o", "out.png", *SMALL, "--quiet"]) == 0
    assert "not '0,1': it is taken for not given" in capsys.readouterr().err
    assert main(["render", "faulty.wif", "-o", "out.png", *SMALL, "--strict"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "faulty.wif, line" in line
    assert "must be one number of at least 0, not '0,1'" in line


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--warp", "30/2 Ne"], "--warp: needs --material: cotton, wool"),
        (["--warp", "30/2", *COTTON], "--warp: a yarn size must be such as '20 tex'"),
        (["--weft", "150/48 den", *COTTON], "--weft: a yarn size in denier must not have a stroke"),
        (["--weft", "x" * 300 + " tex", *COTTON], "xxx...'"),
        (["--warp", "20 tex x 40", *COTTON], "--warp: the plies of a yarn must be in"),
        (["--warp", "20 tex", "--material", "coton"], "--material must be one of 'cotton'"),
        (["--warp", "20 tex", "--material", "0"], "--material must be in [0.01, 100], not 0"),
        (["--warp", "20 tex", *COTTON, "--packing", "2"], "--packing must be in [0.01, 1], not 2"),
        (["--warp", "20 tex", *COTTON, "--yarn", "silk1"], "--warp: does not go together with"),
        (COTTON, "--material: is for yarns whose size is given"),
        (["--packing", "0.5"], "--packing: is for yarns whose size is given"),
    ],
)
def test_bad_counts_are_one_line(options, message, folder, capsys):
    assert main(["render", "draft.wif", "-o", "out.png", *options]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("plycloth: error: ")
    assert message in line
    assert len(line) < 250


@pytest.mark.parametrize("name", ["ends", "picks", "warp", "weft", "material"])
def test_a_saved_fabric_has_its_own(name, folder, capsys):
    assert main(["render", "fabric.json", "-o", "out.png", f"--{name}", "60/inch"]) == 2
    assert f"--{name}: is for a draft" in capsys.readouterr().err


@pytest.mark.parametrize("sett", ["60", "60/foot", "/inch", "0/cm", "nan/cm", "inf/inch", "-1/cm"])
def test_what_is_no_sett(sett, folder, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["render", "draft.wif", "-o", "out.png", f"--ends={sett}"])
    assert "must be a number per inch or cm, such as 60/inch" in capsys.readouterr().err


@pytest.mark.parametrize("text", [500 * "x", 250 * "x ", 250 * "x\\"])
@pytest.mark.parametrize("option", ["--spp", "--side", "--ends", "--recolor", "--colour"])
def test_long_arguments_are_quoted_in_part(option, text, folder, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["render", "draft.wif", "-o", "out.png", f"{option}={text}"])
    message = capsys.readouterr().err.splitlines()[-1]
    assert message.count("x") <= 90
