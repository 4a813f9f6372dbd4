"""What a fit leaves in a folder: a JSON file, the fabric, pictures, and a page to look at."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plycloth.fit_result import Estimate, FitResult
from plycloth.image import Image
from plycloth.page import Page

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GAMMA = 2.2
"""Pictures are encoded as light ** (1 / 2.2), unless the photographs beside them are otherwise."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """One picture and what the fit makes of it, both in linear light.

    Parameters
    ----------
    name
        Also that of the file, such as "front".
    target
        What was fitted to.
    fitted
        A render of the fitted fabric, developed as the target was.
    """

    name: str
    target: Image
    fitted: Image


def save_fit(
    folder: str | PathLike[str],
    page: Page,
    result: FitResult,
    comparisons: Sequence[Comparison],
    *,
    record: Mapping[str, Any] | None = None,
    errors: Sequence[float] | None = None,
    hidden: Mapping[str, float] | None = None,
    gamma: float = GAMMA,
    dpi: float | None = None,
) -> None:
    """Write what a fit found to a folder, which is made if it is not there.

    It gets `fit.json`, `fabric.json` (`Fabric.load` reads it), one PNG per picture, 8
    bit and encoded as light ** (1 / gamma), and `index.html`.

    Parameters
    ----------
    folder
        Where to; files of these names are replaced, and pictures that an earlier fit left there are
        removed.
    page
        The page so far; the fit is added to it.
    result
        What was found.
    comparisons
        The pictures, in the order of the result's matches.
    record
        What `fit.json` holds, as plain values; None: what `fit_record` says. Its "candidates",
        if it has any, are the geometries that were tried: mappings with the same keys.
    errors
        The relative error of each picture; None: those of the result.
    hidden
        The true value of each parameter by its label, where they are known.
    gamma
        That of the photographs.
    dpi
        Resolution to note in the PNGs, as `Image.save` does.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    folder, names = Path(folder), [each.name for each in comparisons]
    if record is None:
        record = fit_record(result, names, hidden)
    save_record(folder, result, record, names)
    for comparison in comparisons:
        comparison.fitted.save(folder / f"{comparison.name}.png", gamma=gamma, dpi=dpi)
    candidates = record.get("candidates", ())
    add_fit(
        page,
        result,
        comparisons,
        errors=errors,
        candidates=candidates,
        hidden=hidden,
        gamma=gamma,
    )
    page.save(folder / "index.html")


def save_record(
    folder: Path, result: FitResult, record: Mapping[str, Any], names: Sequence[str]
) -> None:
    """Write `fabric.json` and `fit.json`, before the pictures with these names are there."""
    folder.mkdir(parents=True, exist_ok=True)
    result.fabric.save(folder / "fabric.json")
    _remove_pictures(folder / "fit.json")
    whole = dict(record) | {"pictures": [f"{name}.png" for name in names]}
    (folder / "fit.json").write_text(json.dumps(whole, indent=2) + "\n", encoding="utf-8")


def _remove_pictures(record: Path) -> None:
    """Remove the pictures of an earlier fit, which would be taken for some of this one."""
    try:
        earlier = json.loads(record.read_bytes())
        names = earlier["pictures"] if {"parameters", "message"} <= earlier.keys() else ()
        pictures = [record.with_name(name) for name in names if name.endswith(".png")]
        for picture in pictures:
            picture.unlink(missing_ok=True)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError):
        # There is none, or it is none of ours: what is there stays.
        return


def fit_record(
    result: FitResult, names: Sequence[str], hidden: Mapping[str, float] | None = None
) -> dict[str, Any]:
    """Return what a fit found as values that JSON can hold.

    Its keys: "parameters" (label, value, unit, uncertainty, identifiable and, where it is known,
    the hidden value of each), "lenses" and relative "errors" by picture, "objective"
    (from round to round), "evaluations" and "message".
    """
    return {
        "parameters": [_parameter(estimate, hidden or {}) for estimate in result.estimates],
        "lenses": {name: asdict(lens) for name, lens in zip(names, result.lenses, strict=True)},
        "errors": dict(zip(names, result.errors, strict=True)),
        "objective": _objective(result),
        "evaluations": result.evaluations,
        "message": result.message,
    }


def add_fit(
    page: Page,
    result: FitResult,
    comparisons: Sequence[Comparison],
    *,
    errors: Sequence[float] | None = None,
    candidates: Sequence[Mapping[str, object]] = (),
    hidden: Mapping[str, float] | None = None,
    gamma: float = GAMMA,
) -> None:
    """Add to a page: pictures and errors, parameters, convergence, and geometries tried."""
    page.heading("Pictures")
    page.text("On the left what was fitted to, on the right the fitted fabric.")
    errors = result.errors if errors is None else errors
    for comparison, error in zip(comparisons, errors, strict=True):
        caption = f"{comparison.name}: fitted, relative error {error:.1%}"
        target = (f"{comparison.name}: target", comparison.target)
        page.pictures([target, (caption, comparison.fitted)], gamma=gamma)
    page.text(
        "The relative error is the root mean squared difference of cell averages in linear light"
        " over the picture's mean."
    )
    page.heading("Parameters")
    page.table(*_parameter_table(result, hidden or {}))
    for comparison, lens in zip(comparisons, result.lenses, strict=True):
        page.text(f"{comparison.name}: {lens}.")
    page.heading("Convergence")
    page.plot("The objective from round to round.", _convergence(result))
    page.text(f"{result.nit} rounds, {result.evaluations} evaluations; {result.message}.")
    if candidates:
        page.heading("Geometries tried")
        rows = [[_cell(value) for value in candidate.values()] for candidate in candidates]
        page.table(list(candidates[0]), rows)


def _cell(value: object) -> object:
    if isinstance(value, list | tuple):
        return ", ".join(f"{part:.4g}" if isinstance(part, float) else str(part) for part in value)
    return value


def _parameter(estimate: Estimate, hidden: Mapping[str, float]) -> dict[str, Any]:
    known = {"hidden": hidden[estimate.label]} if estimate.label in hidden else {}
    return asdict(estimate) | known


def _parameter_table(
    result: FitResult, hidden: Mapping[str, float]
) -> tuple[list[str], list[list[object]]]:
    head = ["parameter", "value", "uncertainty", "unit"]
    if hidden:
        head += ["hidden value", "off by"]
    rows: list[list[object]] = []
    for estimate in result.estimates:
        row: list[object] = [estimate.label, estimate.value, estimate.doubt, estimate.unit or "1"]
        if hidden:
            true = hidden[estimate.label]
            row += [true, f"{abs(estimate.value / true - 1.0):.1%}" if true else ""]
        rows.append(row)
    return head, rows


def _objective(result: FitResult) -> list[float]:
    return [step.before for step in result.steps] + [result.fun]


def _convergence(result: FitResult) -> "Figure":
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 3), layout="constrained")
    axes = figure.subplots()
    objective = _objective(result)
    axes.plot(objective, ".-")
    # Products of independent differences may come out negative where noise is all there is.
    scale = "log" if min(objective) > 0.0 else "linear"
    axes.set(xlabel="round", ylabel="objective", yscale=scale)
    axes.grid(alpha=0.3)
    return figure
