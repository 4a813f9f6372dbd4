"""What the documents show works: their Python runs, their files and commands exist."""

import re
import shutil
from inspect import signature
from pathlib import Path

import plycloth as pc
import pytest
from fits import SmallPhotoFit
from plycloth import cli, photo_fit

ROOT = Path(__file__).parents[1]
DOCUMENTS = [
    "README.md",
    "docs/guide.md",
    "docs/conventions.md",
    "docs/results.md",
    "docs/unsupported.md",
]
SMALL = pc.Draft.from_pattern(pc.WeavePattern.plain())


def blocks(document, language):
    return re.findall(
        rf"```{language}\n(.*?)```", (ROOT / document).read_text(encoding="utf-8"), re.DOTALL
    )


@pytest.fixture
def quick(tmp_path, monkeypatch):
    """A folder with what the documents name; pictures are small, and the search is not run."""
    monkeypatch.chdir(tmp_path)
    pc.write_wif(SMALL, "draft.wif")
    for name in ("front.png", "back.png"):
        shutil.copy(ROOT / "docs" / "weave.png", name)
    render, compared = pc.render, pc.compare
    monkeypatch.setattr(pc, "render", lambda scene, **_: render(scene, spp=1, progress=False))

    def compare(subjects, light):
        return compared(subjects, light, height=8, spp=1, progress=False)

    monkeypatch.setattr(pc, "compare", compare)

    def fit_photographs(front, back, **options):
        assert options.keys() <= signature(photo_fit.fit_photographs).parameters.keys()
        assert all(pc.read_image(path, gamma=2.2) for path in (front, back))
        return SmallPhotoFit()

    monkeypatch.setattr(pc, "fit_photographs", fit_photographs, raising=False)
    return tmp_path


def test_the_ten_lines_of_the_readme_do_the_main_job(quick):
    (block,) = blocks("README.md", "python")
    assert len([line for line in block.splitlines() if line]) <= 10
    exec(compile(block, "README.md", "exec"), {})
    for name in ("cloth.png", "front-fitted.png", "back-fitted.png"):
        assert pc.read_image(quick / name).width > 1
    assert isinstance(pc.Fabric.load(quick / "fabric.json"), pc.Fabric)


def test_the_guide_runs_from_top_to_bottom(quick):
    names = {}
    for block in blocks("docs/guide.md", "python"):
        exec(compile(block, "docs/guide.md", "exec"), names)
    assert names["draft"].pattern == pc.WeavePattern.satin(5, 2)
    assert pc.Fabric.load("fabric.json") == names["fabric"]
    assert pc.read_image("scene.png").pixels.shape == (200, 320, 3)


@pytest.mark.parametrize("document", DOCUMENTS)
def test_links_lead_to_files(document):
    links = re.findall(r"\]\(([^)#]+)\)", (ROOT / document).read_text(encoding="utf-8"))
    for link in links:
        assert ((ROOT / document).parent / link).exists(), link


@pytest.mark.parametrize("document", DOCUMENTS)
def test_commands_are_ones_that_the_command_line_knows(document):
    commands = [line.split() for block in blocks(document, "sh") for line in block.splitlines()]
    for program, *arguments in commands:
        if program == "plycloth":
            cli._parser().parse_args(arguments)
        else:
            assert program == "make"
            assert f"\n{arguments[0]}:" in (ROOT / "Makefile").read_text(encoding="utf-8")


def test_the_picture_of_the_readme_is_that_of_its_command():
    (command,) = [
        line
        for block in blocks("README.md", "sh")
        for line in block.splitlines()
        if "docs/weave.png" in line
    ]
    options = cli._parser().parse_args(command.split()[1:])
    fabric = pc.Fabric.from_draft(pc.read_wif(ROOT / options.draft))
    resolution = pc.overview(fabric, options.light, width=options.width).camera.resolution
    picture = pc.read_image(ROOT / options.output)
    assert (picture.width, picture.height) == resolution
    rendered = pc.render(pc.overview(fabric, options.light, width=48), spp=16, progress=False)
    assert picture.pixels.mean((0, 1)) == pytest.approx(rendered.pixels.mean((0, 1)), rel=0.03)


def test_version_is_stated_once_and_cited():
    assert f"\nversion: {pc.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_papers_are_cited_alike():
    dois = set(re.findall(r"doi: (\S+)", (ROOT / "CITATION.cff").read_text(encoding="utf-8")))
    assert len(dois) == 2
    bibliography = (ROOT / "docs" / "references.bib").read_text(encoding="utf-8")
    assert all(f"{{{doi}}}" in bibliography for doi in dois)
