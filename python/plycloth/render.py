"""Pictures of scenes by path tracing."""

import warnings

from plycloth import _plycloth
from plycloth._check import instance, integer, optional
from plycloth.image import Image
from plycloth.overlap import WORTH_A_WARNING, OverlapWarning
from plycloth.progress import Progress, relaxing, reporting
from plycloth.scene import Scene

MAX_SEED = 2**64 - 1
MAX_COUNT = 2**32 - 1

_spp = integer(1, MAX_COUNT)
_depth = optional(integer(1, MAX_COUNT))
_both_sides = instance(bool)
_seed = integer(0, MAX_SEED)
_threads = integer(1, 1024)


class Renderer:
    """A picture in the making, which can be stopped, looked at and gone on with.

    Every sample depends on (seed, pixel, sample) alone: the picture is the same bit for bit for
    any number of threads and passes, stopped in between or not. Time grows with the number of
    samples, memory with the number of pixels and of different 2 x 2 blocks of crossings that are
    seen: of cloth that repeats it is the same whatever its size, of a large draft 70 bytes for each
    crossing and some ten thousand for each block that light has reached.

    Parameters
    ----------
    scene
        What to render.
    seed
        Pictures with different seeds have independent noise; 0 to 2^64 - 1.
    max_depth
        Segments of the longest path, at least 1: 1 shows lights alone, 2 adds direct light. A ply
        counts once, whether light bounces off it or passes through. None: paths end by chance
        alone, and no light is lost. A preview may ask for less: 8 lose 1 to 7% in bright cloth.
    both_sides
        Whether light is looked for on both sides of every ply: less noise where it comes from
        behind the cloth, for more time per sample.
    threads
        Threads to use, unless `run` is given another number; None: one per processor.
    progress
        Of the relaxation. None: a bar where a person watches, after half a second; False: none; or
        a callable of (done, total). Ctrl-C ends it within a second.

    Raises
    ------
    ValueError
        If a number lies outside its range.
    MemoryError
        If the cloth has more crossings than there is memory for.
    TypeError
        If `scene` is not a Scene, a number is not whole, or `both_sides` not a bool.

    Warns
    -----
    OverlapWarning
        If yarns pass through each other by more than 10% of the thinner one's thickness.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        seed: int = 0,
        max_depth: int | None = None,
        both_sides: bool = False,
        threads: int | None = None,
        progress: Progress = None,
    ) -> None:
        if not isinstance(scene, Scene):
            raise TypeError(f"scene must be a Scene, not {type(scene).__name__}")
        self.scene = scene
        self._threads = None if threads is None else _threads("threads", threads)
        with relaxing(progress) as report:
            self._compiled = _plycloth.CompiledScene(scene, self._threads, report)
        self._warn_of_overlaps()
        self._film = _plycloth.CompiledFilm(
            self._compiled,
            _seed("seed", seed),
            _depth("max_depth", max_depth),
            _both_sides("both_sides", both_sides),
        )

    def _warn_of_overlaps(self) -> None:
        depth_mm = self._compiled.overlaps(self._threads)
        overlaps = self.scene.swatch.fabric.overlaps_of(depth_mm)
        if overlaps.worst > WORTH_A_WARNING:
            message = f"{overlaps}; fabric.fitted() has yarns that do not"
            warnings.warn(OverlapWarning(message), stacklevel=3)

    def run(self, spp: int, *, threads: int | None = None, progress: Progress = None) -> None:
        """Take `spp` more samples of every pixel.

        Ctrl-C ends it within a second; what was gathered is kept, and the next run also completes
        the one that was interrupted.

        Parameters
        ----------
        spp
            Samples per pixel, at least 1.
        threads
            Threads to use; None: as many as the Renderer was given.
        progress
            None: a bar where a person watches; False: none; or a callable of (done, total).

        Raises
        ------
        ValueError
            If a number lies outside its range.
        """
        spp = _spp("spp", spp)
        threads = self._threads if threads is None else _threads("threads", threads)
        total = self._film.remaining(spp)
        with reporting(progress, total, description="render", unit="sample") as report:
            self._film.run(self._compiled, spp, threads, report)

    @property
    def samples(self) -> int:
        """Samples per pixel asked for so far."""
        return self._film.samples

    def image(self) -> Image:
        """Return the picture as it is now, with the variance of each value."""
        compiled = self._compiled
        return Image(self._film.pixels(compiled), self._film.variance(compiled))


def render(
    scene: Scene,
    *,
    spp: int = 16,
    seed: int = 0,
    max_depth: int | None = None,
    both_sides: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> Image:
    """Render a picture of `scene` in linear light.

    Parameters are those of `Renderer` and of `Renderer.run`.

    Returns
    -------
    Image
        H x W x 3, with the variance of each value.

    Raises
    ------
    ValueError
        If a number lies outside its range.
    TypeError
        If `scene` is not a Scene, a number is not whole, or `both_sides` not a bool.

    Warns
    -----
    OverlapWarning
        If yarns pass through each other by more than 10% of the thinner one's thickness.
    """
    renderer = Renderer(
        scene,
        seed=seed,
        max_depth=max_depth,
        both_sides=both_sides,
        threads=threads,
        # A callable counts samples.
        progress=False if callable(progress) else progress,
    )
    renderer.run(spp, progress=progress)
    return renderer.image()
