"""Pictures as a differentiable function of a fabric's optical parameters, for any optimiser."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from plycloth import _plycloth
from plycloth._check import integer, optional, vector
from plycloth.fit_input import start_bsdfs
from plycloth.scene import Scene
from plycloth.shared_cloth import compiled_scene
from plycloth.unknowns import NAMES, SETS, columns_of, name_list, split_name

Array = NDArray[np.float64]

_grid = vector(2, integer(1, 4096))
_paths = integer(1, _plycloth.CompiledTape.MAX_PATHS)
_depth = optional(integer(1, 2**32 - 1))
_seed = integer(0, 2**64 - 1)
_threads = optional(integer(1, 1024))


def value_and_gradient(
    scene: Scene,
    by: Iterable[str] | None = None,
    *,
    cells: int | tuple[int, int] = 16,
    paths: int = 128,
    max_depth: int | None = None,
    seed: int = 0,
    threads: int | None = None,
) -> tuple[Array, dict[str, Array]]:
    """Render the averages of a picture's cells and their derivatives by optical parameters.

    Both are estimates without bias, by the same paths: their noise falls as 1/sqrt(paths), somewhat
    faster if that is a power of two. For one seed the averages change smoothly with the colours as
    far as paths stay the same; an optimiser that is to see past the noise takes a new seed for each
    step. Time and memory grow with cells x `paths`; a step takes a relaxation of the fabric.

    Parameters
    ----------
    scene
        Its fabric's warp and weft have a `PlyBsdf`, and no colours of their own.
    by
        Names of the parameters: fields of PlyBsdf, of both yarns ("base_color", which changes them
        together) or of one ("warp.base_color"). None: every one of each yarn.
    cells
        Rows and columns of the grid that divides the picture, 1 to 4096 each; one number for both.
    paths
        Paths per cell, 1 to 65536, best a power of two.
    max_depth
        As in `render`.
    seed
        Different seeds draw independent paths; 0 to 2^64 - 1.
    threads
        Threads to use; None: one per processor.

    Returns
    -------
    values : ndarray, (rows, columns, 3)
        Linear RGB.
    gradient : dict of str to ndarray
        For each name the derivatives of `values`: (rows, columns, 3) if it is one number, with
        another axis of the parameter's own 3 channels or 2 directions if it is several.

    Raises
    ------
    ParameterError
        If a name is unknown, a number lies outside its range, or the fabric has colours of its own
        or a BSDF of another kind.
    TypeError
        If a value is not of the kind named.
    """
    if not isinstance(scene, Scene):
        raise TypeError(f"scene must be a Scene, not {type(scene).__name__}")
    bsdfs = start_bsdfs([scene])
    names = _all_names() if by is None else name_list("by", by)
    places = {name: split_name(name) for name in names}
    rows, columns = _grid("cells", (cells, cells) if isinstance(cells, int) else cells)
    workers = _threads("threads", threads)
    count, number = _paths("paths", paths), _seed("seed", seed)
    depth = _depth("max_depth", max_depth)
    compiled = compiled_scene(scene, workers)
    tape = _plycloth.CompiledTape(compiled, (columns, rows), count, number, depth, workers)
    values, jacobian = tape.evaluate(bsdfs, workers)
    return values, {
        name: jacobian[:, list(sets), columns_of(field)]
        .sum(axis=1)
        .reshape(*values.shape, *np.shape(getattr(bsdfs[0], field)))
        for name, (sets, field) in places.items()
    }


def _all_names() -> list[str]:
    return [f"{yarns}.{field}" for yarns in SETS for field in NAMES]
