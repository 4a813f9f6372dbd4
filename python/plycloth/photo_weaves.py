"""Which weaves a photograph's spectrum leaves open."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from plycloth.lattice import LARGEST_TILT
from plycloth.spectrum import Peak, find_peaks, prominence
from plycloth.weave import WeavePattern

FloatArray = NDArray[np.float64]
Weave = tuple[str, WeavePattern]

# Lines that stand out of noise by so many times more than those of the other way.
CLEARLY = 1.2
# A drawdown is looked at in a picture of this many pixels a side, by so many samples a pixel.
DRAWN_PIXELS, DRAWN_SAMPLES = 256, 4


def weaves(repeat: int | None, step: int | None = None) -> list[Weave]:
    """Return the common weaves with a repeat and a step, as `Spacing` has them.

    Without a repeat, or with one that no common weave has, those that cloth mostly is of: plain, a
    twill and a satin, both ways round.
    """
    if repeat == 2:
        return [("plain", WeavePattern.plain())]
    if repeat is None or repeat < 3 or step is None or np.gcd(step, repeat) > 1:
        return _common()
    if step in (1, repeat - 1):
        return _twills(repeat, step)
    return _satins(repeat, step)


def leaning(peaks: Sequence[Peak]) -> int:
    """Tell which way the strongest diagonal lines go: 1 rise to the right, -1 fall.

    0 if there are none, or as strong ones go the other way, as in a plain weave.
    """
    strongest = {1: 0.0, -1: 0.0}
    for peak in peaks:
        along, across = peak.frequency
        # What is nearer to an axis are yarns, on cloth that lies a little askew.
        if min(abs(along), abs(across)) > LARGEST_TILT * max(abs(along), abs(across)):
            # Lines stand across their frequency, and y points downwards.
            way = 1 if along * across > 0.0 else -1
            strongest[way] = max(strongest[way], peak.prominence)
    for way in (1, -1):
        if strongest[way] > CLEARLY * strongest[-way]:
            return way
    return 0


def leaning_of(pattern: WeavePattern, warp_px: float, weft_px: float) -> int:
    """Tell which way the lines of a weave go in a picture of such yarns, as `leaning` does."""
    places = (np.arange(DRAWN_PIXELS * DRAWN_SAMPLES) + 0.5) / DRAWN_SAMPLES
    ends = (places / warp_px).astype(int) % pattern.ends
    picks = (places / weft_px).astype(int) % pattern.picks
    fine = pattern.warp_up[np.ix_(picks, ends)].astype(np.float64)
    blocks = fine.reshape(DRAWN_PIXELS, DRAWN_SAMPLES, DRAWN_PIXELS, DRAWN_SAMPLES)
    # Peaks are told by how they stand out of noise, of which a drawing has none.
    noise = np.random.default_rng(0).uniform(0.0, 1.0, (DRAWN_PIXELS, DRAWN_PIXELS))
    return leaning(find_peaks(prominence(blocks.mean((1, 3)) + noise + 0.5)))


def that_lean(likely: Sequence[Weave], wanted: int, warp_px: float, weft_px: float) -> list[Weave]:
    """Return the weaves whose lines go as those of the photograph; all, if it has none."""
    kept = [weave for weave in likely if leaning_of(weave[1], warp_px, weft_px) == wanted]
    return kept if wanted and kept else list(likely)


def _common() -> list[Weave]:
    return [
        *weaves(2),
        *(("2/2 " + _hand(4, step), _stepped([1, 1, 0, 0], step)) for step in (1, 3)),
        *(weave for step in (2, 3) for weave in _satins(5, step)),
    ]


def _twills(repeat: int, step: int) -> list[Weave]:
    """Return twills that are mostly warp, mostly weft, and both alike."""
    overs = sorted({repeat - 1, 1, repeat // 2, repeat - repeat // 2}, reverse=True)
    return [
        (
            f"{over}/{repeat - over} {_hand(repeat, step)}",
            _stepped([1] * over + [0] * (repeat - over), step),
        )
        for over in overs
    ]


def _hand(repeat: int, step: int) -> str:
    """Name a twill as weavers do: Z rises to the right, S to the left."""
    return "Z twill" if step == repeat - 1 else "S twill"


def _satins(repeat: int, step: int) -> list[Weave]:
    face = _stepped([0] + [1] * (repeat - 1), step)
    name = f"{repeat}-end satin by {step}"
    return [
        (f"{name}, warp-faced", face),
        (f"{name}, weft-faced", WeavePattern(~face.warp_up)),
    ]


def _stepped(first: Sequence[int], step: int) -> WeavePattern:
    """Return the weave whose picks are the first, moved by `step` ends to the right each."""
    picks = [np.roll(first, step * pick) for pick in range(len(first))]
    return WeavePattern(np.array(picks, dtype=bool))
