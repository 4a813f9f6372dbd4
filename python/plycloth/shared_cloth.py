"""Relaxed cloth that scenes share: one for all fabrics that differ in optics and colours alone."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING
from weakref import WeakValueDictionary

from plycloth import _plycloth
from plycloth.progress import Progress, relaxing

if TYPE_CHECKING:
    from plycloth.bsdf import PlyBsdf
    from plycloth.fabric import Fabric
    from plycloth.scene import Scene

# By what the cloth depends on; as long as a fabric or a scene holds it.
_shared: WeakValueDictionary[int, _plycloth.CompiledCloth] = WeakValueDictionary()

# Where a fabric keeps its cloth, beside its fields: no part of the value.
_OWN = "_cloth"


def relaxed_cloth(
    fabric: Fabric, threads: int | None = None, progress: Progress = None
) -> _plycloth.CompiledCloth:
    """Return the relaxed cloth of a fabric, which keeps it.

    It is relaxed if there is no fabric or scene any more that has the same one.
    """
    own: _plycloth.CompiledCloth | None = vars(fabric).get(_OWN)
    if own is not None:
        return own
    digest = _plycloth.cloth_digest(fabric)
    cloth = _shared.get(digest)
    if cloth is None:
        with relaxing(progress) as report:
            cloth = _plycloth.CompiledCloth(fabric, threads, report)
        _shared[digest] = cloth
    object.__setattr__(fabric, _OWN, cloth)
    return cloth


def compiled_scene(
    scene: Scene,
    threads: int | None = None,
    *,
    bsdfs: Sequence[PlyBsdf] | None = None,
    progress: Progress = False,
) -> _plycloth.CompiledScene:
    """Return a scene that is ready for rays, with other BSDFs of warp and weft if given."""
    cloth = relaxed_cloth(scene.swatch.fabric, threads, progress)
    dressed = scene if bsdfs is None else scene.with_bsdfs(*bsdfs)
    return _plycloth.CompiledScene(dressed, cloth, threads)
