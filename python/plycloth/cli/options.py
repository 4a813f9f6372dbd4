"""Options that several commands have, and what is made of them."""

import argparse
from difflib import get_close_matches
from pathlib import Path
from typing import Any

import numpy as np
from PIL import ImageColor

from plycloth._color import decode
from plycloth.image_file import READABLE, WRITABLE, ImageError
from plycloth.light import EnvironmentLight, Light
from plycloth.overview import LIGHTINGS


def add_output(command: argparse.ArgumentParser) -> None:
    """Add the picture to write."""
    command.add_argument(
        "-o",
        "--output",
        metavar="FILE",
        type=Path,
        required=True,
        help=".png, .tif or .jpg (sRGB, 8 bit) or .exr (linear, 32 bit)",
    )


def add_light(command: argparse.ArgumentParser) -> None:
    """Add the light, and what is seen through gaps."""
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


def add_dpi(command: argparse.ArgumentParser) -> None:
    """Add the resolution of pictures."""
    command.add_argument(
        "--dpi", type=float, help="resolution to note in the pictures, pixels per inch"
    )


def add_common(command: argparse.ArgumentParser) -> None:
    """Add what all commands have."""
    add = command.add_argument
    add("--seed", type=int, default=0, help="of the random numbers (default: %(default)s)")
    add("--threads", type=int, help="default: one per processor")
    add("--quiet", action="store_true", help="print nothing but errors")


def check_output(path: Path) -> None:
    """See before the work that its result can be written."""
    if path.suffix.lower() not in WRITABLE:
        nearest = get_close_matches(path.suffix.lower(), WRITABLE, n=1, cutoff=0)[0]
        raise ImageError(
            f"{path}: must end in one of {', '.join(WRITABLE)}; the nearest is {nearest}"
        )
    if not path.parent.is_dir():
        raise ValueError(f"{path}: there is no folder {path.parent}")


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
            f" {options.ground!r}"
        ) from None
    return {argument: decode(np.divide(display, 255))}


def progress(options: argparse.Namespace) -> bool | None:
    """Return the progress to report: none, or a bar where a person watches."""
    return False if options.quiet else None


def say(options: argparse.Namespace, text: str) -> None:
    """Print a line, unless quiet."""
    if not options.quiet:
        print(text)
