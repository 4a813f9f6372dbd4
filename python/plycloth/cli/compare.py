"""`plycloth compare`: several cloths and pictures in one picture."""

import argparse
from pathlib import Path
from typing import Any

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
from plycloth.compare import FEWEST_YARNS, HEIGHT, compare, subject
from plycloth.image_file import READABLE
from plycloth.image_write import checked_dpi
from plycloth.presets import presets


def add_compare(commands: Any) -> None:
    """Add the command to those of the program."""
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
    add_picture(command)
    add("--height", type=int, default=HEIGHT, metavar="PIXELS", help="default: %(default)s")
    add(
        "--size-mm",
        type=float,
        nargs=2,
        metavar=("WIDTH", "HEIGHT"),
        help="of each piece of cloth (default: a square with a repeat of each cloth and at least"
        f" {FEWEST_YARNS} yarns of the coarsest)",
    )
    add_strict(command)
    add_common(command)


def _compare(options: argparse.Namespace) -> None:
    check_output(options.output)
    checked_dpi("--dpi", options.dpi)
    check_inputs_stay([*options.inputs, options.light], options.output)
    subjects = [(Path(name).name, subject(name, strict=options.strict)) for name in options.inputs]
    image = compare(
        subjects,
        light(options),
        size_mm=options.size_mm,
        height=options.height,
        spp=options.spp,
        seed=options.seed,
        threads=options.threads,
        progress=progress(options),
        **ground("ground", options),
    )
    image.save(options.output, dpi=options.dpi)
    say(options, f"{options.output}: {', '.join(label for label, _ in subjects)}")
