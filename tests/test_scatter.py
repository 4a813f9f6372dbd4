import pickle
from dataclasses import replace

import numpy as np
import plycloth as pc
import pytest
from chi2 import p_value
from scipy.integrate import quad

WO = np.array([[0.48, -0.36, 0.8], [0.6, 0.3, np.sqrt(0.55)], [0.0, 0.0, 1.0]])
SIGNIFICANCE = 0.01
INTERFACE = pc.Interface(1.5, (0.4, 0.7))
RIBBON = pc.PlyLobes(
    pc.PlyBsdf(
        specular_tint=(0.9, 0.8, 0.7),
        base_color=(0.8, 0.5, 0.2),
        transmitted_color=(0.3, 0.6, 0.9),
        roughness=(0.4, 0.5),
        exit_roughness=(0.5, 0.6),
    ),
    thickness_mm=0.1,
)


def repeated(direction, count):
    return np.tile(direction, (count, 1))


def sampled_directions(wi):
    return wi[wi.any(axis=1)]


@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("wo", WO)
def test_interface_samples_follow_its_density(wo, side):
    draws = 50_000
    wo = wo * [1, 1, side]
    u = np.random.default_rng(3).random((draws, 3))
    wi, pdf = INTERFACE.sample(repeated(wo, draws), u)
    np.testing.assert_allclose(
        pdf[pdf > 0], INTERFACE.pdf(repeated(wo, draws), wi_or_up(wi))[pdf > 0]
    )
    p = p_value(
        sampled_directions(wi),
        lambda grid: INTERFACE.pdf(repeated(wo, len(grid)), grid),
        draws,
        points=100,
    )
    assert p > SIGNIFICANCE / (2 * len(WO))


def wi_or_up(wi):
    return np.where(wi.any(axis=1, keepdims=True), wi, [0.0, 0.0, 1.0])


def test_interface_is_reciprocal():
    """f(wo, wi) cos is symmetric up to the cosine and, across the interface, eta^2."""
    rng = np.random.default_rng(5)
    wo, wi = (w / np.linalg.norm(w, axis=1)[:, None] for w in rng.normal(size=(2, 1000, 3)))
    there = INTERFACE.eval(wo, wi) / np.abs(wi[:, 2])
    back = INTERFACE.eval(wi, wo) / np.abs(wo[:, 2])
    across = wo[:, 2] * wi[:, 2] < 0
    # Radiance over n^2 is what a refraction keeps: n is eta below and 1 above.
    inwards = np.where(wo[:, 2] > 0, INTERFACE.eta**2, INTERFACE.eta**-2)
    np.testing.assert_allclose(there, back * np.where(across, inwards, 1.0), rtol=1e-9)


@pytest.mark.parametrize("wo", WO)
def test_ribbon_samples_follow_its_density(wo):
    draws = 20_000
    wi, _ = RIBBON.sample(repeated(wo, draws), seed=1)
    p = p_value(
        sampled_directions(wi),
        lambda grid: RIBBON.pdf(repeated(wo, len(grid)), grid, passages=64),
        draws,
        points=12,
    )
    assert p > SIGNIFICANCE / len(WO)


def test_ribbon_values_integrate_to_its_sampled_weights():
    n = 200_000
    wo = repeated(WO[0], n)
    wi = np.random.default_rng(7).normal(size=(n, 3))
    wi /= np.linalg.norm(wi, axis=1)[:, None]
    values = 4 * np.pi * RIBBON.eval(wo, wi, passages=8)
    _, weights = RIBBON.sample(wo)
    error = np.sqrt((values.var(axis=0) + weights.var(axis=0)) / n)
    assert (np.abs(values.mean(axis=0) - weights.mean(axis=0)) < 4 * error).all()


WHITE = pc.PlyBsdf(base_color=1, transmitted_color=1, body_reflection=1)


def inclined(degrees, count):
    angle = np.radians(degrees)
    return repeated([np.sin(angle), 0.0, np.cos(angle)], count)


def smooth(**changes):
    """White, with one roughness for both interfaces."""
    roughness = changes.pop("roughness")
    return replace(WHITE, roughness=roughness, exit_roughness=roughness, **changes)


@pytest.mark.parametrize("roughness", [0.001, 0.05, 0.2])
@pytest.mark.parametrize("extinction", [0.0, 10.0, 1e6])
@pytest.mark.parametrize("reflection", [0.5, 1.0])
def test_uniform_light_is_never_returned_brighter(roughness, extinction, reflection):
    n = 20_000
    bsdf = smooth(roughness=roughness, extinction=extinction, body_reflection=reflection)
    for degrees in (0, 45, 80, 89.5):
        weights = pc.PlyLobes(bsdf).sample(inclined(degrees, n))[1][:, 0]
        assert weights.mean() < 1.0 + 1e-6 + 4.0 * weights.std() / np.sqrt(n)


def returned(bsdf, degrees, n=100_000):
    """The part of one directional light that a ribbon scatters to all sides, and its error.

    Mirrored and refracted light is reciprocal: its part is that of uniform light seen from there.
    """
    wi = inclined(degrees, n)
    black = pc.PlyLobes(replace(bsdf, base_color=0, transmitted_color=0))
    mirrored = black.sample(wi)[1][:, 0]
    u, turn, side = np.random.default_rng(1).random((3, n))
    turn *= 2 * np.pi
    cos = np.where(side < 0.5, 1, -1) * np.sqrt(1 - u)
    wo = np.stack([np.sqrt(u) * np.cos(turn), np.sqrt(u) * np.sin(turn), cos], axis=1)
    body = pc.PlyLobes(replace(bsdf, specular_tint=0)).eval(wo, wi, passages=8)[:, 0]
    # The density of wo is |cos| / (2 pi).
    scattered = 2 * np.pi * body / wi[:, 2]
    return mirrored.mean() + scattered.mean(), np.hypot(mirrored.std(), scattered.std()) / n**0.5


@pytest.mark.parametrize(
    ("degrees", "roughness", "extinction", "part"),
    [(89.5, 0.05, 10, 1.16), (89.5, 0.05, 1e6, 1.38), (89.5, 0.001, 1e6, 1.81), (0, 0.2, 0, 1.17)],
)
def test_one_light_is_returned_by_as_much_as_is_documented(degrees, roughness, extinction, part):
    found, error = returned(smooth(roughness=roughness, extinction=extinction), degrees)
    assert error < 0.004
    assert abs(found - part) < 0.005 + 4.0 * error


def test_ribbon_looks_the_same_from_both_sides():
    flipped = WO[:2] * [1, 1, -1]
    for given, expected in zip(
        RIBBON.sample(flipped, seed=9), RIBBON.sample(WO[:2], seed=9), strict=True
    ):
        np.testing.assert_array_equal(np.abs(given), np.abs(expected))
    values = RIBBON.eval(WO[:2], flipped)
    np.testing.assert_array_equal(RIBBON.eval(flipped, WO[:2]), values)


def test_directions_broadcast_as_numpy_does_it():
    wo, wi = WO[:, None], WO[None] * [1, 1, -1]
    rows = [np.broadcast_to(each, (3, 3, 3)).reshape(-1, 3) for each in (wo, wi)]
    for model in (INTERFACE, RIBBON):
        for method in (model.eval, model.pdf):
            values = method(wo, wi)
            assert values.shape[:2] == (3, 3)
            np.testing.assert_array_equal(values.reshape(9, -1), method(*rows).reshape(9, -1))
            one = method(WO[0], wi[0, 1])
            np.testing.assert_array_equal(one, method(WO[:1], wi[0, 1:2])[0])
    assert RIBBON.eval(WO[0], WO[1]).shape == (3,)
    assert RIBBON.pdf(WO[0], WO[1]).shape == ()
    assert RIBBON.eval(WO[:0], WO[0]).shape == (0, 3)


def test_samples_have_the_shape_of_the_directions():
    wo = np.broadcast_to(WO, (2, 3, 3))
    for ours, rows in zip(RIBBON.sample(wo), RIBBON.sample(wo.reshape(-1, 3)), strict=True):
        np.testing.assert_array_equal(ours, rows.reshape(2, 3, 3))
    wi, weight = RIBBON.sample(WO[0])
    assert wi.shape == weight.shape == (3,)
    u = np.random.default_rng(3).random((4, 1, 3))
    wi, pdf = INTERFACE.sample(WO, u)
    assert (wi.shape, pdf.shape) == ((4, 3, 3), (4, 3))
    expected = INTERFACE.sample(repeated(WO[1], 4), u[:, 0])[0]
    np.testing.assert_array_equal(wi[:, 1], expected)


def test_cosines_broadcast():
    cosines = np.array([0.2, 0.9])
    values = pc.body_reflection(0.5, cosines[:, None], cosines)
    assert values.shape == (2, 2, 3)
    np.testing.assert_array_equal(values[0, 1], pc.body_reflection(0.5, 0.2, 0.9))


def test_interfaces_of_a_ply_are_those_of_its_bsdf():
    assert RIBBON.entry == pc.Interface(1.5, (0.4, 0.5))
    assert RIBBON.exit == pc.Interface(1.5, (0.5, 0.6))


def test_reflecting_part_of_the_ribbon_is_its_interface_and_its_body():
    bsdf = pc.PlyBsdf(base_color=0, specular_tint=(0.9, 0.8, 0.7))
    lobes = pc.PlyLobes(bsdf)
    wi = WO[::-1]
    expected = lobes.entry.eval(WO, wi)[:, None] * bsdf.specular_tint
    np.testing.assert_allclose(lobes.eval(WO, wi, passages=1), expected, rtol=1e-12)


@pytest.mark.parametrize("color", [0.2, 0.5, 0.8, 1.0])
def test_conserving_body_has_the_albedo_of_its_base_color(color):
    """The hemispherical albedo: the mean over the cosine-weighted hemispheres, 2 mu each."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    mu, weights = 0.5 * (nodes + 1), 0.5 * weights
    cos_o, cos_i = (grid.ravel() for grid in np.meshgrid(mu, mu))
    values = pc.body_reflection(color, cos_o, cos_i)[:, 0]
    weight = np.outer(weights, weights).ravel() * 2 * cos_o * 2 * np.pi * cos_i
    assert (values * weight).sum() == pytest.approx(color, rel=2e-4)


@pytest.mark.parametrize(("cos_o", "albedo"), [(1.0, 0.650), (0.5, 0.721), (0.1, 0.873)])
def test_printed_body_has_the_albedo_of_eq_12(cos_o, albedo):
    """The directional albedo of Eq. 12's bracket at k = 0.5, eta = 1.46, by quadrature."""

    def integrand(mu):
        return mu * pc.body_reflection(0.5, [cos_o], [mu], eta=1.46, body="printed")[0, 0]

    assert 2 * np.pi * quad(integrand, 1e-12, 1)[0] == pytest.approx(albedo, abs=6e-4)


@pytest.mark.parametrize("value", [INTERFACE, RIBBON])
def test_compiled_values_still_pickle_and_compare(value):
    value.pdf(WO, WO)
    assert pickle.loads(pickle.dumps(value)) == value


UP = np.array([[0.0, 0.0, 1.0]])
NAN = np.array([[np.nan, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: INTERFACE.eval(1.0, UP), r"wo must be an array of \.\.\. x 3"),
        (lambda: INTERFACE.eval(UP, UP[:, :2]), r"wi must be an array of \.\.\. x 3 .* not 1 x 2"),
        (lambda: INTERFACE.pdf(NAN, UP), r"wo\[0, 0\] must be finite"),
        (lambda: INTERFACE.pdf(UP, 1.1 * UP), r"wi\[0\] must have length 1, not 1.1"),
        (lambda: INTERFACE.pdf(1.1 * UP[0], UP), r"wo must have length 1, not 1.1"),
        (lambda: INTERFACE.eval(WO[:2], WO), r"wi must broadcast with wo, .* \(2,\), .* \(3,\)"),
        (lambda: INTERFACE.sample(UP, UP[:, :2]), r"u must be an array of \.\.\. x 3"),
        (lambda: INTERFACE.sample(UP, 2 * UP), r"u\[0, 2\] must be in \[0, 1\]"),
        (lambda: INTERFACE.sample(WO[:2], WO**2), "u must broadcast with wo"),
        (lambda: pc.Interface(0.9), r"Interface.eta must be in \[1.01, 3\]"),
        (lambda: pc.Interface(1.5, 0.0), r"Interface.roughness.* must be in \[0.001, 1\]"),
        (lambda: pc.PlyLobes(pc.PlyBsdf(), 0.0), "PlyLobes.thickness_mm must be"),
        (lambda: RIBBON.eval(UP, 2 * UP), r"wi\[0\] must have length 1"),
        (lambda: RIBBON.pdf(UP, UP, passages=0), "passages must be in"),
        (lambda: RIBBON.sample(UP, seed=-1), "seed must be in"),
        (lambda: pc.body_reflection(2, [1], [1]), r"base_color\[0\]|base_color must be in"),
        (lambda: pc.body_reflection(0.5, [0.0], [1]), r"cos_o\[0\] must be in"),
        (lambda: pc.body_reflection(0.5, [1, 1, 1], [1, 1]), "cos_i must broadcast with cos_o"),
        (lambda: pc.body_reflection(0.5, [1], [1], eta=4), "eta must be in"),
        (lambda: pc.body_reflection(0.5, [1], [1], body="print"), "nearest is 'printed'"),
    ],
)
def test_bad_input_names_the_argument(call, message):
    with pytest.raises(pc.ParameterError, match=message):
        call()


def test_what_is_no_array_of_numbers_is_refused():
    with pytest.raises(TypeError, match="wo must hold real numbers"):
        INTERFACE.eval([["a", "b", "c"]], UP)
    with pytest.raises(TypeError, match=r"PlyLobes\.bsdf must be a PlyBsdf"):
        pc.PlyLobes(pc.DiffuseBsdf())
