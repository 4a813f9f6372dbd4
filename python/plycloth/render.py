"""Pictures of scenes by path tracing."""

from __future__ import annotations

import warnings
from typing import Any

from plycloth import _plycloth
from plycloth._check import ParameterError, instance, integer, optional
from plycloth.image import Image
from plycloth.overlap import WORTH_A_WARNING, OverlapWarning
from plycloth.progress import Progress, reporting
from plycloth.scene import Scene
from plycloth.shared_cloth import compiled_scene, relaxed_cloth

MAX_SEED = 2**64 - 1
MAX_COUNT = 2**32 - 1

_spp = integer(1, MAX_COUNT)
_depth = optional(integer(1, MAX_COUNT))
_both_sides = instance(bool)
_seed = integer(0, MAX_SEED)
_threads = integer(1, 1024)

# What a Renderer makes of the rest of its state.
_COMPILED = ("_compiled", "_film")
# What two Renderers must have in common for their samples to be of one picture.
_SETTINGS = ("scene", "max_depth", "both_sides")


class Renderer:
    """A picture in the making, which can be stopped, looked at, gone on with, sent and merged.

    Every sample depends on (seed, pixel, sample) alone: the picture is the same bit for bit for
    any number of threads and passes, stopped in between or not. Time grows with the number of
    samples, memory with the number of pixels (20 bytes each, and 24 in its image) and of different
    2 x 2 blocks of crossings that are seen: of cloth that repeats it is the same whatever its size.

    All methods may be called from any thread, also while another one runs, and from the callback
    of `progress`. A Renderer can be pickled, with all the samples it has taken, and gone on with
    by the same version of plycloth.

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
        Whether light is looked for on both sides of every ply, rather than beyond those alone that
        a lamp stands behind: less noise where a light with extent is behind the cloth, for more
        time per sample.
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
        self.seed = _seed("seed", seed)
        self.max_depth = _depth("max_depth", max_depth)
        self.both_sides = _both_sides("both_sides", both_sides)
        self._seeds = frozenset([self.seed])
        self._compile(progress)
        self._warn_of_overlaps()

    def _compile(self, progress: Progress = None) -> None:
        self._compiled = compiled_scene(self.scene, self._threads, progress=progress)
        self._film = _plycloth.CompiledFilm(
            self._compiled, self.seed, self.max_depth, self.both_sides
        )

    def __getstate__(self) -> dict[str, Any]:
        state = {name: value for name, value in vars(self).items() if name not in _COMPILED}
        return state | {"film": self._film.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        film = state.pop("film")
        vars(self).update(state)
        self._compile(progress=False)
        self._film.restore(*film)

    def _warn_of_overlaps(self) -> None:
        fabric = self.scene.swatch.fabric
        if not relaxed_cloth(fabric).overlaps_beyond(WORTH_A_WARNING, self._threads):
            return
        overlaps = fabric.overlaps(threads=self._threads)
        message = f"{overlaps}; fabric.fitted() has yarns that do not"
        warnings.warn(OverlapWarning(message), stacklevel=3)

    def run(self, spp: int, *, threads: int | None = None, progress: Progress = None) -> None:
        """Take `spp` more samples of every pixel, one of all before the next of any.

        Ctrl-C ends it within a second, and so does an exception from `progress`; what was gathered
        is kept, equally many samples of all pixels or one more, and the next run also completes the
        one that was stopped.

        Parameters
        ----------
        spp
            Samples per pixel, at least 1.
        threads
            Threads to use; None: as many as the Renderer was given.
        progress
            None: a bar where a person watches; False: none; or a callable of (done, total), in
            samples of single pixels, which may look at the `image`.

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
        """Samples that every pixel has by now; some may have one more."""
        return self._film.samples

    def image(self) -> Image:
        """Return the picture as it is now, with the variance of each value.

        Means are as exact as single precision allows; variances are stored with 14 bits, which
        after n samples leaves them within about sqrt(n) / 50000 of what the samples say: 0.13% at
        4096, where chance alone makes them 2% uncertain. Before the second sample of a pixel its
        variance is infinite, before the first it is black.
        """
        return Image.adopt(*self._film.image())

    def merge(self, other: Renderer) -> None:
        """Add the samples that another Renderer of the same scene has taken with another seed.

        The picture is then that of all samples, whichever seed they are of; `run` goes on with
        this one's. So a picture may be shared out among processes or machines: each renders with a
        seed of its own, and is pickled and sent back.

        Parameters
        ----------
        other
            Has the same scene, `max_depth` and `both_sides`, and stays as it is.

        Raises
        ------
        ParameterError
            If the scene or a setting differs, or both have taken samples of one seed.
        TypeError
            If `other` is not a Renderer.
        """
        if not isinstance(other, Renderer):
            raise TypeError(f"other must be a Renderer, not {type(other).__name__}")
        for name in _SETTINGS:
            if getattr(self, name) != getattr(other, name):
                raise ParameterError(f"other must have the same {name}: it is another picture")
        if shared := self._seeds & other._seeds:
            raise ParameterError(
                f"other must have taken other samples, but both have those of seed {min(shared)};"
                " give each Renderer a seed of its own"
            )
        _, samples = other._film.state()
        self._film.merge(samples)
        self._seeds |= other._seeds


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
