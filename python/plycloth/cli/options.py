"""Options that several commands have, and what is made of them."""

import argparse
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ImageColor

from plycloth._check import quoted
from plycloth._color import decode
from plycloth.image_file import READABLE, WRITABLE, ImageError
from plycloth.light import EnvironmentLight, Light
from plycloth.overview import LIGHTINGS

# What errors about arguments of Python name, and the options of the command line that those come
# from.
OPTIONS = {
    "the preset": "--yarn",
    "a lighting": "--light",
    "the number of a colour": "--recolor",
    "a colour": "--recolor",
    "the draft has no colour": "--recolor: the draft has no colour",
    "Swatch.size_mm": "--size-mm",
    "covers": "--cover",
    **{
        name: f"--{name.replace('_', '-')}"
        for name in (
            "ends",
            "exposure",
            "height",
            "material",
            "packing",
            "picks",
            "seconds",
            "seed",
            "size_mm",
            "spp",
            "threads",
            "width",
            "width_mm",
        )
    },
}


def add_picture(command: argparse.ArgumentParser) -> None:
    """Add the picture to write, its samples, its light and what is seen through gaps."""
    add = command.add_argument
    add(
        "-o",
        "--output",
        metavar="FILE",
        type=Path,
        required=True,
        help=".png, .tif or .jpg (sRGB, 8 bit) or .exr (linear, 32 bit)",
    )
    add("--spp", type=int, default=32, help="samples per pixel (default: %(default)s)")
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
    add_dpi(command)


def add_dpi(command: argparse.ArgumentParser) -> None:
    """Add the resolution of pictures."""
    command.add_argument(
        "--dpi", type=float, help="resolution to note in the pictures, pixels per inch"
    )


def add_strict(command: argparse.ArgumentParser) -> None:
    """Add whether a faulty draft is refused."""
    command.add_argument(
        "--strict",
        action="store_true",
        help="end with an error where a colour or length of a draft cannot be read, or parts of"
        " it disagree (default: a warning and a guess)",
    )


def add_common(command: argparse.ArgumentParser) -> None:
    """Add what all commands have."""
    add = command.add_argument
    add("--seed", type=int, default=0, help="of the random numbers (default: %(default)s)")
    add("--threads", type=int, help="default: one per processor")
    add("--quiet", action="store_true", help="print nothing but warnings and errors")


def check_output(path: Path) -> None:
    """See before the work that its result can be written."""
    if path.suffix.lower() not in WRITABLE:
        raise ImageError(f"{path}: must end in one of {', '.join(WRITABLE)}")
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}")


def check_inputs_stay(inputs: Iterable[str | Path], output: Path) -> None:
    """See that the result replaces no file that it is made from."""
    for name in inputs:
        if output.exists() and Path(name).exists() and output.samefile(name):
            raise ValueError(f"{output}: is an input, and would be replaced; name another file")


def light(options: argparse.Namespace) -> str | tuple[Light, ...]:
    """Return the name of a lighting, or the light of an environment map."""
    name: str = options.light
    if Path(name).suffix.lower() in READABLE:
        return (EnvironmentLight.load(name),)
    return name


def ground(argument: str, options: argparse.Namespace) -> dict[str, Any]:
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
            f" {quoted(options.ground)}"
        ) from None
    return {argument: decode(np.divide(display, 255))}


def named_as_option(problem: str) -> str:
    """Return what is wrong with an argument of Python as what is wrong with its option."""
    for name, option in OPTIONS.items():
        if re.match(rf"{re.escape(name)}\b", problem):
            return option + problem.removeprefix(name)
    return problem


def progress(options: argparse.Namespace) -> bool | None:
    """Return the progress to report: none, or a bar where a person watches."""
    return False if options.quiet else None


def say(options: argparse.Namespace, text: str) -> None:
    """Print a line, unless quiet."""
    if not options.quiet:
        print(text)
