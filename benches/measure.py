"""What every worker measures of itself, as one line of JSON."""

import json
import re
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path


def report(prepare: Callable[[], Callable[[int], None]], samples_per_spp: int, spp: int) -> None:
    """Print start-up seconds, samples per second and the peak memory of this process in MB.

    `prepare` makes the scene and returns what takes so many samples per pixel of its picture.
    Start-up ends when one sample per pixel has been taken, less the time that such a pass takes
    later: it holds relaxation, building and loading, and compiling of kernels; not the imports.
    """
    imported = peak()
    start = time.perf_counter()
    render = prepare()
    render(1)
    first = time.perf_counter() - start
    later = seconds(render, 1)
    rate = spp * samples_per_spp / seconds(render, spp)
    result = {"rate": rate, "startup_s": max(0.0, first - later), "peak_mb": peak()}
    print(json.dumps(result | {"imports_mb": imported}))


def seconds(render: Callable[[int], None], spp: int) -> float:
    start = time.perf_counter()
    render(spp)
    return time.perf_counter() - start


def peak() -> float:
    """The most memory that this process held, in MB.

    Linux hands the figure of getrusage down from the parent process, so its own record comes first.
    """
    status = Path("/proc/self/status")
    if status.exists():
        found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text(encoding="ascii"))
        if found:
            return int(found[1]) / 1024
    unit = 1024**2 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit
