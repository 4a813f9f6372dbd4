"""The command line: `plycloth render`, `compare` and `fit`, for people with no script."""

import argparse
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from plycloth._check import ParameterError
from plycloth._plycloth import __version__
from plycloth.cli.compare import add_compare
from plycloth.cli.fit import add_fit
from plycloth.cli.options import named_as_option
from plycloth.cli.render import add_render

BAD_INPUT = 2
INTERRUPTED = 130


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
    except (OSError, ValueError, MemoryError) as error:
        print(f"plycloth: error: {_one_line(error)}", file=sys.stderr)
        return BAD_INPUT
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="plycloth", description="The look of woven cloth, from weaving draft to fitted picture"
    )
    parser.add_argument("--version", action="version", version=f"plycloth {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    add_render(commands)
    add_compare(commands)
    add_fit(commands)
    return parser


def _one_line(error: OSError | ValueError | MemoryError) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    text = " ".join(str(error).split())
    return named_as_option(text) if isinstance(error, ParameterError) else text


@contextmanager
def _warnings_on_one_line() -> Iterator[None]:
    def show(message: Warning | str, *_: object) -> None:
        print(f"plycloth: warning: {' '.join(str(message).split())}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show  # type: ignore[assignment]
        yield
