"""`make bench`: speed, start-up and memory beside Mitsuba 3, into bench-results/.

Every figure comes from a process of its own. What is compared is measured in turns, three times;
shown are medians, and of the ratios the smallest and largest, too: machines are noisy.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benches import llvm
from benches.plot import plot
from benches.scenes import COLOR, DISTANCE, FOV, write_weave

RESULTS = Path("bench-results")
TURNS = 3
SCALES = (10, 30, 100, 300, 1000, 2000, 4000)
BSDFS = {"diffuse": "diffuse against diffuse", "ply": "ply BSDF against principled"}

Job = dict[str, Any]


def run(program: str, job: Job, environment: dict[str, str] | None = None) -> Job:
    """Measure in a new process."""
    command = [sys.executable, "-m", f"benches.{program}", json.dumps(job)]
    environment = os.environ | (environment or {})
    result = subprocess.run(command, check=True, stdout=subprocess.PIPE, env=environment)
    return json.loads(result.stdout)


def compare(yarns: int, settings: Job) -> list[Job]:
    """Both programs on a weave of yarns x yarns, with each kind of BSDF."""
    variant, environment = llvm.variant()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        write_weave(yarns, Path(folder))
        for bsdf, title in BSDFS.items():
            job = settings | {"yarns": yarns, "bsdf": bsdf}
            theirs = job | {"variant": variant, "folder": folder, "color": COLOR}
            theirs |= {"fov": FOV, "distance": DISTANCE}
            row = {"yarns": yarns, "title": title, "variant": variant}
            turns = [(run("ours", job), run("theirs", theirs, environment)) for _ in range(TURNS)]
            row["ours"], row["theirs"] = (list(side) for side in zip(*turns, strict=True))
            rows.append(row)
            show(row)
    return rows


def show(row: Job) -> None:
    """Print medians of both programs, and the ratios' median and range."""
    print(f"\n{row['yarns']} x {row['yarns']} yarns, {row['title']} ({row['variant']})")
    for label, key, unit in (
        ("million samples/s", "rate", 1e6),
        ("start-up, s", "startup_s", 1.0),
        ("peak memory, MB", "peak_mb", 1.0),
    ):
        ours, theirs = ([turn[key] / unit for turn in row[side]] for side in ("ours", "theirs"))
        ratios = [mine / other for mine, other in zip(ours, theirs, strict=True)]
        print(
            f"  {label:18} ours {statistics.median(ours):9.3f}"
            f"  Mitsuba {statistics.median(theirs):9.3f}"
            f"  ratio {statistics.median(ratios):.3f} ({min(ratios):.3f} to {max(ratios):.3f})"
        )


def scale(settings: Job) -> list[Job]:
    """Our figures from small to large cloth."""
    jobs = [settings | {"yarns": yarns, "bsdf": "ply"} for yarns in SCALES]
    return [{"yarns": job["yarns"]} | run("ours", job) for job in jobs]


def main() -> None:
    parser = argparse.ArgumentParser(prog="benches", description=__doc__)
    parser.add_argument("--size", type=int, default=512, help="pixels across (default 512)")
    parser.add_argument("--spp", type=int, default=16, help="samples per pixel (default 16)")
    parser.add_argument("--depth", type=int, default=8, help="segments of a path (default 8)")
    settings = vars(parser.parse_args())
    if llvm.variant()[0] == "scalar_rgb":
        print(f"no LLVM {llvm.OLDEST} or newer found: Mitsuba runs its slower scalar variant")
    rows = [row for yarns in (100, 400) for row in compare(yarns, settings)]
    scales = scale(settings)
    RESULTS.mkdir(exist_ok=True)
    text = json.dumps({"settings": settings, "compared": rows, "scale": scales}, indent=2)
    (RESULTS / "bench.json").write_text(text + "\n", encoding="utf-8")
    plot(scales, RESULTS / "scale.png")
    print(f"\nwrote {RESULTS / 'bench.json'} and {RESULTS / 'scale.png'}")


if __name__ == "__main__":
    main()
