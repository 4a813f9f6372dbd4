"""What a fit found, and how it shows itself."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plycloth.bsdf import PlyBsdf
from plycloth.fabric import Fabric
from plycloth.image import Image
from plycloth.lens import Lens
from plycloth.scene import Scene
from plycloth.shared_cloth import compiled_scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Estimate:
    """A fitted number.

    Parameters
    ----------
    label
        Its name, such as "warp.base_color.red".
    value
        What was found.
    unit
        The unit, empty for pure numbers.
    uncertainty
        Its standard error, in the same unit (to first order): what the errors that the fit left,
        and noise of 1% of the picture's mean in every cell, let it be off.
    identifiable
        False if it can be changed, together with others, without the pictures changing by more.
    partners
        The unknowns, at most three, that it trades with most: those whose errors go with its own.
    """

    label: str
    value: float
    unit: str
    uncertainty: float
    identifiable: bool
    partners: tuple[str, ...] = ()

    @property
    def doubt(self) -> str:
        """The uncertainty in words."""
        if self.identifiable:
            return f"± {self.uncertainty:.2g}"
        trades = f": trades with {', '.join(self.partners)}" if self.partners else ""
        return f"not identifiable{trades}"


@dataclass(frozen=True)
class Step:
    """One round: the objective before it, as predicted and as reached, and the trust radius."""

    before: float
    predicted: float
    reached: float
    radius: float
    accepted: bool


@dataclass(frozen=True, eq=False)
class Match:
    """A picture's cell averages in linear light, rows x columns x 3.

    Parameters
    ----------
    target
        As given.
    first, second
        As fitted, by two independent sets of paths.
    """

    target: FloatArray
    first: FloatArray
    second: FloatArray

    @property
    def fitted(self) -> FloatArray:
        """The mean of both sets."""
        return 0.5 * (self.first + self.second)

    @property
    def error(self) -> float:
        """Root mean squared difference over the mean of the target; all clipped to [0, 1].

        The square is estimated by the product of both sets' differences, which noise does not
        raise; 0 if noise makes that negative.
        """
        first, second = self._differences()
        return self._relative(first * second)

    @property
    def noisy_error(self) -> float:
        """The same of the mean of both sets, which noise raises."""
        first, second = self._differences()
        return self._relative((0.5 * (first + second)) ** 2)

    def _differences(self) -> tuple[FloatArray, FloatArray]:
        target, first, second = (
            np.clip(values, 0.0, 1.0) for values in (self.target, self.first, self.second)
        )
        return first - target, second - target

    def _relative(self, squares: FloatArray) -> float:
        return float(np.sqrt(max(squares.mean(), 0.0)) / np.clip(self.target, 0.0, 1.0).mean())


@dataclass(frozen=True, eq=False)
class FitResult:
    """The result of `fit`; in the manner of SciPy's OptimizeResult.

    Parameters
    ----------
    scenes
        The scenes with the fitted fabric in them.
    lenses
        Per picture: the camera's exposure and falloff; 1 and 0 if they were not looked for.
    estimates
        Each unknown with its value, unit and uncertainty.
    matches
        Per picture: target and fit.
    steps
        The rounds.
    evaluations
        Times that paths were re-weighted for value and derivatives.
    message
        Why it ended.
    """

    scenes: Sequence[Scene]
    lenses: Sequence[Lens]
    estimates: Sequence[Estimate]
    matches: Sequence[Match]
    steps: Sequence[Step]
    evaluations: int
    message: str

    @property
    def fabric(self) -> Fabric:
        """The fabric with the fitted BSDFs."""
        return self.scenes[0].swatch.fabric

    @property
    def bsdfs(self) -> tuple[PlyBsdf, PlyBsdf]:
        """The fitted BSDFs of warp and weft."""
        warp, weft = self.fabric.warp_kinds[0].bsdf, self.fabric.weft_kinds[0].bsdf
        assert isinstance(warp, PlyBsdf)
        assert isinstance(weft, PlyBsdf)
        return warp, weft

    @property
    def x(self) -> FloatArray:
        """The values of the estimates."""
        return np.array([estimate.value for estimate in self.estimates])

    @property
    def fun(self) -> float:
        """The objective: squared relative errors, summed over pictures."""
        reached = [step.reached for step in self.steps if step.accepted]
        return reached[-1] if reached else self.steps[0].before

    @property
    def nit(self) -> int:
        """Rounds."""
        return len(self.steps)

    @property
    def nfev(self) -> int:
        """The same as `evaluations`."""
        return self.evaluations

    @property
    def success(self) -> bool:
        """Whether it ended because nothing got better."""
        return self.message.startswith("converged")

    @property
    def errors(self) -> list[float]:
        """The relative error of each picture."""
        return [match.error for match in self.matches]

    def develop(self, image: Image, picture: int = 0) -> Image:
        """Apply exposure and falloff, as fitted for a picture, to a render."""
        return self.lenses[picture].develop(image)

    def predict(
        self,
        scene: Scene,
        cells: int,
        *,
        picture: int = 0,
        paths: int = 128,
        seed: int = 0,
        max_depth: int | None = None,
        threads: int | None = None,
    ) -> FloatArray:
        """Return the cell averages, cells x cells x 3, that the fit predicts for a scene.

        The yarns of the scene get the fitted BSDFs; exposure and falloff are those fitted for the
        given picture.
        """
        compiled = compiled_scene(scene, threads, bsdfs=self.bsdfs)
        values = compiled.cell_averages((cells, cells), paths, seed, max_depth, threads)
        return values * self.lenses[picture].gain((cells, cells))[0]

    def plot(self) -> Figure:
        """Draw each target beside its fit, and the objective from round to round."""
        from matplotlib.figure import Figure

        count = len(self.matches)
        figure = Figure(figsize=(2.6 * (count + 1), 5.2), layout="constrained")
        axes = figure.subplots(2, count + 1)
        for column, match in enumerate(self.matches):
            for row, (title, values) in enumerate(
                (("target", match.target), (f"fit, error {match.error:.1%}", match.fitted))
            ):
                axes[row, column].imshow(np.clip(values, 0.0, 1.0) ** (1 / 2.2))
                axes[row, column].set_title(f"picture {column + 1}: {title}", fontsize=8)
                axes[row, column].set_axis_off()
        convergence, spare = axes[0, count], axes[1, count]
        reached = np.array([step.before for step in self.steps] + [self.fun])
        convergence.plot(np.sqrt(np.maximum(reached, 0.0)), ".-")
        convergence.set_ylim(bottom=0.0)
        convergence.set_title("error (root of the objective)", fontsize=8)
        convergence.set_xlabel("round", fontsize=8)
        spare.set_axis_off()
        return figure

    def __repr__(self) -> str:
        errors = ", ".join(f"{error:.1%}" for error in self.errors)
        effort = f"{self.nit} rounds, {self.nfev} evaluations"
        return f"<FitResult: errors {errors}; {effort}; {self.message}>"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><td>{html.escape(e.label)}</td><td>{e.value:.4g}</td>"
            f"<td>{e.doubt}</td>"
            f"<td>{e.unit}</td></tr>"
            for e in self.estimates
        )
        data = io.BytesIO()
        self.plot().savefig(data, format="png", dpi=110)
        picture = base64.b64encode(data.getvalue()).decode()
        return (
            f"<p>{html.escape(repr(self)[1:-1])}</p>"
            f'<img src="data:image/png;base64,{picture}" alt="target and fit">'
            f"<table><tr><th>parameter</th><th>value</th><th></th><th>unit</th></tr>{rows}</table>"
        )
