"""Arithmetic, slices and DLPack of images, and what becomes of variances."""

import operator

import numpy as np
import plycloth as pc
import pytest

RNG = np.random.default_rng(5)
OPERATORS = [operator.add, operator.sub, operator.mul, operator.truediv]


def image(height=4, width=5, variance=True):
    shape = (height, width, 3)
    return pc.Image(
        RNG.uniform(0.5, 2, shape), RNG.uniform(0.001, 0.002, shape) if variance else None
    )


A, B = image(), image()


@pytest.mark.parametrize("operate", OPERATORS)
def test_pixels_are_those_of_arrays(operate):
    a, b = A.pixels.astype(float), B.pixels.astype(float)
    gains = np.array([1.0, 0.5, 2.0])
    for ours, expected in (
        (operate(A, B), operate(a, b)),
        (operate(A, 3), operate(a, 3)),
        (operate(3.0, A), operate(3.0, a)),
        (operate(A, np.float64(0.3)), operate(a, 0.3)),
        (operate(np.float32(0.5), A), operate(0.5, a)),
        (operate(A, gains), operate(a, gains)),
        (operate(gains, A), operate(gains, a)),
    ):
        assert isinstance(ours, pc.Image)
        np.testing.assert_allclose(ours.pixels, expected, rtol=1e-7)
        assert not ours.pixels.flags.writeable


@pytest.mark.parametrize("operate", OPERATORS)
def test_variances_of_independent_images_are_those_of_many_draws(operate):
    """20,000 draws tell a variance to 1%: five of its standard deviations."""
    draws = RNG.normal(size=(2, 20_000, 3))
    a, b = (
        each.pixels[0, 0] + np.sqrt(each.variance[0, 0]) * noise
        for each, noise in zip((A, B), draws, strict=True)
    )
    np.testing.assert_allclose(operate(A, B).variance[0, 0], operate(a, b).var(axis=0), rtol=0.05)
    for ours, drawn in (
        (operate(A, 3.0), operate(a, 3.0)),
        (operate(3.0, A), operate(3.0, a)),
        (operate(A, A), operate(a, a)),
    ):
        expected = drawn.var(axis=0)
        np.testing.assert_allclose(ours.variance[0, 0], expected, rtol=0.05, atol=1e-12)


def test_a_mean_of_renders_is_summed():
    mean = sum([A, B, image()]) / 3
    assert isinstance(mean, pc.Image)
    assert mean.variance.mean() == pytest.approx(0.0015 / 3, rel=0.1)
    assert -A + A.pixels == pc.Image(np.zeros((4, 5, 3)), A.variance)
    assert +A is A
    total = A
    total += B
    assert total == A + B


def test_without_a_variance_nothing_is_known():
    plain = image(variance=False)
    for result in (A + plain, plain / A, plain * 2, plain - plain):
        assert result.variance is None
    # Arrays are exact.
    assert (A + plain.pixels).variance is not None


def test_infinite_variances_and_zeros_stay_variances():
    once = pc.Image(np.ones((1, 1, 3)), np.full((1, 1, 3), np.inf))
    zero = pc.Image(np.zeros((1, 1, 3)), np.zeros((1, 1, 3)))
    assert np.isinf((once + 1).variance).all()
    assert ((once * 0).variance == 0).all()
    assert np.isinf((once / zero).pixels).all()
    assert np.isinf((once / zero).variance).all()


def test_what_is_no_picture_is_refused():
    with pytest.raises(pc.ParameterError, match="the same size, 5 x 4, not 4 x 4"):
        A + image(4, 4)
    with pytest.raises(pc.ParameterError, match=r"broadcast to the image's shape \(4, 5, 3\)"):
        A * np.ones(4)
    for wrong in ("2", None, True, [1, 2, 3], 1j):
        with pytest.raises(TypeError, match="unsupported operand"):
            A + wrong
    with pytest.raises(TypeError):
        A * np.array(["a"])


@pytest.mark.parametrize(
    ("pixels", "error", "message"),
    [
        ("x", TypeError, "pixels must hold real numbers, not 'x'"),
        (None, TypeError, "pixels must hold real numbers, not None"),
        ([["a"]], TypeError, "pixels must hold real numbers"),
        ([[1.0], [1.0, 2.0]], ValueError, "pixels .* rows differ in length"),
    ],
)
def test_pixels_are_numbers(pixels, error, message):
    with pytest.raises(error, match=message):
        pc.Image(pixels)


def test_numpy_still_takes_images():
    assert isinstance(np.sqrt(A), np.ndarray)
    np.testing.assert_array_equal(np.maximum(A, 1.0), np.maximum(A.pixels, 1.0))


def test_slices_are_images():
    piece = A[1:3, ::-1]
    assert isinstance(piece, pc.Image)
    np.testing.assert_array_equal(piece.pixels, A.pixels[1:3, ::-1])
    np.testing.assert_array_equal(piece.variance, A.variance[1:3, ::-1])
    assert A[2:] == pc.Image(A.pixels[2:], A.variance[2:])
    assert image(variance=False)[:1].variance is None
    assert A[:] == A


def test_other_indices_give_what_arrays_give():
    np.testing.assert_array_equal(A[1, 2], A.pixels[1, 2])
    np.testing.assert_array_equal(A[..., 0], A.pixels[..., 0])
    np.testing.assert_array_equal(A[A.pixels > 1], A.pixels[A.pixels > 1])
    with pytest.raises(IndexError):
        A[9, 0]
    with pytest.raises(pc.ParameterError, match="no pixel of an image of 5 x 4"):
        A[4:, :]


def test_dlpack_hands_over_a_copy():
    other = np.from_dlpack(A)
    np.testing.assert_array_equal(other, A.pixels)
    assert other.dtype == np.float32
    assert not np.shares_memory(other, A.pixels)
    assert A.__dlpack_device__() == (1, 0)
    with pytest.raises(BufferError, match="as a copy"):
        A.__dlpack__(copy=False)
    with pytest.raises(BufferError, match="not on the device"):
        A.__dlpack__(dl_device=(2, 0))
