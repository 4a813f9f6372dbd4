"""`plycloth fit`: a fabric from photographs."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plycloth._json import load_as
from plycloth.cli.counts import SETTS, add_setts
from plycloth.cli.options import add_common, add_dpi, add_strict, progress, say
from plycloth.image_read import read_photograph
from plycloth.image_write import checked_dpi
from plycloth.page import Page
from plycloth.photo_exposure import GREY, GreyCard
from plycloth.photo_geometry import COVERS
from plycloth.report import Comparison, save_fit, save_record
from plycloth.rig import RIG, PhotoRig
from plycloth.trade import spacing_mm, threads_per
from plycloth.weave import WeavePattern
from plycloth.wif import read_wif

if TYPE_CHECKING:
    from plycloth.photo_fit import PhotoFit

SIDES = ("front", "back")
# Reflectances of cards to photograph for the exposure, by option.
CARDS = {"grey-card": GREY, "white": 0.9}
# Samples per pixel of the pictures of a quick fit.
QUICK_SPP = {"front": 8, "back": 16}
SECONDS_HELP = (
    "stop the search after S seconds; one fit at least is made, and its pictures take some more"
)


def add_fit(commands: Any) -> None:
    """Add the command to those of the program."""
    command = commands.add_parser(
        "fit",
        help="a fabric from photographs, one lit from the front and one from behind",
        description="Find the fabric on photographs taken on a rig, that of Tang et al. 2024 unless"
        " another is named (docs/conventions.md): one lit from the front, one from behind, or one"
        " of them alone. Ctrl-C ends the search with the best so far.",
    )
    command.set_defaults(run=_fit)
    add = command.add_argument
    add("front", metavar="FRONT.png", type=Path, help="lit from the front, unless --lit says else")
    add("back", metavar="BACK.png", type=Path, nargs="?", help="lit from behind")
    add("--lit", choices=SIDES, help="from where a single photograph is lit (default: front)")
    add(
        "-o",
        "--output",
        metavar="FOLDER",
        type=Path,
        required=True,
        help="gets fit.json, fabric.json, front.png, back.png and index.html",
    )
    _add_known(command)
    add("--quick", action="store_true", help="a first look, within 45 seconds on 2 cores")
    add("--seconds", type=float, metavar="S", help=SECONDS_HELP)
    add("--tie", action="store_true", help="warp and weft are the same yarn")
    add(
        "--rig",
        metavar="RIG.json",
        type=Path,
        help="how the photographs were taken: a PhotoRig that pc.save wrote",
    )
    add(
        "--draft",
        metavar="DRAFT.wif",
        type=Path,
        help="the weave, if it is known (default: looked for)",
    )
    add_strict(command)
    add_dpi(command)
    add_common(command)


def _add_known(command: argparse.ArgumentParser) -> None:
    """Add what a user may know about the cloth and the photographs."""
    add = command.add_argument
    add(
        "--width-mm",
        type=float,
        metavar="MM",
        help="real width of the piece of cloth that the pictures show (default: a guess)",
    )
    add(
        "--cover",
        type=float,
        nargs=2,
        metavar=("LOW", "HIGH"),
        help="narrowest and widest yarns, over their spacing (default: {:g} {:g})".format(*COVERS),
    )
    add_setts(command, "a guess of the width; one is enough")
    brightness = command.add_mutually_exclusive_group()
    brightness.add_argument(
        "--exposure",
        type=float,
        metavar="X",
        help="factor between the rig's light and that of the photographs (default: the one with"
        " which the cloth, rendered, has the photograph's colours)",
    )
    for option, reflectance in CARDS.items():
        brightness.add_argument(
            f"--{option}",
            type=float,
            nargs=3,
            metavar=("R", "G", "B"),
            help=f"codes, 0 to 255, that a card of reflectance {reflectance:g} has in place of the"
            " cloth, lit from the front and photographed with the same exposure",
        )


def _fit(options: argparse.Namespace) -> None:
    checked_dpi("--dpi", options.dpi)
    if options.strict and options.draft is None:
        raise ValueError("--strict: is for the draft that --draft names")
    rig = RIG if options.rig is None else load_as(PhotoRig, options.rig)
    given = _given(options)
    _check_folder(options.output, list(given.values()))
    from plycloth.photo_fit import fit_photographs

    known = _known(options, rig)
    found = fit_photographs(
        given.get("front"), given.get("back"), rig=rig, progress=progress(options), **known
    )
    save_record(options.output, found.result, found.summary(), list(given))
    comparisons = _comparisons(options, found, given, rig)
    page = Page(f"Fabric of {' and '.join(path.name for path in given.values())}")
    page.text(f"The geometry that fits best: {found.geometry}.")
    for note in found.notes:
        page.text(note)
    save_fit(
        options.output,
        page,
        found.result,
        comparisons,
        record=found.summary(),
        errors=found.errors,
        gamma=rig.gamma,
        dpi=options.dpi,
    )
    errors = zip(given, found.errors, strict=True)
    summary = ", ".join(f"{side} {error:.1%}" for side, error in errors)
    stopped = "" if found.stopped is None else f" ({found.stopped}: the best so far)"
    say(options, f"{options.output / 'index.html'}: relative errors {summary}{stopped}")
    # Doubts were warnings already.
    for assumption in found.assumptions:
        say(options, assumption)
    if found.stopped == "interrupted":
        raise KeyboardInterrupt(f"{options.output} holds the best so far")


def _comparisons(
    options: argparse.Namespace, found: PhotoFit, given: dict[str, Path], rig: PhotoRig
) -> list[Comparison]:
    """Render what the photographs show; Ctrl-C leaves it out."""
    if found.stopped == "interrupted":
        line = f"{options.output} holds the best so far; its pictures follow, unless Ctrl-C again"
        print(f"plycloth: interrupted: {line}", file=sys.stderr)
    try:
        return [
            Comparison(
                side,
                read_photograph(path, rig.gamma),
                found.picture(side, **_looking(options, found, side)),
            )
            for side, path in given.items()
        ]
    except KeyboardInterrupt:
        left = f"{options.output} holds the fabric, but no pictures"
        raise KeyboardInterrupt(left) from None


def _given(options: argparse.Namespace) -> dict[str, Path]:
    """Return the photographs by the side that they are lit from."""
    if options.back is None:
        return {options.lit or "front": options.front}
    if options.lit is not None:
        raise ValueError(
            "--lit: is for a single photograph; of two, the first is lit from the front"
        )
    return {"front": options.front, "back": options.back}


def _looking(options: argparse.Namespace, found: PhotoFit, side: str) -> dict[str, Any]:
    """Return how a picture to look at is rendered."""
    is_quick = options.quick or found.stopped is not None
    spp = QUICK_SPP[side] if is_quick else None
    return {"spp": spp, "threads": options.threads, "progress": progress(options)}


def _check_folder(folder: Path, photographs: Sequence[Path]) -> None:
    """See before the work that its results have a place, which is not that of a photograph."""
    if folder.exists() and not folder.is_dir():
        raise ValueError(f"{folder}: is a file, but must be a folder")
    for side in SIDES:
        result = folder / f"{side}.png"
        if result.exists() and any(result.samefile(photograph) for photograph in photographs):
            raise ValueError(
                f"{folder}: {result.name} there is a photograph to fit, and would be"
                " replaced; name another folder"
            )


def _known(options: argparse.Namespace, rig: PhotoRig) -> dict[str, Any]:
    """Return the arguments of `fit_photographs` that were given on the command line."""
    named = {
        "width_mm": options.width_mm,
        **_counts(options),
        "exposure": _exposure(options, rig),
        "covers": None if options.cover is None else tuple(options.cover),
        "pattern": None if options.draft is None else _pattern(options),
        "tie": options.tie or None,
        "quick": options.quick or None,
        "seconds": options.seconds,
        "threads": options.threads,
    }
    return {"seed": options.seed} | {k: value for k, value in named.items() if value is not None}


def _counts(options: argparse.Namespace) -> dict[str, Any]:
    """Return the threads per length that were given, in one length for both."""
    given = {name: sett for name in SETTS if (sett := getattr(options, name)) is not None}
    counts = {name: threads_per(spacing_mm(*sett), "cm") for name, sett in given.items()}
    return counts | {"per": "cm"} if counts else {}


def _pattern(options: argparse.Namespace) -> WeavePattern:
    return read_wif(options.draft, strict=options.strict).pattern


def _exposure(options: argparse.Namespace, rig: PhotoRig) -> float | GreyCard | None:
    for option, reflectance in CARDS.items():
        codes = getattr(options, option.replace("-", "_"))
        if codes is not None:
            if not all(0.0 < code <= 255.0 for code in codes):
                raise ValueError(f"--{option}: must be three codes from 1 to 255, not {codes}")
            red, green, blue = ((code / 255.0) ** rig.gamma for code in codes)
            return GreyCard((red, green, blue), reflectance)
    exposure: float | None = options.exposure
    return exposure
