"""The command line: `plycloth render`, `compare` and `fit`, for people with no script."""

import argparse
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ImageColor

from plycloth._color import decode
from plycloth._json import load, load_as
from plycloth._plycloth import __version__
from plycloth.compare import FEWEST_YARNS, HEIGHT, compare, subject
from plycloth.draft import Draft
from plycloth.fabric import Fabric, draft_yarns
from plycloth.image_file import READABLE, WRITABLE, ImageError
from plycloth.image_read import read_photograph
from plycloth.image_write import checked_dpi
from plycloth.light import EnvironmentLight, Light
from plycloth.overview import LIGHTINGS, overview
from plycloth.page import Page
from plycloth.presets import preset, presets
from plycloth.render import render
from plycloth.report import Comparison, save_fit
from plycloth.rig import RIG, PhotoRig
from plycloth.scene import Scene
from plycloth.wif import read_wif
from plycloth.yarn_set import Yarns

SIDES = ("front", "back")
CLOTH_SIDES = ("face", "back")

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
        0; 2 for bad input, about which one line is printed; 130 after Ctrl-C.

    Raises
    ------
    SystemExit
        By argparse, with 2 for unknown arguments, and with 0 for --help and --version.
    """
    options = _parser().parse_args(arguments)
    try:
        with _warnings_on_one_line():
            options.run(options)
    except KeyboardInterrupt:
        print("plycloth: interrupted", file=sys.stderr)
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
    _add_render(commands)
    _add_compare(commands)
    _add_fit(commands)
    return parser


def _add_render(commands: Any) -> None:
    command = commands.add_parser(
        "render",
        help="a picture of the cloth that a draft describes",
        description="Render the cloth that a draft describes, whole and in its colours, seen from"
        " straight above. A fabric or a scene that plycloth saved (.json) is rendered as well.",
    )
    command.set_defaults(run=_render)
    add = command.add_argument
    add("draft", metavar="DRAFT.wif", type=Path, help="a draft, or a .json that plycloth saved")
    _add_output(command)
    add("--spp", type=int, default=32, help="samples per pixel (default: %(default)s)")
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
    add(
        "--yarn",
        metavar="NAME",
        help="give all yarns the plies and twist of a measured yarn, scaled to the draft's"
        f" thickness: {', '.join(presets())} (default: three plies)",
    )
    add(
        "--fit-yarns",
        action="store_true",
        help="press and narrow yarns that pass through each other; those of a draft always are",
    )
    add("--side", choices=CLOTH_SIDES, default="face", help="of the cloth (default: %(default)s)")
    _add_light(command)
    _add_dpi(command)
    _add_common(command)


def _add_compare(commands: Any) -> None:
    command = commands.add_parser(
        "compare",
        help="several cloths and pictures side by side in one picture",
        description="Put cloths and pictures of cloth side by side, with their names. All cloths"
        " are rendered alike: pieces of the same size, in the same light.",
    )
    command.set_defaults(run=_compare)
    add = command.add_argument
    add(
        "inputs",
        metavar="INPUT",
        nargs="+",
        help="a draft (.wif), a fabric that plycloth saved (.json), a picture"
        f" ({', '.join(READABLE)}), or a measured yarn, of which a plain weave is shown:"
        f" {', '.join(presets())}",
    )
    _add_output(command)
    add("--spp", type=int, default=32, help="samples per pixel (default: %(default)s)")
    add("--height", type=int, default=HEIGHT, metavar="PIXELS", help="default: %(default)s")
    add(
        "--size-mm",
        type=float,
        nargs=2,
        metavar=("WIDTH", "HEIGHT"),
        help="of each piece of cloth (default: a square with a repeat of each cloth and at least"
        f" {FEWEST_YARNS} yarns of the coarsest)",
    )
    _add_light(command)
    _add_dpi(command)
    _add_common(command)


def _add_fit(commands: Any) -> None:
    command = commands.add_parser(
        "fit",
        help="a fabric from two photographs, one lit from the front and one from behind",
        description="Find the fabric on two photographs taken on a rig, that of Tang et al. 2024"
        " unless another is named (docs/conventions.md): one lit from the front, one from behind.",
    )
    command.set_defaults(run=_fit)
    add = command.add_argument
    add("front", metavar="FRONT.png", type=Path)
    add("back", metavar="BACK.png", type=Path)
    add(
        "-o",
        "--output",
        metavar="FOLDER",
        type=Path,
        required=True,
        help="gets fit.json, fabric.json, front.png, back.png and index.html",
    )
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
    _add_dpi(command)
    _add_common(command)


def _add_dpi(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "--dpi", type=float, help="resolution to note in the pictures, pixels per inch"
    )


def _add_output(command: argparse.ArgumentParser) -> None:
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        type=Path,
        required=True,
        help=".png, .tif or .jpg (sRGB, 8 bit) or .exr (linear, 32 bit)",
    )


def _add_light(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add(
        "--light",
        default="day",
        metavar="NAME",
        help=f"{', '.join(LIGHTINGS)}, or an environment map (.exr, .hdr) (default: %(default)s)",
    )
    add(
        "--ground",
        metavar="COLOR",
        help="what is seen through gaps: '#d0d0d0', 'white', or 'none' for the lights behind the"
        " cloth (default: a dark grey)",
    )


def _add_common(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("--seed", type=int, default=0, help="of the random numbers (default: %(default)s)")
    add("--threads", type=int, help="default: one per processor")
    add("--quiet", action="store_true", help="print nothing but errors")


def _render(options: argparse.Namespace) -> None:
    _check_output(options.output)
    checked_dpi("--dpi", options.dpi)
    scene, shown = _scene(options)
    image = render(
        scene,
        spp=options.spp,
        seed=options.seed,
        threads=options.threads,
        progress=_progress(options),
    )
    image.save(options.output, dpi=options.dpi)
    _say(options, f"{options.output}: {image.width} x {image.height} pixels of {shown}")


def _scene(options: argparse.Namespace) -> tuple[Scene, str]:
    """Return the scene to render, and what it shows in words."""
    if options.draft.suffix.lower() == ".json":
        if options.yarn is not None:
            raise ValueError("--yarn: is for a draft; a saved fabric has its own yarns")
        if options.untrimmed:
            raise ValueError("--untrimmed: is for a draft; a saved fabric has all its yarns")
        saved = load(options.draft)
        if isinstance(saved, Scene):
            if options.fit_yarns:
                raise ValueError("--fit-yarns: is for a draft or a fabric, not for a saved scene")
            if options.side != "face":
                raise ValueError("--side: is for a draft or a fabric, not for a saved scene")
            return replace(saved, **_ground("background", options)), f"the scene {options.draft}"
        if not isinstance(saved, Fabric):
            kind = type(saved).__name__
            raise ValueError(f"{options.draft}: holds a {kind}, but must hold a Fabric or a Scene")
        fabric = saved.fitted(progress=_progress(options)) if options.fit_yarns else saved
        shown = f"the fabric {options.draft}"
    else:
        draft = read_wif(options.draft, trim=not options.untrimmed)
        shown = repr(draft)
        if options.yarn is None:
            fabric = Fabric.from_draft(draft, progress=_progress(options))
        else:
            yarns = _scaled_preset(options.yarn, draft)
            fabric = Fabric.from_draft(draft, *yarns).fitted(progress=_progress(options))
    if options.side == "back":
        fabric, shown = fabric.turned_over(), f"the back of {shown}"
    scene = overview(
        fabric,
        _light(options.light),
        size_mm=options.size_mm,
        width=options.width,
        **_ground("ground", options),
    )
    return scene, shown


def _compare(options: argparse.Namespace) -> None:
    _check_output(options.output)
    checked_dpi("--dpi", options.dpi)
    subjects = [(Path(name).name, subject(name)) for name in options.inputs]
    image = compare(
        subjects,
        _light(options.light),
        size_mm=options.size_mm,
        height=options.height,
        spp=options.spp,
        seed=options.seed,
        threads=options.threads,
        progress=_progress(options),
        **_ground("ground", options),
    )
    image.save(options.output, dpi=options.dpi)
    _say(options, f"{options.output}: {', '.join(label for label, _ in subjects)}")


def _fit(options: argparse.Namespace) -> None:
    checked_dpi("--dpi", options.dpi)
    rig = RIG if options.rig is None else load_as(PhotoRig, options.rig)
    given = (options.front, options.back)
    photographs = [read_photograph(path, rig.gamma) for path in given]
    _check_folder(options.output, given)
    from plycloth.photo_fit import fit_photographs

    found = fit_photographs(*photographs, rig=rig, progress=_progress(options), **_chosen(options))
    pictures = found.pictures()
    comparisons = [
        Comparison(side, photograph, pictures[side])
        for side, photograph in zip(SIDES, photographs, strict=True)
    ]
    page = Page(f"Fabric of {options.front.name} and {options.back.name}")
    page.text(f"The geometry that fits best: {found.geometry}.")
    save_fit(
        options.output,
        page,
        found.result,
        comparisons,
        record=found.summary(),
        gamma=rig.gamma,
        dpi=options.dpi,
    )
    errors = zip(SIDES, found.result.errors, strict=True)
    summary = ", ".join(f"{side} {error:.1%}" for side, error in errors)
    _say(options, f"{options.output / 'index.html'}: relative errors {summary}")


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


def _chosen(options: argparse.Namespace) -> dict[str, Any]:
    """Return the arguments of `fit_photographs` that were given on the command line."""
    chosen: dict[str, Any] = {"seed": options.seed}
    if options.tie:
        chosen["tie"] = True
    if options.threads is not None:
        chosen["threads"] = options.threads
    if options.draft is not None:
        chosen["pattern"] = read_wif(options.draft).pattern
    return chosen


def _scaled_preset(name: str, draft: Draft) -> tuple[Yarns, Yarns]:
    """Return a measured yarn, enlarged to the thickness of each of the draft's threads."""
    measured = preset(name)
    return (
        draft_yarns(draft.warp_thickness, draft.warp_spacing, measured),
        draft_yarns(draft.weft_thickness, draft.weft_spacing, measured),
    )


def _light(name: str) -> str | tuple[Light, ...]:
    """Return the name of a lighting, or the light of an environment map."""
    if Path(name).suffix.lower() in READABLE:
        return (EnvironmentLight.load(name),)
    return name


def _ground(argument: str, options: argparse.Namespace) -> dict[str, Any]:
    """Return the colour of the ground as an argument, if one was given."""
    if options.ground is None:
        return {}
    if options.ground == "none":
        return {argument: None}
    try:
        display = ImageColor.getrgb(options.ground)[:3]
    except ValueError:
        raise ValueError(
            f"--ground: must be a colour such as '#d0d0d0' or 'white', or 'none', not"
            f" {options.ground!r}"
        ) from None
    return {argument: decode(np.divide(display, 255))}


def _check_output(path: Path) -> None:
    """See before the work that its result can be written."""
    if path.suffix.lower() not in WRITABLE:
        nearest = get_close_matches(path.suffix.lower(), WRITABLE, n=1, cutoff=0)[0]
        raise ImageError(
            f"{path}: must end in one of {', '.join(WRITABLE)}; the nearest is {nearest}"
        )
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}")


def _progress(options: argparse.Namespace) -> bool | None:
    return False if options.quiet else None


def _say(options: argparse.Namespace, text: str) -> None:
    if not options.quiet:
        print(text)


def _one_line(error: OSError | ValueError | MemoryError) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return " ".join(str(error).split())


@contextmanager
def _warnings_on_one_line() -> Iterator[None]:
    def show(message: Warning | str, *_: object) -> None:
        print(f"plycloth: warning: {' '.join(str(message).split())}", file=sys.stderr)

    with warnings.catch_warnings():
        warnings.simplefilter("always", UserWarning)
        warnings.showwarning = show  # type: ignore[assignment]
        yield
