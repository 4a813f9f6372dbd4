"""Finds the LLVM that Mitsuba's fast variant needs."""

import os
import re
from glob import glob

OLDEST = 19
PLACES = (
    "/usr/lib/*/libLLVM*.so*",
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "/usr/local/lib/libLLVM*.so*",
    "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
)


def variant() -> tuple[str, dict[str, str]]:
    """Mitsuba's variant to compare with, and what its environment needs."""
    path = os.environ.get("DRJIT_LIBLLVM_PATH") or newest()
    if path is None:
        return "scalar_rgb", {}
    return "llvm_ad_rgb", {"DRJIT_LIBLLVM_PATH": path}


def newest() -> str | None:
    """The newest shared library that is new enough."""
    found = [(version(path), path) for place in PLACES for path in glob(place)]
    return max((each for each in found if each[0] >= OLDEST), default=(0, None))[1]


def version(path: str) -> int:
    name = re.search(r"LLVM[-.](?:so\.)?(\d+)", os.path.basename(path))
    return int(name[1]) if name else 0
