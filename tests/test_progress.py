import subprocess
import sys

import pytest
from plycloth import progress
from plycloth.progress import reporting


def test_a_callable_gets_done_and_total():
    seen = []
    with reporting(lambda done, total: seen.append((done, total)), 8) as report:
        report(0)
        report(5)
    assert seen == [(0, 8), (5, 8), (8, 8)]


def test_the_end_is_reported_once():
    seen = []
    with reporting(lambda done, total: seen.append(done), 8) as report:
        report(8)
    assert seen == [8]


def test_work_that_fails_is_not_reported_as_done():
    seen = []

    def work():
        with reporting(lambda done, total: seen.append(done), 8) as report:
            report(3)
            raise RuntimeError("lost")

    with pytest.raises(RuntimeError, match="lost"):
        work()
    assert seen == [3]


def test_an_exception_of_the_callable_stops_the_work():
    def refuse(done, total):
        raise KeyError("enough")

    with pytest.raises(KeyError, match="enough"), reporting(refuse, 8) as report:
        report(1)


def test_true_shows_a_bar(capsys):
    with reporting(True, 8, description="render", unit="pass") as report:
        report(2)
        report(8)
    shown = capsys.readouterr().err
    assert "render" in shown
    assert "8/8" in shown
    assert "pass" in shown


def test_false_and_an_unwatched_none_show_nothing(capsys):
    for choice in (False, None):
        with reporting(choice, 8) as report:
            assert report is None
    assert capsys.readouterr().err == ""


def test_none_shows_a_bar_in_a_terminal(monkeypatch, capsys):
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    with reporting(None, 8) as report:
        report(4)
    assert "8/8" in capsys.readouterr().err


def test_none_shows_a_bar_in_a_notebook(monkeypatch):
    class Kernel:
        @staticmethod
        def get_ipython():
            return Kernel()

        @staticmethod
        def has_trait(name):
            return name == "kernel"

    monkeypatch.setitem(sys.modules, "IPython", Kernel)
    assert progress._watched()


NOTEBOOK_WITHOUT_WIDGETS = """
import sys, types

class Kernel:
    kernel = None

    def has_trait(self, name):
        return name == "kernel"

kernel = Kernel()
sys.modules["IPython"] = types.SimpleNamespace(get_ipython=lambda: kernel)
# By this name tqdm knows a notebook.
sys.modules["ipykernel.zmqshell"] = types.ModuleType("ipykernel.zmqshell")
sys.modules["ipywidgets"] = None
from plycloth.progress import reporting
with reporting(None, 8, description="render") as report:
    report(8)
"""


def test_a_notebook_without_widgets_has_a_bar_of_text_and_no_warning():
    command = [sys.executable, "-W", "always", "-c", NOTEBOOK_WITHOUT_WIDGETS]
    shown = subprocess.run(command, check=True, capture_output=True, text=True)
    assert "8/8" in shown.stderr
    assert "Warning" not in shown.stderr


def test_none_shows_nothing_in_plain_ipython_without_a_shell(monkeypatch):
    class Idle:
        @staticmethod
        def get_ipython():
            return None

    monkeypatch.setitem(sys.modules, "IPython", Idle)
    assert not progress._watched()


@pytest.mark.parametrize("wrong", ["yes", 1, 0, []])
def test_anything_else_is_refused(wrong):
    with pytest.raises(TypeError, match="None, True, False or a callable"), reporting(wrong, 8):
        pass
