"""Thread spacing from a photograph of cloth, by the peaks of its spectrum."""

from __future__ import annotations

import base64
import io
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from plycloth.image import Image
from plycloth.lattice import LARGEST_TILT, Lattice, fit_lattice, repeat_of, wrapped, yarn_vectors
from plycloth.spectrum import FloatArray, Peak, find_peaks, prominence

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SMALLEST_SIDE = 64
# In steps of the spectrum: peaks of cloth are wider than one, as its threads are not all parallel.
TOLERANCE_STEPS = 2.0
# What is found with less confidence is as likely to be wrong.
LEAST_CONFIDENCE = 0.3


class ConfidenceWarning(UserWarning):
    """What was read off a photograph may well be wrong."""


@dataclass(frozen=True)
class Spacing:
    """Distances between threads, in pixels; shows itself as the spectrum with what was read off.

    Attributes
    ----------
    warp_px, weft_px : float or None
        Distance between neighbouring vertical yarns (taken for warp) and between neighbouring
        horizontal ones, None where nothing stands out.
    warp_confidence, weft_confidence : float
        From 0, nothing found, to 1: the share of the peaks, weighted by the logarithm of their
        prominence, that lie on the lattice, less half of itself for the second peak, a quarter
        for the third and so on (two peaks make a lattice, more of them confirm it). Halved
        where no peak stands at the yarn's own frequency, so that it follows from diagonals only.
    repeat : int or None
        Threads after which a twill or satin repeats; 2 for a plain weave; 1 if only the yarns
        themselves are seen; None if one of the two sets is not.
    step : int or None
        Ends by which the weave moves to the right from one pick to the next below, in
        [0, repeat): 1 and repeat - 1 are twills, others satins.
    peaks : tuple of Peak
        What was found in the spectrum, the strongest first.
    on_lattice : tuple of bool
        Per peak whether these spacings explain it.
    spectrum : ndarray, (n, n)
        The prominence of every frequency, zero in the middle.
    """

    warp_px: float | None
    weft_px: float | None
    warp_confidence: float
    weft_confidence: float
    repeat: int | None
    step: int | None
    peaks: tuple[Peak, ...]
    on_lattice: tuple[bool, ...]
    spectrum: FloatArray = field(repr=False, compare=False)

    @property
    def confidence(self) -> float:
        """That of warp or weft, whichever is less."""
        return min(self.warp_confidence, self.weft_confidence)

    @property
    def doubt(self) -> str | None:
        """Why spacings and weave should not be relied on; None if they may be."""
        if self.confidence >= LEAST_CONFIDENCE:
            return None
        return (
            f"threads are hardly told by this photograph ({self._summary()}): spacings and weave"
            f" are guesses where the confidence is less than {LEAST_CONFIDENCE:.0%}; a sharper"
            " picture with the yarns upright and level helps, or the weave's draft"
        )

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the spectrum, its peaks (filled if explained) and the yarns' own frequencies.

        Parameters
        ----------
        ax : matplotlib Axes, optional
            Where to draw, else a new figure.

        Returns
        -------
        matplotlib Axes
        """
        from matplotlib.figure import Figure

        if ax is None:
            ax = Figure(figsize=(5, 5), layout="constrained").add_subplot()
        floor = np.log10(np.maximum(self.spectrum, 0.1))
        ax.imshow(floor, cmap="gray", extent=(-0.5, 0.5, 0.5, -0.5), vmax=3)
        for peak, explained in zip(self.peaks, self.on_lattice, strict=True):
            face = "tab:orange" if explained else "none"
            ax.plot(*peak.frequency, "o", ms=6, mec="tab:orange", mfc=face)
        for pitch, axis, style in ((self.warp_px, 0, "tab:red"), (self.weft_px, 1, "tab:cyan")):
            if pitch is not None:
                line = ax.axvline if axis == 0 else ax.axhline
                line(abs(1 / pitch - round(1 / pitch)), color=style, lw=0.8, ls="--")
        ax.set(xlabel="periods per pixel, x", ylabel="periods per pixel, y", title=self._summary())
        return ax

    def _summary(self) -> str:
        yarns = (
            f"{name} {pitch:.2f} px ({confidence:.0%})" if pitch is not None else f"{name}: none"
            for name, pitch, confidence in (
                ("warp", self.warp_px, self.warp_confidence),
                ("weft", self.weft_px, self.weft_confidence),
            )
        )
        repeat = "" if self.repeat in (None, 1) else f", repeat {self.repeat}"
        return ", ".join(yarns) + repeat

    def _repr_html_(self) -> str:
        data = io.BytesIO()
        figure = self.plot().get_figure(root=True)
        assert figure is not None
        figure.savefig(data, format="png", dpi=80)
        encoded = base64.b64encode(data.getvalue()).decode("ascii")
        doubt = "" if self.doubt is None else f"<p>Warning: {self.doubt}.</p>"
        return f'{doubt}<img alt="{self._summary()}" src="data:image/png;base64,{encoded}">'


def estimate_spacing(image: Image | npt.ArrayLike) -> Spacing:
    """Estimate the distances between threads from a photograph seen straight on.

    Woven cloth repeats, so the peaks of its spectrum lie on a lattice (`plycloth.lattice`). The
    shortest vectors of the lattice along x and y are the yarns' own frequencies; they follow from
    diagonal peaks too, so that yarns thinner than two pixels can be told from a twill's lines. How
    often the lattice holds that of the yarns is the weave's repeat.

    Yarns that always run side by side, as in a basket weave, read as one broad yarn. A pitch p
    below two pixels without diagonals can be taken for its alias p / (p - 1). Satins over eight
    and more ends have so fine a lattice that other vectors of it may pass for the yarns.

    Parameters
    ----------
    image : Image or array_like, (height, width) or (height, width, 3)
        In linear light, both sides at least 64 pixels, the yarns vertical and horizontal to
        within 8 degrees.

    Returns
    -------
    Spacing

    Raises
    ------
    ValueError
        On another shape, or values that are negative, infinite or NaN.
    """
    spectrum = prominence(_checked_light(image))
    peaks = find_peaks(spectrum)
    tolerance = TOLERANCE_STEPS / len(spectrum)
    lattice = fit_lattice(peaks, tolerance)
    if lattice is not None:
        yarns = yarn_vectors(lattice.basis)
        if yarns is not None:
            return _from_lattice(lattice, *yarns, peaks, tolerance, spectrum)
    return _from_axes(peaks, tolerance, spectrum)


def _from_lattice(
    lattice: Lattice,
    warp: FloatArray,
    weft: FloatArray,
    peaks: tuple[Peak, ...],
    tolerance: float,
    spectrum: FloatArray,
) -> Spacing:
    repeat, step = repeat_of(lattice.basis, warp, weft)
    confidences = [
        _confidence(peaks, lattice.explained) * (1.0 if _is_seen(yarn, peaks, tolerance) else 0.5)
        for yarn in (warp, weft)
    ]
    return Spacing(
        warp_px=_pitch(warp, weft),
        weft_px=_pitch(weft, warp),
        warp_confidence=confidences[0],
        weft_confidence=confidences[1],
        repeat=repeat,
        step=step,
        peaks=peaks,
        on_lattice=tuple(lattice.explained.tolist()),
        spectrum=spectrum,
    )


def _from_axes(peaks: tuple[Peak, ...], tolerance: float, spectrum: FloatArray) -> Spacing:
    """Take a fundamental and its harmonics along either axis, where there is no lattice."""
    pitches: list[float | None] = []
    confidences: list[float] = []
    on_lattice = np.zeros(len(peaks), dtype=bool)
    for axis in (0, 1):
        fundamental = _fundamental(peaks, axis)
        if fundamental is None:
            pitches.append(None)
            confidences.append(0.0)
            continue
        orders = np.array([peak.frequency[axis] for peak in peaks]) / fundamental
        along = np.array([_is_along(peak, axis) for peak in peaks])
        explained = along & (np.abs(orders - np.round(orders)) * fundamental <= tolerance)
        pitches.append(float(1 / fundamental))
        confidences.append(_confidence(peaks, explained))
        on_lattice |= explained
    return Spacing(
        warp_px=pitches[0],
        weft_px=pitches[1],
        warp_confidence=confidences[0],
        weft_confidence=confidences[1],
        repeat=None,
        step=None,
        peaks=peaks,
        on_lattice=tuple(on_lattice.tolist()),
        spectrum=spectrum,
    )


def _fundamental(peaks: tuple[Peak, ...], axis: int) -> float | None:
    return min((abs(p.frequency[axis]) for p in peaks if _is_along(p, axis)), default=None)


def _is_along(peak: Peak, axis: int) -> bool:
    along, across = abs(peak.frequency[axis]), abs(peak.frequency[1 - axis])
    return across <= LARGEST_TILT * along


def _is_seen(yarn: FloatArray, peaks: tuple[Peak, ...], tolerance: float) -> bool:
    places = np.array([peak.frequency for peak in peaks])
    both_ways = wrapped(np.concatenate([places - yarn, places + yarn]))
    return bool((np.hypot(*both_ways.T) <= tolerance).any())


def _confidence(peaks: tuple[Peak, ...], explained: npt.NDArray[np.bool_]) -> float:
    weights = np.log([peak.prominence for peak in peaks])
    share = weights[explained].sum() / weights.sum()
    return float(share * (1 - 0.5 ** np.count_nonzero(explained)))


def _pitch(yarn: FloatArray, other: FloatArray) -> float:
    """Distance between neighbouring yarns along the direction in which they follow each other.

    The spacing vectors are dual to the frequencies: one yarn on, none of the others.
    """
    return float(np.linalg.norm(other) / abs(yarn[0] * other[1] - yarn[1] * other[0]))


def _checked_light(image: Image | npt.ArrayLike) -> FloatArray:
    light = np.asarray(image, dtype=np.float64)
    if light.ndim == 3 and light.shape[2] == 3:
        light = light.mean(axis=2)
    if light.ndim != 2:
        raise ValueError(f"image: has the shape {light.shape}, but must be H x W or H x W x 3")
    if min(light.shape) < SMALLEST_SIDE:
        raise ValueError(
            f"image: has {light.shape[1]} x {light.shape[0]} pixels, but needs at least "
            f"{SMALLEST_SIDE} along both sides"
        )
    bad = np.count_nonzero(~(np.isfinite(light) & (light >= 0)))
    if bad:
        raise ValueError(f"image: {bad} pixels are negative, infinite or NaN")
    return light
