"""The rough dielectric interface against Mitsuba 3, direction by direction."""

import numpy as np
import plycloth as pc
import pytest

mi = pytest.importorskip("mitsuba", reason="the package mitsuba is not installed")
mi.set_variant("scalar_rgb")

PAIRS = 10_000


def unit_vectors(rng, n):
    w = rng.normal(size=(n, 3))
    # Rounded to single precision, so that both programs are asked the same.
    return (w / np.linalg.norm(w, axis=1)[:, None]).astype(np.float32).astype(np.float64)


def direction_pairs(interface):
    """Half of them anywhere on the sphere, half where the interface scatters to."""
    rng = np.random.default_rng(11)
    wo, wi = unit_vectors(rng, PAIRS), unit_vectors(rng, PAIRS)
    sampled, pdf = interface.sample(wo, rng.random((PAIRS, 3)))
    take = (pdf > 0) & (np.arange(PAIRS) % 2 == 0)
    wi[take] = sampled[take].astype(np.float32)
    return wo, wi


def theirs(interface, wo, wi):
    alpha_u, alpha_v = interface.roughness
    bsdf = mi.load_dict(
        {
            "type": "roughdielectric",
            "distribution": "ggx",
            "alpha_u": alpha_u,
            "alpha_v": alpha_v,
            "int_ior": interface.eta,
            "ext_ior": 1.0,
        }
    )
    context, interaction = mi.BSDFContext(), mi.SurfaceInteraction3f()
    value, pdf = np.empty(len(wo)), np.empty(len(wo))
    for i, (o, w) in enumerate(zip(wo, wi, strict=True)):
        interaction.wi = mi.Vector3f(*o)
        color, pdf[i] = bsdf.eval_pdf(context, interaction, mi.Vector3f(*w))
        value[i] = color[0]
    # Radiance shrinks by 1/eta^2 where it leaves the dense side: our form keeps energy.
    across = wo[:, 2] * wi[:, 2] < 0
    squared = np.where(wo[:, 2] > 0, interface.eta**2, interface.eta**-2)
    return {"eval": value * np.where(across, squared, 1.0), "pdf": pdf}


def rounding(interface, wo, wi):
    """What single precision leaves of a value, as a relative error.

    The cosine on the far side of a microfacet is the root of a difference of numbers of size one,
    c^2 = 1 - n^2 (1 - cos^2), which Mitsuba rounds to 2^-24 a few times: an error of n^2 / (2 c^2)
    of that in c, and so in the transmitted part 1 - F, which is proportional to c at the critical
    angle.
    """
    n = np.where(wo[:, 2] > 0, interface.eta, 1 / interface.eta)
    n = np.where(wo[:, 2] * wi[:, 2] < 0, n, 1.0)
    h = wo + n[:, None] * wi
    h /= np.linalg.norm(h, axis=1)[:, None]
    c = np.minimum(np.abs((wo * h).sum(axis=1)), np.abs((wi * h).sum(axis=1)))
    return 8 * 2**-24 * interface.eta**2 / (2 * c**2)


@pytest.mark.parametrize("roughness", [0.5, (0.2, 0.3), (0.4, 0.05), 0.01])
@pytest.mark.parametrize("eta", [1.33, 1.5, 2.0])
def test_rough_dielectric(eta, roughness):
    interface = pc.Interface(eta, roughness)
    wo, wi = direction_pairs(interface)
    expected, carried = theirs(interface, wo, wi), rounding(interface, wo, wi)
    for name, function in (("eval", interface.eval), ("pdf", interface.pdf)):
        ours = function(wo, wi)
        scattering = ours > 0
        assert scattering.sum() > PAIRS / 2
        error = np.abs(ours - expected[name])[scattering] / ours[scattering]
        assert (error < np.maximum(1e-3, carried[scattering])).all(), name
        # Few pairs need more than that, and most agree to single precision.
        assert (error > 1e-3).sum() < 0.005 * PAIRS
        assert np.median(error) < 2e-6
        # What we call impossible is so there, but for those at the very edge.
        assert (expected[name][~scattering & (carried < 1)] == 0).all()
