"""`plycloth render`: a picture of the cloth that a draft, a fabric or a scene describes."""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from plycloth._check import quoted
from plycloth._json import FormatError, load
from plycloth.cli.counts import add_counts, check_counts, sized_yarns, with_counts
from plycloth.cli.options import (
    add_common,
    add_picture,
    add_strict,
    check_inputs_stay,
    check_output,
    ground,
    light,
    progress,
    say,
)
from plycloth.draft import Draft
from plycloth.draft_yarns import draft_yarns
from plycloth.fabric import Fabric
from plycloth.gradual import render_to
from plycloth.image import Image
from plycloth.image_write import checked_dpi
from plycloth.overview import overview
from plycloth.presets import preset, presets
from plycloth.render import Renderer
from plycloth.scene import Scene
from plycloth.wif import read_wif
from plycloth.yarn import RoundYarn
from plycloth.yarn_set import Yarns

CLOTH_SIDES = ("face", "back")
SIDES_OF_END_ONE = ("left", "right")
# Options that say something of a draft, or of the yarns to make of it.
FOR_DRAFTS = (
    *("yarn", "recolor", "end_one", "untrimmed", "strict"),
    *("ends", "picks", "warp", "weft", "material", "packing"),
)


def add_render(commands: Any) -> None:
    """Add the command to those of the program."""
    command = commands.add_parser(
        "render",
        help="a picture of the cloth that a draft describes",
        description="Render the cloth that a draft describes, whole and in its colours, seen from"
        " straight above. A fabric or a scene that plycloth saved (.json) is rendered as well.",
    )
    command.set_defaults(run=_render)
    add = command.add_argument
    add("draft", metavar="DRAFT.wif", type=Path, help="a draft, or a .json that plycloth saved")
    add_picture(command)
    add(
        "--width",
        type=int,
        metavar="PIXELS",
        help="width of the picture (default: 16 pixels per yarn, 512 to 1024 on the longer side)",
    )
    add(
        "--size-mm",
        type=float,
        nargs=2,
        metavar=("WIDTH", "HEIGHT"),
        help="render a piece of this size, the draft repeated (default: the draft once)",
    )
    add(
        "--untrimmed",
        action="store_true",
        help="keep threads at the draft's margins that interlace with nothing",
    )
    add_strict(command)
    add_counts(command)
    add(
        "--yarn",
        metavar="NAME",
        help="give all yarns the plies and twist of a measured yarn, scaled to the draft's"
        f" thickness: {', '.join(presets())} (default: three plies)",
    )
    add(
        "--recolor",
        metavar="NUMBER=#RRGGBB",
        type=_recoloring,
        action="append",
        help="another colour in place of one of the draft's, counted from 1 in the order of the"
        " ends, then the picks, that have it first; may be given several times",
    )
    add(
        "--end-one",
        choices=SIDES_OF_END_ONE,
        help="on which side the draft's first end lies (default: left; much weaving software"
        " draws it at the right)",
    )
    add(
        "--fit-yarns",
        action="store_true",
        help="press and narrow yarns that pass through each other; those of a draft always are",
    )
    add("--side", choices=CLOTH_SIDES, default="face", help="of the cloth (default: %(default)s)")
    add_common(command)


def _render(options: argparse.Namespace) -> None:
    check_output(options.output)
    checked_dpi("--dpi", options.dpi)
    check_inputs_stay([options.draft, options.light], options.output)
    scene, shown = _scene(options)
    renderer = Renderer(scene, seed=options.seed, threads=options.threads)
    save = partial(Image.save, dpi=options.dpi)
    image = render_to(options.output, renderer, options.spp, save, progress=progress(options))
    say(options, f"{options.output}: {image.width} x {image.height} pixels of {shown}")


def _scene(options: argparse.Namespace) -> tuple[Scene, str]:
    """Return the scene to render, and what it shows in words."""
    if options.draft.suffix.lower() == ".json":
        for name in FOR_DRAFTS:
            if getattr(options, name):
                option = name.replace("_", "-")
                raise ValueError(f"--{option}: is for a draft; what is saved has its own yarns")
        saved = _saved(options.draft)
        if isinstance(saved, Scene):
            if options.fit_yarns:
                raise ValueError("--fit-yarns: is for a draft or a fabric, not for a saved scene")
            if options.side != "face":
                raise ValueError("--side: is for a draft or a fabric, not for a saved scene")
            return replace(saved, **ground("background", options)), f"the scene {options.draft}"
        if not isinstance(saved, Fabric):
            kind = type(saved).__name__
            raise ValueError(f"{options.draft}: holds a {kind}, but must hold a Fabric or a Scene")
        fabric = saved.fitted(progress=progress(options)) if options.fit_yarns else saved
        shown = f"the fabric {options.draft}"
    else:
        check_counts(options)
        sized = sized_yarns(options)
        draft = with_counts(_draft(options), options, sized)
        shown = repr(draft)
        yarns = _yarns(options, sized, draft)
        fabric = Fabric.from_draft(draft, *yarns).fitted(progress=progress(options))
        _say_sizes(options, sized, fabric)
    if options.side == "back":
        fabric, shown = fabric.turned_over(), f"the back of {shown}"
    scene = overview(
        fabric,
        light(options),
        size_mm=options.size_mm,
        width=options.width,
        **ground("ground", options),
    )
    return scene, shown


def _saved(path: Path) -> Any:
    """Load what plycloth saved; of a fit's folder that is not the record of the fit."""
    try:
        return load(path)
    except FormatError as error:
        fabric = path.with_name("fabric.json")
        if path.name != "fit.json" or not fabric.exists():
            raise
        raise FormatError(f"{error}; the fabric of this fit is {fabric}") from None


def _draft(options: argparse.Namespace) -> Draft:
    """Read the draft, turned and dyed as the options say."""
    draft = read_wif(options.draft, trim=not options.untrimmed, strict=options.strict)
    if options.end_one == "right":
        draft = draft.mirrored()
    return draft.recolored(dict(options.recolor)) if options.recolor else draft


def _recoloring(text: str) -> tuple[int, str]:
    number, equals, color = text.partition("=")
    if not equals or not number.isdecimal():
        raise argparse.ArgumentTypeError(
            f"must be NUMBER=#RRGGBB, such as 3=#aa3322, not {quoted(text)}"
        )
    return int(number), color


def _yarns(
    options: argparse.Namespace, sized: dict[str, RoundYarn], draft: Draft
) -> tuple[Yarns, Yarns]:
    """Return yarns as thick as the draft's threads, with plies and twist of those named."""
    measured = None if options.yarn is None else preset(options.yarn)
    return (
        draft_yarns(draft.warp_thickness, draft.warp_spacing, sized.get("warp", measured)),
        draft_yarns(draft.weft_thickness, draft.weft_spacing, sized.get("weft", measured)),
    )


def _say_sizes(options: argparse.Namespace, sized: dict[str, RoundYarn], fabric: Fabric) -> None:
    """Say how thick yarns of a given size are, and what of that the cloth leaves room for."""
    for side, yarn in sized.items():
        shape = getattr(fabric, f"{side}_kinds")[0]
        say(
            options,
            f"{side}: {getattr(options, side)} of {options.material} is {2 * yarn.radius_mm:.3g} mm"
            f" thick, in the cloth {2 * shape.half_width:.3g} x {shape.thickness:.3g} mm",
        )
