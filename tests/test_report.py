"""The page and the files that a fit leaves."""

import base64
import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import plycloth as pc
import pytest
from fits import SIDES, SmallPhotoFit, small_fit
from plycloth.fit_result import Step
from plycloth.page import Page
from plycloth.report import Comparison, fit_record, save_fit

VOID = {"meta", "img"}


class Checker(HTMLParser):
    """Fails on tags that are not closed in order."""

    def __init__(self):
        super().__init__()
        self.open = []
        self.sources = []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        self.sources += [value for name, value in attrs if name in ("src", "href")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def checked(text):
    checker = Checker()
    checker.feed(text)
    assert checker.open == []
    return checker


def comparisons():
    pictures, result = small_fit()
    return [
        Comparison(side, picture, result.develop(picture))
        for side, picture in zip(SIDES, pictures, strict=True)
    ]


def test_page_escapes_text():
    page = Page("a < b")
    page.text("<script>")
    page.table(["x & y"], [["<td>"]])
    page.pictures([('"quoted"', pc.Image(np.zeros((1, 1, 3))))])
    text = str(page)
    checked(text)
    assert "<script>" not in text
    assert "a &lt; b" in text
    assert "&lt;td&gt;" in text
    assert 'alt="&quot;quoted&quot;"' in text


def test_page_shows_numbers_with_four_digits():
    page = Page("numbers")
    page.table(["a", "b"], [[1 / 3, 12345]])
    assert "<td>0.3333</td><td>12345</td>" in str(page)


def test_pictures_are_in_the_page(tmp_path):
    image = pc.Image(np.full((2, 3, 3), 0.25))
    page = Page("picture")
    page.pictures([("grey", image)], gamma=2.2)
    (data,) = re.findall(r'src="data:image/png;base64,([^"]*)"', str(page))
    (tmp_path / "out.png").write_bytes(base64.b64decode(data))
    shown = pc.read_image(tmp_path / "out.png", gamma=2.2)
    assert shown.pixels == pytest.approx(0.25, abs=0.005)


def test_a_fit_leaves_files_that_belong_together(tmp_path):
    _, result = small_fit()
    save_fit(tmp_path, Page("fit"), result, comparisons())
    record = json.loads((tmp_path / "fit.json").read_text(encoding="utf-8"))
    assert [p["value"] for p in record["parameters"]] == list(result.x)
    assert record["errors"] == dict(zip(SIDES, result.errors, strict=True))
    assert record["objective"][-1] == result.fun
    assert pc.Fabric.load(tmp_path / "fabric.json") == result.fabric
    assert pc.read_image(tmp_path / "back.png").width == 16

    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    sources = checked(text).sources
    assert len(sources) == 5  # target and fit of both sides, and convergence
    assert all(source.startswith("data:") for source in sources)
    assert "http" not in text
    for estimate in result.estimates:
        assert f"<td>{estimate.label}</td><td>{estimate.value:.4g}</td>" in text


def test_pictures_of_an_earlier_fit_are_removed_and_nothing_else(tmp_path):
    _, result = small_fit()
    save_fit(tmp_path, Page("fit"), result, comparisons())
    outside = tmp_path.with_name("outside.png")
    for kept in (outside, tmp_path / "mine.png"):
        kept.write_bytes(b"kept")
    one_side = SmallPhotoFit(SIDES[:1]).result
    save_fit(tmp_path, Page("fit"), one_side, comparisons()[:1])
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"fit.json", "fabric.json", "front.png", "index.html", "mine.png"}

    ours = '{"parameters": [], "message": "", "pictures": %s}'
    (tmp_path / "folder.png").mkdir()
    for foreign in (
        '{"pictures": ["mine.png"]}',
        "[" * 99999,
        *(
            ours % names
            for names in ('["../outside.png"]', '["a\\u0000.png"]', '["folder.png"]', "7")
        ),
    ):
        (tmp_path / "fit.json").write_text(foreign, encoding="utf-8")
        save_fit(tmp_path, Page("fit"), one_side, comparisons()[:1])
        assert outside.exists()
        assert (tmp_path / "mine.png").exists()


def test_hidden_values_stand_beside_what_was_found(tmp_path):
    _, result = small_fit()
    hidden = {estimate.label: 2.0 * estimate.value for estimate in result.estimates}
    record = fit_record(result, SIDES, hidden)
    assert [p["hidden"] for p in record["parameters"]] == list(hidden.values())
    save_fit(tmp_path, Page("fit"), result, comparisons(), hidden=hidden)
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert text.count("<td>50.0%</td>") == len(hidden)


def test_geometries_that_were_tried_are_a_table(tmp_path):
    _, result = small_fit()
    tried = [{"geometry": "plain", "errors": [0.125, 0.25]}, {"geometry": "twill", "errors": [1.0]}]
    save_fit(tmp_path, Page("fit"), result, comparisons(), record={"candidates": tried})
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "<th>geometry</th><th>errors</th>" in text
    assert "<td>plain</td><td>0.125, 0.25</td>" in text


@pytest.mark.parametrize("objective", [(0.2, 0.1), (0.2, -0.1), (-0.2, -0.1)])
def test_objectives_that_noise_makes_negative_are_drawn_as_well(objective, tmp_path):
    before, reached = objective
    step = Step(before, predicted=reached, reached=reached, radius=0.1, accepted=True)
    result = replace(small_fit()[1], steps=[step])
    save_fit(tmp_path, Page("a fit"), result, comparisons())
    checked((tmp_path / "index.html").read_text(encoding="utf-8"))
