"""The command line: `plycloth render`, `compare` and `fit`, for people with no script."""

import argparse
import re
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NoReturn

from plycloth._check import MOST_QUOTED, ParameterError
from plycloth._plycloth import ConvergenceError, __version__
from plycloth.cli.compare import add_compare
from plycloth.cli.fit import add_fit
from plycloth.cli.options import named_as_option
from plycloth.cli.render import add_render

BAD_INPUT = 2
INTERRUPTED = 130

# What argparse quotes, or takes over as it is, of more characters than a message quotes.
LONG = re.compile(
    rf"(?<=unrecognized arguments: ).{{{MOST_QUOTED + 1},}}"
    rf"|'(?:[^'\\]|\\.){{{MOST_QUOTED - 1},}}'"
    rf"|\S{{{MOST_QUOTED + 1},}}"
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments
        What follows the program's name; None: those of the process.

    Returns
    -------
    int
        0; 2 for bad input, about which one line is printed; 130 after Ctrl-C, which leaves what
        there is so far.

    Raises
    ------
    SystemExit
        By argparse, with 2 for unknown arguments, and with 0 for --help and --version.
    """
    options = _parser().parse_args(arguments)
    try:
        with _warnings_on_one_line():
            options.run(options)
    except KeyboardInterrupt as stop:
        kept = f": {stop}" if str(stop) else ""
        print(f"plycloth: interrupted{kept}", file=sys.stderr)
        return INTERRUPTED
    except (OSError, ValueError, MemoryError, ConvergenceError) as error:
        print(f"plycloth: error: {_one_line(error)}", file=sys.stderr)
        return BAD_INPUT
    return 0


class _Parser(argparse.ArgumentParser):
    """A parser whose errors quote a part of what is long."""

    def error(self, message: str) -> NoReturn:
        super().error(LONG.sub(lambda found: f"{found[0][: MOST_QUOTED - 3]}...", message))


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="plycloth", description="The look of woven cloth, from weaving draft to fitted picture"
    )
    parser.add_argument("--version", action="version", version=f"plycloth {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    add_render(commands)
    add_compare(commands)
    add_fit(commands)
    return parser


def _one_line(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    text = " ".join(str(error).split())
    return named_as_option(text) if isinstance(error, ParameterError) else text


@contextmanager
def _warnings_on_one_line() -> Iterator[None]:
    def show(message: Warning | str, *_: object) -> None:
        text = " ".join(str(message).split()).replace("(trim=False keeps", "(--untrimmed keeps")
        print(f"plycloth: warning: {text}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show  # type: ignore[assignment]
        yield
