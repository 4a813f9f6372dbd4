"""A picture that is there early and gets better: for a command that people watch."""

import os
from collections.abc import Callable
from pathlib import Path

from plycloth._check import integer
from plycloth.image import Image
from plycloth.progress import Progress, reporting
from plycloth.render import MAX_COUNT, Renderer

Save = Callable[[Image, Path], object]

_spp = integer(1, MAX_COUNT)


def render_to(
    path: Path, renderer: Renderer, spp: int, save: Save, *, progress: Progress = None
) -> Image:
    """Render to a file that holds the picture after one sample per pixel, two, four and so on.

    The file is replaced as a whole each time: who looks at it sees no half of a picture. The last
    picture is that of a render in one go.

    Parameters
    ----------
    path
        The file.
    renderer
        What takes the samples.
    spp
        Samples per pixel, at least 1.
    save
        Writes a picture to a file of the same suffix.
    progress
        None: a bar where a person watches; False: none; or a callable of (done, total).

    Returns
    -------
    Image
        The last picture.

    Raises
    ------
    ParameterError
        If `spp` is less than 1.
    KeyboardInterrupt
        On Ctrl-C. The file then holds what was gathered, which the message says, if every pixel
        has a sample; else it is as it was.
    """
    pixels = renderer.image().width * renderer.image().height
    spp, done = _spp("spp", spp), 0
    with reporting(progress, spp * pixels, description="render", unit="sample") as report:
        while done < spp:
            passes = max(1, min(done, spp - done))
            try:
                renderer.run(passes, progress=_part(report, done, passes, pixels))
            except KeyboardInterrupt:
                if done == 0:
                    raise
                replace_by(path, renderer.image(), save)
                kept = f"{path} holds the picture after {done} of {spp} samples per pixel"
                raise KeyboardInterrupt(kept) from None
            done += passes
            replace_by(path, renderer.image(), save)
    return renderer.image()


def replace_by(path: Path, image: Image, save: Save) -> None:
    """Put a picture in the place of a file, in one step."""
    target = path.resolve()
    part = target.with_name(f".{target.stem}.part{target.suffix}")
    try:
        save(image, part)
        os.replace(part, target)
    finally:
        part.unlink(missing_ok=True)


def _part(
    report: Callable[[int], None] | None, done: int, passes: int, pixels: int
) -> Callable[[int, int], None] | bool:
    """Return the progress of one run as part of the whole."""
    if report is None:
        return False

    def call(part: int, total: int) -> None:
        report(round(pixels * (done + passes * part / total)))

    return call
