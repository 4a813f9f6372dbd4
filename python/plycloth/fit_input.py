"""What a fit is given, checked."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from plycloth._check import POSITIVE, ParameterError, integer, number, vector
from plycloth.bsdf import Bsdf, PlyBsdf
from plycloth.cells import cell_averages
from plycloth.lens import Lens
from plycloth.scene import Scene
from plycloth.yarn import Yarn

FloatArray = NDArray[np.float64]

_cells = integer(1, 256)


def scene_list(scenes: object) -> list[Scene]:
    """Return the scenes, one or several."""
    several = [scenes] if isinstance(scenes, Scene) else scenes
    if not isinstance(several, list | tuple) or not all(isinstance(s, Scene) for s in several):
        raise TypeError(f"scenes must be a Scene or a list of them, not {scenes!r}"[:200])
    return list(several)


def start_bsdfs(scenes: Sequence[Scene]) -> list[PlyBsdf]:
    """Return the BSDFs of warp and weft that all scenes start with."""
    if not scenes:
        raise ParameterError("scenes must hold at least one scene")
    fabric = scenes[0].swatch.fabric
    if any(scene.swatch.fabric != fabric for scene in scenes):
        raise ParameterError("scenes must all show the same fabric")
    if fabric.warp_colors is not None or fabric.weft_colors is not None:
        raise ParameterError("a fabric to be fitted must have no warp_colors and weft_colors")
    bsdfs = [
        _bsdf_of("warp", fabric.warp_kinds),
        _bsdf_of("weft", fabric.weft_kinds),
    ]
    if not all(isinstance(bsdf, PlyBsdf) for bsdf in bsdfs):
        raise ParameterError("a fabric to be fitted must have a PlyBsdf on warp and weft")
    return [bsdf for bsdf in bsdfs if isinstance(bsdf, PlyBsdf)]


def _bsdf_of(name: str, kinds: Sequence[Yarn]) -> Bsdf:
    """Return the BSDF that the yarns of a set share, whatever their shapes."""
    if any(yarn.bsdf != kinds[0].bsdf for yarn in kinds):
        raise ParameterError(
            f"a fabric to be fitted must have one BSDF for all yarns of its {name}, though they may"
            " differ in shape"
        )
    return kinds[0].bsdf


def start_lenses(lenses: Sequence[Lens] | None, pictures: int) -> list[Lens]:
    """Return a lens per picture."""
    if lenses is None:
        return [Lens()] * pictures
    if not isinstance(lenses, list | tuple) or not all(isinstance(each, Lens) for each in lenses):
        raise TypeError(f"lenses must be a list of Lens, not {lenses!r}"[:200])
    if len(lenses) != pictures:
        raise ParameterError(f"lenses must be one per scene: {pictures}, not {len(lenses)}")
    return list(lenses)


def fixed_pictures(fixed: Sequence[int], pictures: int) -> list[int]:
    """Return which pictures keep their lens."""
    if not isinstance(fixed, list | tuple | range):
        raise TypeError(f"fixed_lenses must be a list of numbers of pictures, not {fixed!r}"[:200])
    known = integer(0, pictures - 1)
    return [known(f"fixed_lenses[{i}]", each) for i, each in enumerate(fixed)]


def cell_counts(cells: int | Sequence[int], pictures: int) -> list[int]:
    """Return per picture how many rows and columns of cells it is compared by."""
    if isinstance(cells, list | tuple):
        return list(vector(pictures, _cells)("cells", cells))
    return [_cells("cells", cells)] * pictures


def picture_weights(weights: Sequence[float] | None, pictures: int) -> list[float]:
    """Return a weight per picture."""
    if weights is None:
        return [1.0] * pictures
    return list(vector(pictures, number(POSITIVE))("weights", weights))


def picture_targets(
    scenes: Sequence[Scene], images: object, cells: Sequence[int]
) -> list[FloatArray]:
    """Return the cell averages of each picture."""
    several = isinstance(images, (list, tuple))
    arrays: list[object] = list(images) if several else [images]  # type: ignore[call-overload]
    if len(arrays) != len(scenes):
        raise ParameterError(f"images must be one per scene: {len(scenes)}, not {len(arrays)}")
    return [
        _averages(f"images[{i}]", array, count)
        for i, (array, count) in enumerate(zip(arrays, cells, strict=True))
    ]


def _averages(name: str, image: object, cells: int) -> FloatArray:
    try:
        pixels = np.asarray(image, dtype=np.float64)
    except (TypeError, ValueError, OverflowError) as error:
        raise TypeError(f"{name} must be an Image or an array of numbers: {error}") from None
    if pixels.ndim != 3 or pixels.shape[2] != 3 or min(pixels.shape[:2]) < cells:
        raise ParameterError(
            f"{name} must be H x W x 3 with at least {cells} rows and columns, not {pixels.shape}"
        )
    if not np.isfinite(pixels).all() or (pixels < 0.0).any():
        raise ParameterError(f"{name} must hold finite numbers of at least 0")
    if not pixels.any():
        raise ParameterError(f"{name} must not be all black")
    return cell_averages(pixels, cells)
