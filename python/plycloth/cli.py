"""The command line: `plycloth render` and `plycloth fit`, for people with no script."""

import argparse
import sys
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from plycloth._json import load, load_as
from plycloth._plycloth import __version__
from plycloth.draft import Draft
from plycloth.fabric import Fabric, default_yarn
from plycloth.image import WRITABLE, Image, ImageError, read_image
from plycloth.light import EnvironmentLight, Light
from plycloth.overview import LIGHTINGS, overview
from plycloth.page import Page
from plycloth.presets import preset, presets
from plycloth.render import render
from plycloth.report import Comparison, save_fit
from plycloth.rig import RIG, PhotoRig
from plycloth.scene import Scene
from plycloth.wif import read_wif
from plycloth.yarn import RoundYarn

SIDES = ("front", "back")

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
    add(
        "-o",
        "--output",
        metavar="FILE",
        type=Path,
        required=True,
        help=".png (sRGB, 8 bit) or .exr (linear, 32 bit)",
    )
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
    add(
        "--light",
        default="day",
        metavar="NAME",
        help=f"{', '.join(LIGHTINGS)}, or an environment map .exr (default: %(default)s)",
    )
    _add_common(command)  # fmt: skip


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
    _add_common(command)  # fmt: skip


def _add_common(command: argparse.ArgumentParser) -> None:
    add = command.add_argument
    add("--seed", type=int, default=0, help="of the random numbers (default: %(default)s)")
    add("--threads", type=int, help="default: one per processor")
    add("--quiet", action="store_true", help="print nothing but errors")


def _render(options: argparse.Namespace) -> None:
    _check_output(options.output)
    scene, shown = _scene(options)
    image = render(
        scene,
        spp=options.spp,
        seed=options.seed,
        threads=options.threads,
        progress=_progress(options),
    )
    image.save(options.output)
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
            return saved, f"the scene {options.draft}"
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
            yarn = _scaled_preset(options.yarn, draft)
            fabric = Fabric.from_draft(draft, yarn, yarn).fitted(progress=_progress(options))
    size = None if options.size_mm is None else tuple(options.size_mm)
    return overview(fabric, _light(options.light), size_mm=size, width=options.width), shown


def _fit(options: argparse.Namespace) -> None:
    rig = RIG if options.rig is None else load_as(PhotoRig, options.rig)
    given = (options.front, options.back)
    photographs = [_photograph(path, rig.gamma) for path in given]
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
        options.output, page, found.result, comparisons, record=found.summary(), gamma=rig.gamma
    )
    errors = zip(SIDES, found.result.errors, strict=True)
    summary = ", ".join(f"{side} {error:.1%}" for side, error in errors)
    _say(options, f"{options.output / 'index.html'}: relative errors {summary}")


def _photograph(path: Path, gamma: float) -> Image:
    """Read a photograph; one in an EXR is linear already."""
    return read_image(path, None if path.suffix.lower() == ".exr" else gamma)


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


def _scaled_preset(name: str, draft: Draft) -> RoundYarn:
    """Return a measured yarn, enlarged to the median thickness of the draft's yarns."""
    default = default_yarn(draft.warp_thickness)
    measured = preset(name)
    scale = default.radius_mm / measured.radius_mm
    return replace(default, plies=measured.plies, pitch_mm=measured.pitch * scale)


def _light(name: str) -> str | tuple[Light, ...]:
    """Return the name of a lighting, or the light of an environment map."""
    if Path(name).suffix.lower() == ".exr":
        return (EnvironmentLight.load(name),)
    return name


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
