"""Options in counts of the trade: threads per inch or centimetre, and yarns by their size."""

import argparse
from dataclasses import replace
from typing import Any

from plycloth._check import ParameterError, quoted
from plycloth.bsdf import PlyBsdf
from plycloth.draft import Draft
from plycloth.trade import DENSITIES, PACKING, checked_packing, density
from plycloth.yarn import RoundYarn

SETTS = ("ends", "picks")
SIDES = ("warp", "weft")
LENGTHS = {"inch": "inch", "in": "inch", "cm": "cm"}


def add_setts(command: argparse.ArgumentParser, default: str) -> None:
    """Add how close threads lie; `default` says what is taken otherwise."""
    for yarns in SETTS:
        command.add_argument(
            f"--{yarns}",
            metavar="N/LENGTH",
            type=_sett,
            help=f"so many {yarns} per inch or cm, such as 60/inch or 24/cm (default: {default})",
        )


def add_counts(command: argparse.ArgumentParser) -> None:
    """Add how close a draft's threads lie, and how much its yarns weigh."""
    add_setts(command, "the draft's")
    add = command.add_argument
    for side in SIDES:
        add(
            f"--{side}",
            metavar="SIZE",
            help=f"size of the {side} yarns: '20 tex', '20 tex x 2', '150 denier', '30/2 Ne',"
            " '2/28 Nm' (default: of three plies, as thick as the draft says); with --material",
        )
    add(
        "--material",
        metavar="NAME",
        help=f"of yarns whose size is given: {', '.join(DENSITIES)}, or a density in g/cm3",
    )
    add(
        "--packing",
        type=float,
        metavar="PART",
        help=f"part of a yarn of a given size that is fiber (default: {PACKING:g})",
    )


def check_counts(options: argparse.Namespace) -> None:
    """See that the options go together."""
    sized = [side for side in SIDES if getattr(options, side) is not None]
    if sized and options.material is None:
        raise ValueError(f"--{sized[0]}: needs --material: {', '.join(DENSITIES)}, or a density")
    if sized and options.yarn is not None:
        raise ValueError(f"--{sized[0]}: does not go together with --yarn")
    for name in ("material", "packing"):
        if not sized and getattr(options, name) is not None:
            raise ValueError(f"--{name}: is for yarns whose size is given by --warp or --weft")


def sized_yarns(options: argparse.Namespace) -> dict[str, RoundYarn]:
    """Return the yarns whose size is given, by their side."""
    return {side: _sized(side, options) for side in SIDES if getattr(options, side) is not None}


def with_counts(draft: Draft, options: argparse.Namespace, sized: dict[str, RoundYarn]) -> Draft:
    """Return the draft with the threads per length, and the thickness, that were given."""
    for yarns in SETTS:
        if (sett := getattr(options, yarns)) is not None:
            count, per = sett
            draft = draft.with_sett(**{yarns: count}, per=per)
    thickness: dict[str, Any] = {
        f"{side}_thickness": 2.0 * yarn.radius_mm for side, yarn in sized.items()
    }
    return replace(draft, **thickness)


def _sized(side: str, options: argparse.Namespace) -> RoundYarn:
    size, material = getattr(options, side), _material(options)
    packing = checked_packing("--packing", PACKING if options.packing is None else options.packing)
    try:
        return RoundYarn.of_size(size, PlyBsdf(), material=material, packing=packing)
    except ParameterError as error:
        raise ValueError(f"--{side}: {error}") from None


def _material(options: argparse.Namespace) -> float:
    try:
        number = float(options.material)
    except ValueError:
        return density(options.material)
    return density(number)


def _sett(text: str) -> tuple[float, str]:
    count, _, per = text.partition("/")
    try:
        threads = float(count)
    except ValueError:
        threads = 0.0
    if not 0.0 < threads < float("inf") or per not in LENGTHS:
        raise argparse.ArgumentTypeError(
            f"must be a number per inch or cm, such as 60/inch or 24/cm, not {quoted(text)}"
        )
    return threads, LENGTHS[per]
