"""Progress as the user wants it: a bar where a person watches, a callback, or nothing."""

import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from tqdm import TqdmWarning

from plycloth._check import quoted

with warnings.catch_warnings():
    # A notebook without ipywidgets gets a bar of text, which is no reason to warn.
    warnings.simplefilter("ignore", TqdmWarning)
    from tqdm.auto import tqdm

Progress = bool | Callable[[int, int], object] | None
"""What ``progress=`` takes: None, True, False, or a callable of (done, total)."""


@contextmanager
def reporting(
    progress: Progress,
    total: int | None,
    *,
    description: str = "",
    unit: str = "it",
    delay: float = 0.0,
) -> Iterator[Callable[[int], None] | None]:
    """Turn a ``progress=`` argument into what the core calls while it works.

    Parameters
    ----------
    progress : None, bool or callable
        None shows a bar if a person watches (a terminal or a notebook), True shows one in any
        case, False shows nothing, and a callable is called with (done, total).
    total : int or None
        Units of work that make the whole; None: a bar shows what is done and the time.
    description, unit : str
        What the bar says in front, and what it counts.
    delay : float
        Seconds before a bar shows: what is done by then shows none.

    Yields
    ------
    callable or None
        Takes the units done so far; None where nothing is to be reported. An exception from the
        user's callable passes through it, and so stops the work. Work that ends well is reported
        as (total, total) at last, if it was not.

    Raises
    ------
    TypeError
        If `progress` is none of the above.
    """
    if callable(progress):
        with _completed(progress, total) as report:
            yield report
    elif progress is False or (progress is None and not _watched()):
        yield None
    elif progress is None or progress is True:
        with (
            tqdm(
                total=total, desc=description or None, unit=unit, delay=delay, leave=not delay
            ) as bar,
            _completed(lambda done, _: bar.update(done - bar.n), total) as report,
        ):
            yield report
    else:
        raise TypeError(
            f"progress: is {quoted(progress)}, but must be None, True, False or a"
            " callable(done, total)"
        )


def relaxing(
    progress: Progress, total: int | None = 100
) -> AbstractContextManager[Callable[[int], None] | None]:
    """Report a relaxation, by a bar only if it takes longer than half a second.

    Parameters
    ----------
    progress : None, bool or callable
        As for `reporting`.
    total : int or None
        Units that the core counts, 100 for one relaxation; None for an unknown number of them.
    """
    return reporting(progress, total, description="relax", unit="%", delay=0.5)


@contextmanager
def _completed(
    report: Callable[[int, Any], object], total: int | None
) -> Iterator[Callable[[int], None]]:
    last = None

    def call(done: int) -> None:
        nonlocal last
        last = done
        report(done, total)

    yield call
    if total is not None and last != total:
        call(total)


def _watched() -> bool:
    return sys.stderr.isatty() or _in_notebook()


def _in_notebook() -> bool:
    # Only a running kernel has loaded this module, so nothing is imported to find out.
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython is not None else None
    return shell is not None and shell.has_trait("kernel")
