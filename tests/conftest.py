import os

import pytest


def pytest_runtest_setup(item):
    if item.get_closest_marker("data") and not os.environ.get("PLYCLOTH_DATA"):
        pytest.skip("PLYCLOTH_DATA names no folder of real data")
