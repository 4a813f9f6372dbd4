import os

import plycloth as pc
import pytest


def pytest_runtest_setup(item):
    if item.get_closest_marker("data") and not os.environ.get("PLYCLOTH_DATA"):
        pytest.skip("PLYCLOTH_DATA names no folder of real data")


@pytest.fixture
def draft(tmp_path):
    """A file of a draft in four colours."""
    path = tmp_path / "draft.wif"
    pattern = pc.WeavePattern.twill(2, 2)
    colors = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]
    pc.write_wif(pc.Draft.from_pattern(pattern, warp_colors=colors, weft_spacing=0.5), path)
    return path
