"""Types of the compiled core."""

from collections.abc import Callable, Sequence
from typing import Self, final

import numpy as np
import numpy.typing as npt

from plycloth.bsdf import PlyBsdf

# Heights and slopes, yarns x knots each.
_Curves = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]

__version__: str

class ConvergenceError(RuntimeError):
    """The relaxed cloth was not found."""

def cloth_digest(fabric: object) -> int: ...
def decode_codes(data: bytes, format: str) -> tuple[npt.NDArray[np.float32], bool]: ...
def decode_exr(
    data: bytes, layer: str | None = None
) -> tuple[npt.NDArray[np.float32], str, list[str]]: ...
def decode_radiance(data: bytes) -> npt.NDArray[np.float32]: ...
def fitted(
    fabric: object, threads: int | None = None, progress: object = None
) -> tuple[list[tuple[float, float, float]], list[tuple[float, float, float]], bool]: ...
def encode_exr(pixels: npt.NDArray[np.float32], dpi: float | None = None) -> bytes: ...
def relax(
    warp_up: npt.NDArray[np.bool_],
    warp: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]],
    weft: tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.float64]],
    collision_stiffness: float,
    progress: object = None,
) -> tuple[
    float,
    float,
    int,
    _Curves,
    _Curves,
]: ...
def to_srgb(codes: npt.NDArray[np.float32], profile: bytes) -> npt.NDArray[np.float32]: ...

@final
class CompiledCloth:
    def __new__(
        cls, fabric: object, threads: int | None = None, progress: object = None
    ) -> Self: ...
    def heights(
        self,
    ) -> tuple[
        float,
        float,
        int,
        _Curves,
        _Curves,
    ]: ...
    def overlaps(self, threads: int | None = None) -> npt.NDArray[np.float64]: ...
    def overlaps_beyond(self, part: float, threads: int | None = None) -> bool: ...

@final
class CompiledScene:
    def __new__(cls, scene: object, cloth: CompiledCloth, threads: int | None = None) -> Self: ...
    def cell_averages(
        self,
        grid: tuple[int, int],
        paths: int,
        seed: int,
        max_depth: int | None,
        threads: int | None = None,
    ) -> npt.NDArray[np.float64]: ...

@final
class CompiledFilm:
    def __new__(
        cls, scene: CompiledScene, seed: int, max_depth: int | None, both_sides: bool
    ) -> Self: ...
    def run(
        self,
        scene: CompiledScene,
        spp: int,
        threads: int | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> None: ...
    def image(self) -> tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]: ...
    @property
    def samples(self) -> int: ...
    def remaining(self, spp: int) -> int: ...
    def state(self) -> tuple[int, npt.NDArray[np.uint32]]: ...
    def restore(self, target: int, words: npt.NDArray[np.uint32]) -> None: ...
    def merge(self, words: npt.NDArray[np.uint32]) -> None: ...

@final
class CompiledTape:
    PARAMETERS: int
    MAX_PATHS: int
    def __new__(
        cls,
        scene: CompiledScene,
        grid: tuple[int, int],
        paths: int,
        seed: int,
        max_depth: int | None,
        threads: int | None = None,
        progress: Callable[[int], None] | None = None,
    ) -> Self: ...
    def evaluate(
        self, bsdfs: Sequence[PlyBsdf], threads: int | None = None
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
    @property
    def bytes(self) -> int: ...

@final
class CompiledInterface:
    def __new__(cls, eta: float, roughness: tuple[float, float]) -> Self: ...
    def eval(
        self, wo: npt.NDArray[np.float64], wi: npt.NDArray[np.float64]
    ) -> npt.NDArray[np.float64]: ...
    def pdf(
        self, wo: npt.NDArray[np.float64], wi: npt.NDArray[np.float64]
    ) -> npt.NDArray[np.float64]: ...
    def sample(
        self, wo: npt.NDArray[np.float64], u: npt.NDArray[np.float64]
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...

@final
class CompiledRibbon:
    def __new__(cls, bsdf: PlyBsdf, thickness_mm: float) -> Self: ...
    def eval(
        self,
        wo: npt.NDArray[np.float64],
        wi: npt.NDArray[np.float64],
        passages: int,
        seed: int,
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...
    def sample(
        self, wo: npt.NDArray[np.float64], seed: int
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]: ...

def body_reflection(
    base_color: tuple[float, float, float],
    cos_o: npt.NDArray[np.float64],
    cos_i: npt.NDArray[np.float64],
    eta: float,
    body: str,
) -> npt.NDArray[np.float64]: ...
