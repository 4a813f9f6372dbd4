"""Time and memory against the size of the cloth."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure


def plot(scales: list[dict[str, Any]], path: Path) -> None:
    figure = Figure(figsize=(9, 3), layout="constrained")
    yarns = [row["yarns"] for row in scales]
    series = (
        ("microseconds per sample", [1e6 / row["rate"] for row in scales]),
        ("start-up, s", [row["startup_s"] for row in scales]),
        ("peak memory, MB", [row["peak_mb"] for row in scales]),
    )
    with mpl.rc_context({"axes.grid": True}):
        for axes, (label, values) in zip(figure.subplots(1, 3), series, strict=True):
            axes.plot(yarns, values, "o-")
            axes.set(xscale="log", xlabel="yarns across", ylabel=label, ylim=(0, 1.2 * max(values)))
    figure.savefig(path, dpi=120)
