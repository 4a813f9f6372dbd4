import numpy as np
import plycloth as pc
import pytest
from plycloth.plot import knot_positions, yarn_curve


def test_knots_are_borders_and_middles_of_the_slots():
    assert knot_positions([1.0, 1.0]).tolist() == [0, 0.5, 1, 1.5, 2]
    assert knot_positions([1.0, 3.0]).tolist() == [0, 0.5, 1, 2.5, 4]


def test_curve_follows_a_cubic_exactly():
    """A cubic Hermite curve through values and slopes of a cubic is that cubic."""
    knots = np.array([0.0, 1.0, 1.5, 3.0])
    cubic = np.polynomial.Polynomial([0.5, 1.0, -2.0, 1.0])
    values, slopes = cubic(knots), cubic.deriv()(knots)
    x, y = yarn_curve(knots, values[:-1], slopes[:-1])
    inside = x <= 1.5  # the last segment leads back to the first knot's values, as yarns repeat
    assert y[inside] == pytest.approx(cubic(x[inside]), abs=1e-12)
    assert (x[-1], y[-1]) == (3.0, values[0])


def test_a_relaxed_weave_draws_its_first_ends():
    relaxed = pc.relax(pc.WeavePattern.twill(2, 2), warp_radius=0.4, weft_radius=0.4)
    figure = relaxed.plot(ends=2)
    assert len(figure.axes) == 2
    curve, picks = figure.axes[0].lines
    over = pc.WeavePattern.twill(2, 2).warp_up[:, 0]
    at_picks = np.interp(picks.get_xdata(), curve.get_xdata(), curve.get_ydata())
    assert ((at_picks > picks.get_ydata()) == over).all()
    assert len(relaxed.plot(ends=99).axes) == 4
    assert relaxed._repr_png_().startswith(b"\x89PNG")
    with pytest.raises(ValueError, match="at least 1"):
        relaxed.plot(ends=0)


def test_uneven_picks_are_drawn_where_they_lie():
    relaxed = pc.relax(
        pc.WeavePattern.plain(), warp_radius=0.3, weft_radius=0.3, weft_spacing=[0.5, 1.5]
    )
    curve, picks = relaxed.plot(ends=1).axes[0].lines
    assert picks.get_xdata().tolist() == [0.25, 1.25]
    assert curve.get_xdata()[-1] == 2.0
