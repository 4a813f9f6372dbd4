"""The lobes of the ply BSDF in plain numpy, written from the papers, no code of the core.

Montazeri et al. 2020, section 4, with the corrections that src/scatter/ply.rs states: refraction in
the form that keeps energy, one microfacet at y whose Fresnel term is F_y, and Chandrasekhar's
half-space in place of Eq. 12. Directions are ... x 3 unit vectors that point away from the surface,
z along its normal, x along the fiber. What is random in the core is integrated here.
"""

from dataclasses import dataclass

import numpy as np


def dot(a, b):
    return (a * b).sum(axis=-1)


def unit(v):
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


# --- Interfaces (Walter et al. 2007) ----------------------------------------------------------


def reflectance(cosine, eta):
    """Fresnel's equations as Walter et al. have them (Eq. 22); `eta` is far over near index."""
    c = np.maximum(cosine, 0.0)
    inner2 = eta**2 - 1.0 + c * c
    total = inner2 <= 0.0
    g = np.sqrt(np.where(total, 1.0, inner2))
    parallel = (c * (g + c) - 1.0) / (c * (g - c) + 1.0)
    return np.where(total, 1.0, 0.5 * ((g - c) / (g + c)) ** 2 * (1.0 + parallel**2))


def density(h, widths):
    """D of GGX: the slopes' density p22 over cos^4 (Heitz 2014, Eq. 85)."""
    a, b = widths
    slope2 = (h[..., 0] / (a * h[..., 2])) ** 2 + (h[..., 1] / (b * h[..., 2])) ** 2
    return 1.0 / (np.pi * a * b * h[..., 2] ** 4 * (1.0 + slope2) ** 2)


def masking(w, widths):
    """G1 of Smith by Heitz's Lambda (2014, Eqs. 80 and 86)."""
    a, b = widths
    tangent2 = ((a * w[..., 0]) ** 2 + (b * w[..., 1]) ** 2) / w[..., 2] ** 2
    return 1.0 / (1.0 + 0.5 * (np.sqrt(1.0 + tangent2) - 1.0))


def mirrored(wo, wi, eta, widths):
    """Walter's Eq. 20 with the cosine of wi; both above."""
    h = unit(wo + wi)
    value = reflectance(dot(wo, h), eta) * density(h, widths) * masking(wo, widths)
    value = value * masking(wi, widths) / (4.0 * wo[..., 2])
    return np.where(wi[..., 2] > 0.0, value, 0.0)


def refracted(wo, wi, eta, widths):
    """Walter's Eq. 21 with the cosine of wi, such that it integrates to what passes; wi below.

    `eta` is the index below over that above. Walter's is the BTDF of light that comes along i and
    leaves along o; light that is seen from wo is followed against its way: i = wo, o = wi.
    """
    h = unit(wo + np.asarray(eta)[..., None] * wi)
    h = h * np.where(h[..., 2:] < 0.0, -1.0, 1.0)
    cos_o, cos_i = dot(wo, h), dot(wi, h)
    value = np.abs(cos_o * cos_i) * eta**2 * (1.0 - reflectance(cos_o, eta))
    value = value * masking(wo, widths) * masking(wi, widths) * density(h, widths)
    value = value / (np.abs(wo[..., 2]) * (cos_o + eta * cos_i) ** 2)
    return np.where((wi[..., 2] < 0.0) & (cos_o > 0.0) & (cos_i < 0.0), value, 0.0)


def interface(wo, wi, eta, widths):
    """Both branches for any two directions, the medium of index `eta` below."""
    below = wo[..., 2] < 0.0
    up = np.where(below[..., None], [1.0, 1.0, -1.0], 1.0)
    wo, wi = wo * up, wi * up
    eta = np.where(below, 1.0 / eta, eta)
    return mirrored(wo, wi, eta, widths) + refracted(wo, wi, eta, widths)


# --- Facets, as points of a quadrature ----------------------------------------------------------


def facets(widths, radial, around):
    """Normals h, n x 3, and weights w such that sum w g(h) is the integral of D(h) g(h).

    The slopes of GGX at radius s (in units of the widths) are (s, phi) with u = s^2/(1 + s^2) and
    phi uniform, and D cos = p22; v = sqrt(1 - u) takes away the pole of 1/cos at u = 1.
    """
    nodes, weights = np.polynomial.legendre.leggauss(radial)
    v, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    s = np.sqrt(1.0 - v**2) / v
    phi = (np.arange(around) + 0.5) * 2.0 * np.pi / around
    s, phi = s[:, None], phi[None, :]
    slopes = [-widths[0] * s * np.cos(phi), -widths[1] * s * np.sin(phi), np.ones_like(s * phi)]
    h = unit(np.stack(slopes, axis=-1).reshape(-1, 3))
    return h, np.repeat(2.0 * v * weights / around, around) / h[:, 2]


def visible(wo, h, weights, widths):
    """Weights of the facets as seen from wo: they sum to 1 (Heitz 2014, Eq. 19)."""
    return weights * masking(wo, widths) * np.maximum(dot(wo, h), 0.0) / wo[..., 2]


def bent(wo, h, eta):
    """Snell's law in vectors: the direction away from the surface; NaN if all is reflected."""
    cosine = dot(wo, h)[..., None]
    sideways = (cosine * h - wo) / eta
    with np.errstate(invalid="ignore"):
        return sideways - h * np.sqrt(1.0 - (sideways**2).sum(axis=-1, keepdims=True))


# --- The body ------------------------------------------------------------------------------------


# theta = pi/2 sin^2: the integrand has a logarithm at 0 and a narrow peak at pi/2.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(400)
THETA = 0.5 * np.pi * np.sin(0.25 * np.pi * (NODES + 1.0)) ** 2
THETA_WEIGHTS = WEIGHTS * 0.125 * np.pi**2 * np.sin(0.5 * np.pi * (NODES + 1.0))
# 1 - theta cot(theta), by its series where that is all rounding.
SHORTFALL = np.where(THETA < 1e-2, THETA**2 / 3.0 + THETA**4 / 45.0, 1.0 - THETA / np.tan(THETA))


def half_space_h(mu, gamma):
    """Chandrasekhar's H by the closed integral of Stibbs and Weir (1959); gamma^2 = 1 - albedo."""
    rate = np.log(gamma**2 + (1.0 - gamma**2) * SHORTFALL) * THETA_WEIGHTS
    mu = np.asarray(mu, float)
    spread = np.cos(THETA) ** 2 + (mu[..., None] * np.sin(THETA)) ** 2
    return np.exp(-mu / np.pi * (rate / spread).sum(axis=-1))


def half_space_gamma(base_color):
    """sqrt(1 - albedo of one scattering) of the half-space that returns `base_color`."""
    nodes, weights = np.polynomial.legendre.leggauss(48)
    mu, weights = 0.25 * (nodes + 1.0) ** 2, 0.5 * (nodes + 1.0) * weights

    def returned(gamma):
        return 1.0 - 2.0 * gamma * (weights * mu * half_space_h(mu, gamma)).sum()

    return bisected(returned, base_color)


def bisected(falling, value):
    """x in [0, 1] at which a falling function has the value."""
    low, high = 0.0, 1.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if falling(middle) > value else (low, middle)
    return 0.5 * (low + high)


class ConservingBody:
    """Chandrasekhar (1960), chapter III: f = albedo H H / (4 pi (mu + mu'))."""

    def __init__(self, base_color):
        self.gamma = half_space_gamma(base_color)

    def eval(self, mu_o, mu_i):
        h = half_space_h(mu_o, self.gamma) * half_space_h(mu_i, self.gamma)
        return (1.0 - self.gamma**2) * h / (4.0 * np.pi * (mu_o + mu_i))

    def albedo(self, mu):
        return 1.0 - self.gamma * half_space_h(mu, self.gamma)


class PrintedBody:
    """The bracket of Eq. 12: single scattering and Jensen and Buhler's (2002) diffusion."""

    def __init__(self, base_color, eta):
        mirrored = -1.440 / eta**2 + 0.710 / eta + 0.668 + 0.0636 * eta
        a = (1.0 + mirrored) / (1.0 - mirrored)

        def reflected(gamma):
            root = np.sqrt(3.0) * gamma
            return 0.5 * (1.0 - gamma**2) * (1.0 + np.exp(-4.0 / 3.0 * a * root)) * np.exp(-root)

        self.base_color, self.single = base_color, 1.0 - bisected(reflected, base_color) ** 2

    def eval(self, mu_o, mu_i):
        return self.single / (4.0 * np.pi * (mu_o + mu_i)) + self.base_color / np.pi

    def albedo(self, mu):
        return self.base_color + 0.5 * self.single * (1.0 - mu * np.log1p(1.0 / mu))


def body_of(bsdf, channel):
    color = bsdf.base_color[channel]
    return ConservingBody(color) if bsdf.body == "conserving" else PrintedBody(color, bsdf.eta)


# --- A ribbon: x and y are one point -------------------------------------------------------------


@dataclass
class Passed:
    """What enters along each facet at x, and what becomes of it on the way to y."""

    incident: np.ndarray  # back along the way inside, n x 3, z > 0
    entered: np.ndarray
    transmittance: np.ndarray
    body: np.ndarray


class RibbonReference:
    """The whole BSDF of a ribbon (Eqs. 8 to 15), integrated over the ways through it."""

    def __init__(self, bsdf, thickness, radial=24, around=48):
        self.bsdf, self.thickness = bsdf, thickness
        self.bodies = [body_of(bsdf, channel) for channel in range(3)]
        self.at_x = facets(bsdf.roughness, radial, around)
        self.at_y = facets(bsdf.exit_roughness, radial // 2, around // 2)
        self.known = {}

    def passed(self, wo):
        """`wo` is one direction, above. Asked for often, found once."""
        key = wo.tobytes()
        if key not in self.known:
            self.known[key] = self.find_passed(wo)
        return self.known[key]

    def find_passed(self, wo):
        p, (h, weights) = self.bsdf, self.at_x
        inside = bent(wo, h, p.eta)
        keep = (dot(wo, h) > 0.0) & (inside[:, 2] < 0.0)
        h, weights, incident = h[keep], weights[keep], -inside[keep]
        entered = visible(wo, h, weights, p.roughness) * masking(incident, p.roughness)
        entered = entered * (1.0 - reflectance(dot(wo, h), p.eta))
        # Eq. 15: h / cos of the refracted direction is the length of the way.
        transmittance = np.exp(-p.extinction * self.thickness / incident[:, 2])
        leaving = self.over_exit_facets(incident, lambda out, m: 1.0)
        return Passed(incident, entered, transmittance, 1.0 - transmittance * leaving)

    def over_exit_facets(self, incident, value):
        """Mean of (1 - F_y) value over the facets at y that each incident direction sees."""
        m, weights = self.at_y
        w = incident[:, None, :]
        seen = visible(w, m, weights, self.bsdf.exit_roughness)
        passes = 1.0 - reflectance(dot(w, m), 1.0 / self.bsdf.eta)
        return (seen * passes * value(w, m)).sum(axis=1)

    def eval(self, wo, wi):
        """One direction by n, n x 3 values: f of Eq. 6 with the cosine of wi."""
        wo, wi = np.asarray(wo, float), np.atleast_2d(np.asarray(wi, float))
        up = np.array([1.0, 1.0, np.sign(wo[2])])
        return self.eval_above(wo * up, wi * up)

    def eval_above(self, wo, wi):
        p, way = self.bsdf, self.passed(wo)
        scattered = (way.entered * way.body).sum()
        value = np.zeros((len(wi), 3))
        above = wi[:, 2] > 0.0
        front, back = wi[above], wi[~above]
        mirror = mirrored(wo[None], front, p.eta, p.roughness)
        for channel, body in enumerate(self.bodies):
            value[above, channel] = mirror * p.specular_tint[channel]
            brdf = body.eval(wo[2], front[:, 2])
            value[above, channel] += p.body_reflection * scattered * brdf * front[:, 2]
        out = refracted(way.incident[None], back[:, None], 1.0 / p.eta, p.exit_roughness)
        through = (way.entered * way.transmittance * out).sum(axis=1)
        lambert = (1.0 - p.body_reflection) * scattered * -back[:, 2] / np.pi
        value[~above] = through[:, None] * p.transmission_tint
        value[~above] += lambert[:, None] * p.transmitted_color
        value[~above] *= p.specular_tint
        return value

    def albedo(self, wo):
        """What a ribbon in a white furnace shows towards wo: 3 values."""
        p, wo = self.bsdf, np.asarray(wo, float) * [1, 1, np.sign(wo[2])]
        way, (h, weights) = self.passed(wo), self.at_x
        out = 2.0 * dot(wo, h)[:, None] * h - wo
        mirror = visible(wo, h, weights, p.roughness) * reflectance(dot(wo, h), p.eta)
        mirror = (mirror * masking(out, p.roughness) * (out[:, 2] > 0.0)).sum()
        scattered = (way.entered * way.body).sum()

        def unblocked(w, m):
            out = bent(w, m, 1.0 / p.eta)
            leaves = out[..., 2] < 0.0
            return np.where(
                leaves, masking(np.where(leaves[..., None], out, -w), p.exit_roughness), 0.0
            )

        out = self.over_exit_facets(way.incident, unblocked)
        through = (way.entered * way.transmittance * out).sum() * np.array(p.transmission_tint)
        through += (1.0 - p.body_reflection) * scattered * np.array(p.transmitted_color)
        reflected = [p.body_reflection * scattered * body.albedo(wo[2]) for body in self.bodies]
        return np.array(p.specular_tint) * (mirror + through) + np.array(reflected)
