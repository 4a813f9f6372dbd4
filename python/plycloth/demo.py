"""`make demo`: the whole way from a draft to a fitted fabric, in a few minutes.

With ``PLYCLOTH_DATA`` set, a pair of real photographs from that folder is fitted. Without any data,
a fabric is made up, photographed by rendering, and recovered from the two pictures.
"""

import argparse
import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from plycloth import cli, datasets
from plycloth.bsdf import PlyBsdf
from plycloth.draft import Draft
from plycloth.fabric import Fabric
from plycloth.fit import fit
from plycloth.fit_result import FitResult
from plycloth.image import Image
from plycloth.overview import overview
from plycloth.page import Page
from plycloth.render import render
from plycloth.report import GAMMA, Comparison, save_fit
from plycloth.rig import photo_rig
from plycloth.unknowns import unknowns
from plycloth.wif import read_wif
from plycloth.yarn import RoundYarn

FOLDER = "demo"
SIDES = ("front", "back")
PHOTO_PAIR = "satin1"

FREE = ("base_color", "transmitted_color", "extinction")
# Of both yarns: most light from behind passes warp and weft, so two pictures hardly tell which of
# them tints it.
HIDDEN = PlyBsdf(base_color=(0.75, 0.6, 0.35), transmitted_color=(0.8, 0.6, 0.3), extinction=20.0)
"""Warp and weft that the demo makes up."""

SPACING_MM = 0.25
RADIUS_MM = 0.12


@dataclass(frozen=True)
class Effort:
    """How large and how clean the demo's pictures are, and how long it fits."""

    cloth_width: int = 480
    cloth_spp: int = 16
    photo_width: int = 192
    photo_spp: int = 96
    paths: int = 512
    rounds: int = 8
    evaluations: int = 6


FULL = Effort()


def main(arguments: Sequence[str] | None = None, effort: Effort = FULL) -> int:
    """Run the demo and say what it did.

    Parameters
    ----------
    arguments
        The folder to write to ("demo" if none), or "--help"; None: those of the process.
    effort
        The scale of what is made up and recovered.

    Returns
    -------
    int
        0, or 2 if the photographs cannot be fitted.
    """
    parser = argparse.ArgumentParser(prog="plycloth.demo", description=__doc__)
    parser.add_argument("folder", nargs="?", default=FOLDER, help="to write to (default: demo)")
    folder = Path(parser.parse_args(arguments).folder)
    if os.environ.get(datasets.FOLDER_VARIABLE):
        return _fit_photographs(folder)
    _recover(folder, effort)
    return 0


def _fit_photographs(folder: Path) -> int:
    try:
        front, back = datasets.photo_pair(PHOTO_PAIR)
    except (OSError, ValueError) as error:
        print(f"demo: error: {error}", file=sys.stderr)
        return cli.BAD_INPUT
    print(f"demo: {datasets.FOLDER_VARIABLE} is set: fits the photographs {front} and {back}")
    return cli.main(["fit", str(front), str(back), "-o", str(folder)])


def _recover(folder: str | PathLike[str], effort: Effort) -> None:
    """Render a draft, make up a fabric of its weave, and recover it from two pictures."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    print(
        f"demo: {datasets.FOLDER_VARIABLE} is not set: makes up a fabric, renders it lit from the"
        " front and from behind, and recovers it from the two pictures"
    )
    draft = read_wif(datasets.example_draft())
    cloth = render(
        overview(Fabric.from_draft(draft), width=effort.cloth_width), spp=effort.cloth_spp
    )
    photographs = photograph(made_up(draft, HIDDEN), effort, seed=1)
    result = recover(draft, photographs, effort)
    pictures = [
        result.develop(image, picture)
        for picture, image in enumerate(photograph(result.fabric, effort, seed=3))
    ]
    cloth.save(folder / "cloth.png")
    (folder / "draft.png").write_bytes(draft._repr_png_())
    for side, image in zip(SIDES, photographs, strict=True):
        image.save(folder / f"{side}-target.png", gamma=GAMMA)
    comparisons = [
        Comparison(side, target, fitted)
        for side, target, fitted in zip(SIDES, photographs, pictures, strict=True)
    ]
    save_fit(folder, _page(draft, cloth), result, comparisons, hidden=hidden_values())
    print(f"demo: {folder / 'index.html'}: {_summary(result)}")


def made_up(draft: Draft, bsdf: PlyBsdf) -> Fabric:
    """Return a fabric of the draft's weave, pressed until its yarns fit, with the given BSDF."""
    yarn = RoundYarn(RADIUS_MM, bsdf, plies=1)
    return Fabric(draft.pattern, yarn, yarn, SPACING_MM, SPACING_MM).fitted()


def photograph(fabric: Fabric, effort: Effort, *, seed: int) -> list[Image]:
    """Render the fabric on the photo rig, lit from the front and from behind."""
    resolution = (effort.photo_width, effort.photo_width)
    return [
        render(photo_rig(fabric, side, resolution=resolution), spp=effort.photo_spp, seed=seed)
        for side in SIDES
    ]


def recover(draft: Draft, photographs: Sequence[Image], effort: Effort) -> FitResult:
    """Fit the fabric to its pictures, starting from a grey that is the same for all yarns."""
    start = made_up(draft, PlyBsdf())
    return fit(
        [photo_rig(start, side) for side in SIDES],
        list(photographs),
        free=FREE,
        tie=True,
        paths=effort.paths,
        rounds=effort.rounds,
        evaluations=effort.evaluations,
        seed=2,
    )


def hidden_values() -> dict[str, float]:
    """Return what the demo hides, by the labels of the estimates."""
    shared = unknowns(FREE, tie=True, bounds={})
    return {unknown.label: unknown.value((HIDDEN, HIDDEN)) for unknown in shared}


def _summary(result: FitResult) -> str:
    hidden = hidden_values()
    off = [abs(estimate.value / hidden[estimate.label] - 1.0) for estimate in result.estimates]
    worst = max(range(len(off)), key=off.__getitem__)
    return (
        f"{len(off)} hidden parameters recovered, to {sum(off) / len(off):.1%} on average and"
        f" {off[worst]:.1%} at worst ({result.estimates[worst].label})"
    )


def _page(draft: Draft, cloth: Image) -> Page:
    page = Page("plycloth: from a draft to a fitted fabric")
    page.text(
        "No photographs were at hand, so this page shows a fabric that was made up: a draft that"
        " comes with plycloth, the cloth that it describes, and then two pictures of its weave in"
        " yarns whose optical parameters were hidden from the fit and recovered by it. The"
        " pictures were rendered with one seed, the fit draws its paths with another."
    )
    page.heading("Draft and cloth")
    drawdown = (f"{draft.title}: {draft.pattern!r}", draft._repr_png_())
    page.pictures([drawdown, ("The draft, woven and rendered", cloth)])
    return page


if __name__ == "__main__":
    sys.exit(main())
