"""A path tracer in plain numpy for small open weaves of ply BSDFs, no code of the core.

Every ray is tried against every piece of every yarn. Paths are random walks as photons make them:
a facet reflects or refracts, the light inside is scattered or comes out, each as often as it does;
surroundings count where a walk ends in them, parallel light at every vertex. Only the relaxed
heights come from the package.
"""

from dataclasses import dataclass

import numpy as np
import ply_reference as reference
from ply_reference import dot, unit

PIECES_PER_CROSSING = 8
CHUNK = 4096
# A surface nearer than this is the one that the ray starts from.
NEAREST = 1e-6
GRAZING = 1e-3


# --- Centre lines -------------------------------------------------------------------------------


class Curves:
    """Relaxed centre lines of one direction of yarns, repeated over the swatch."""

    def __init__(self, heights, slopes, places, along, across, start, step):
        """`along` is the axis of the yarns; coordinate = start + step * place in the pattern."""
        self.heights, self.slopes = heights, slopes
        self.places, self.along, self.across = places, along, across
        self.start, self.step = start, step

    def height(self, yarn, coordinate):
        """Height and its derivative: cubics between knots half a crossing apart."""
        yarn = yarn % len(self.heights)
        knots = self.heights.shape[1]
        place = 2.0 * (coordinate - self.start) * self.step
        first = np.floor(place).astype(int)
        t = place - first
        a, b = first % knots, (first + 1) % knots
        h0, h1 = self.heights[yarn, a], self.heights[yarn, b]
        m0, m1 = 0.5 * self.slopes[yarn, a], 0.5 * self.slopes[yarn, b]
        rise = h1 - h0
        c2, c3 = 3.0 * rise - 2.0 * m0 - m1, m0 + m1 - 2.0 * rise
        height = h0 + t * (m0 + t * (c2 + t * c3))
        return height, 2.0 * self.step * (m0 + t * (2.0 * c2 + 3.0 * t * c3))

    def point(self, yarn, coordinate):
        """Points of the centre lines, and their unit tangents."""
        yarn, coordinate = np.broadcast_arrays(yarn, coordinate)
        height, slope = self.height(yarn, coordinate)
        point, tangent = np.zeros((*yarn.shape, 3)), np.zeros((*yarn.shape, 3))
        point[..., self.along], point[..., self.across] = coordinate, self.places[yarn]
        point[..., 2], tangent[..., self.along], tangent[..., 2] = height, 1.0, slope
        return point, unit(tangent)

    def nearest(self, yarn, point):
        """The centre line's point nearest to `point`, and the tangent there."""
        coordinate = point[..., self.along].copy()
        for _ in range(6):
            center, tangent = self.point(yarn, coordinate)
            coordinate += dot(point - center, tangent) * tangent[..., self.along]
        return self.point(yarn, coordinate)

    def joints(self, half):
        """Points and tangents at the ends of the pieces, yarns x (pieces + 1) x 3."""
        # One crossing more at each side: plies are cut by the swatch's edge, not by a joint.
        stations = np.arange(-half - 1, half + 1 + 1e-9, 1.0 / PIECES_PER_CROSSING)
        return self.point(np.arange(len(self.places))[:, None], stations[None])


def curves_of(fabric, crossings):
    """Ends and picks of a square swatch of a fabric whose yarns are 1 mm apart."""
    relaxed = fabric.relaxed()
    assert fabric.unit_mm == fabric.warp_spacing_mm == fabric.weft_spacing_mm == 1.0
    half = 0.5 * crossings
    middle = np.arange(crossings) + 0.5 - half
    # The first pick is at the top: along an end the pattern runs towards -y.
    ends = Curves(relaxed.warp_height, relaxed.warp_slope, middle, 1, 0, half, -1.0)
    picks = Curves(relaxed.weft_height, relaxed.weft_slope, -middle, 0, 1, -half, 1.0)
    return ends, picks


# --- Surfaces ----------------------------------------------------------------------------------


class Plies:
    """Round yarns of one ply: pieces of cylinders, cut where they meet."""

    def __init__(self, curves, crossings, radius):
        self.curves, self.radius = curves, radius
        points, tangents = curves.joints(0.5 * crossings)
        self.yarn = np.repeat(np.arange(len(points)), points.shape[1] - 1)
        axes = unit(points[:, 1:] - points[:, :-1])
        # Planes that halve the bend: both cylinders meet them in one ellipse.
        tangents[:, 1:-1] = unit(axes[:, 1:] + axes[:, :-1])
        self.start, self.end, self.axis, self.first, self.last = (
            values.reshape(-1, 3)
            for values in (points[:, :-1], points[:, 1:], axes, tangents[:, :-1], tangents[:, 1:])
        )

    def roots(self, origin, direction):
        """Where rays enter and leave the cylinders: two arrays of rays x pieces, NaN if nowhere."""
        along, way = direction @ self.axis.T, origin @ self.axis.T - dot(self.start, self.axis)
        a = 1.0 - along**2
        b = dot(origin, direction)[:, None] - direction @ self.start.T - along * way
        c = dot(origin, origin)[:, None] - 2.0 * origin @ self.start.T + dot(self.start, self.start)
        c -= way**2 + self.radius**2
        with np.errstate(invalid="ignore", divide="ignore"):
            root = np.sqrt(b * b - a * c)
            return (-b - root) / a, (-b + root) / a

    def between_joints(self, origin, direction, t):
        after = origin @ self.first.T - dot(self.start, self.first) + t * (direction @ self.first.T)
        before = origin @ self.last.T - dot(self.end, self.last) + t * (direction @ self.last.T)
        return (after >= -1e-12) & (before <= 1e-12)

    def hit(self, origin, direction):
        """Distance (inf if none) and yarn of the first piece that each ray enters."""
        t, _ = self.roots(origin, direction)
        wrong = ~((t > NEAREST) & self.between_joints(origin, direction, t))
        return first_of(np.where(wrong, np.inf, t), self.yarn)

    def leave(self, origin, direction, yarn):
        """Where rays that start on a yarn's surface, inwards, leave it."""
        _, t = self.roots(origin, direction)
        right = (t > 1e-9) & (self.yarn == yarn[:, None])
        right &= self.between_joints(origin, direction, t)
        return np.where(right, t, np.inf).min(axis=1)

    def frame(self, point, yarn, _):
        """Outward normals and tangents."""
        center, tangent = self.curves.nearest(yarn, point)
        return unit(point - center), tangent


class Ribbons:
    """Flat yarns: rectangles, level across."""

    def __init__(self, curves, crossings, width, thickness):
        self.curves, self.width, self.thickness = curves, width, thickness
        points, _ = curves.joints(0.5 * crossings)
        self.yarn = np.repeat(np.arange(len(points)), points.shape[1] - 1)
        self.start, end = (p.reshape(-1, 3) for p in (points[:, :-1], points[:, 1:]))
        self.piece = end - self.start
        side = np.zeros(3)
        side[curves.across] = 1.0
        self.side, self.normal = side, np.cross(self.piece, side)

    def hit(self, origin, direction):
        with np.errstate(invalid="ignore", divide="ignore"):
            t = (dot(self.start, self.normal) - origin @ self.normal.T) / (
                direction @ self.normal.T
            )
        way = origin @ self.piece.T - dot(self.start, self.piece) + t * (direction @ self.piece.T)
        off = (origin @ self.side)[:, None] + t * (direction @ self.side)[:, None]
        off = np.abs(off - self.start @ self.side)
        right = (t > NEAREST) & (way >= 0.0) & (way <= dot(self.piece, self.piece))
        return first_of(np.where(right & (off <= 0.5 * self.width), t, np.inf), self.yarn)

    def frame(self, point, yarn, direction):
        """Normals towards where the rays come from, and tangents."""
        _, tangent = self.curves.point(yarn, point[:, self.curves.along])
        normal = unit(np.cross(tangent, self.side))
        return normal * -np.sign(dot(normal, direction))[:, None], tangent


def first_of(t, yarn):
    piece = t.argmin(axis=1)
    return t[np.arange(len(t)), piece], yarn[piece]


# --- The scene ----------------------------------------------------------------------------------


@dataclass
class Cloth:
    """Ends and picks, each a `Plies` or `Ribbons`, of one BSDF each, in a square of `crossings`."""

    sets: tuple
    bsdfs: tuple
    crossings: int

    def hit(self, origin, direction):
        """Distance, set and yarn of what each ray enters first inside the swatch."""
        parts = [slice(i, i + CHUNK) for i in range(0, len(origin), CHUNK)]
        found = [self.hit_part(origin[part], direction[part]) for part in parts]
        return (
            [np.concatenate(values) for values in zip(*found, strict=True)]
            if found
            else [np.zeros(0)] * 3
        )

    def hit_part(self, origin, direction):
        (t, yarn), (u, other) = (each.hit(origin, direction) for each in self.sets)
        kind = (u < t).astype(int)
        t = np.where(kind, u, t)
        with np.errstate(invalid="ignore"):
            place = np.abs(origin + t[:, None] * direction)[:, :2]
        return (
            np.where((place < 0.5 * self.crossings).all(axis=1), t, np.inf),
            kind,
            np.where(kind, other, yarn),
        )


class Optics:
    """A BSDF with its body's H function in a table."""

    def __init__(self, bsdf):
        self.p = bsdf
        self.knots = np.linspace(0.0, 1.0, 400)
        bodies = [reference.ConservingBody(color) for color in bsdf.base_color]
        self.single = np.array([1.0 - body.gamma**2 for body in bodies])
        table = [reference.half_space_h(self.knots**4 + 1e-12, body.gamma) for body in bodies]
        self.table = np.array(table)

    def body(self, mu_o, mu_i):
        """n x 3, without a cosine."""
        h = [
            np.interp(mu_o**0.25, self.knots, row) * np.interp(mu_i**0.25, self.knots, row)
            for row in self.table
        ]
        return self.single * np.stack(h, axis=-1) / (4.0 * np.pi * (mu_o + mu_i))[:, None]


# --- Random directions ---------------------------------------------------------------------------


def visible_facets(wo, widths, rng):
    """Normals as wo sees them, by caps of the sphere (Dupuy and Benyoub 2023)."""
    scale = np.array([*widths, 1.0])
    stretched = unit(wo * scale)
    azimuth = 2.0 * np.pi * rng.random(len(wo))
    z = (1.0 - rng.random(len(wo))) * (1.0 + stretched[:, 2]) - stretched[:, 2]
    radius = np.sqrt(np.maximum(0.0, 1.0 - z * z))
    cap = np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), z], axis=-1)
    return unit((cap + stretched) * scale + [0.0, 0.0, 1e-12])


def diffuse(count, rng):
    azimuth, height2 = 2.0 * np.pi * rng.random(count), rng.random(count)
    radius = np.sqrt(1.0 - height2)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.sqrt(height2)], axis=-1)


@dataclass
class Frame:
    """Local frames: the tangent is x, the normal z."""

    axes: np.ndarray

    @classmethod
    def facing(cls, normal, tangent, direction):
        """Turned towards `direction` where that grazes: normals are smoother than plies."""
        cosine = dot(normal, direction)[:, None]
        turned = unit(normal + (2.0 * GRAZING - cosine) * direction)
        normal = np.where(cosine < GRAZING, turned, normal)
        tangent = unit(tangent - dot(tangent, normal)[:, None] * normal)
        return cls(np.stack([tangent, np.cross(normal, tangent), normal], axis=1))

    def local(self, w):
        return np.einsum("nij,nj->ni", self.axes, np.broadcast_to(w, (len(self.axes), 3)))

    def world(self, w):
        return np.einsum("nij,ni->nj", self.axes, w)


# --- Paths ---------------------------------------------------------------------------------------


class Tracer:
    """Radiance along rays, under surroundings of one radiance and one light from afar."""

    def __init__(self, cloth, constant, sun, irradiance, seed):
        self.cloth, self.optics = cloth, [Optics(bsdf) for bsdf in cloth.bsdfs]
        self.constant, self.irradiance = np.asarray(constant, float), np.asarray(irradiance, float)
        self.to_sun = -unit(np.asarray(sun, float))
        self.rng = np.random.default_rng(seed)

    def radiance(self, origin, direction):
        """n x 3 for n rays."""
        total = np.zeros((len(origin), 3))
        throughput, alive = np.ones((len(origin), 3)), np.arange(len(origin))
        while alive.size:
            t, kind, yarn = self.cloth.hit(origin, direction)
            free = np.isinf(t)
            total[alive[free]] += throughput[free] * self.constant
            steps = []
            for number in (0, 1):
                rows = np.flatnonzero(~free & (kind == number))
                at = origin[rows] + t[rows, None] * direction[rows]
                new = self.scatter(number, at, direction[rows], yarn[rows])
                total[alive[rows]] += throughput[rows] * new[0]
                steps.append((alive[rows], new[1], new[2], throughput[rows] * new[3]))
            alive, origin, direction, throughput = (
                np.concatenate(parts) for parts in zip(*steps, strict=True)
            )
            chance = np.minimum(1.0, throughput.max(axis=1, initial=0.0))
            lives = self.rng.random(len(alive)) < chance
            alive, origin, direction = alive[lives], origin[lives], direction[lives]
            throughput = throughput[lives] / chance[lives, None]
        return total

    def scatter(self, number, x, direction, yarn):
        """Light of the sun, and where the walk goes on: origin, direction, weight."""
        shape, optics, p = self.cloth.sets[number], self.optics[number], self.cloth.bsdfs[number]
        frame = Frame.facing(*shape.frame(x, yarn, direction), -direction)
        wo = frame.local(-direction)
        h = visible_facets(wo, p.roughness, self.rng)
        bounced = reference.reflectance(dot(wo, h), p.eta)
        inside = reference.bent(wo, h, p.eta)
        # Facets that lead nowhere: what they would refract is lost.
        blocked = ~(inside[:, 2] < 0.0)
        inside = np.where(blocked[:, None], [0.0, 0.0, -1.0], inside)
        entered = np.where(blocked, 0.0, reference.masking(inside, p.roughness))
        y, back, incident, length = self.way_inside(shape, frame, x, inside, yarn)
        m = visible_facets(incident, p.exit_roughness, self.rng)
        tau = np.exp(-p.extinction * length)
        passed = tau * (1.0 - reference.reflectance(dot(incident, m), 1.0 / p.eta))
        scattered = 1.0 - passed

        # The sun, in the whole of f_x and f_y.
        specular = np.array(p.specular_tint)
        share = ((1.0 - bounced) * entered)[:, None]
        into_body = share * scattered[:, None]
        color = (1.0 - p.body_reflection) * np.array(p.transmitted_color) / np.pi

        def at_entry(wi, i):
            mirror = reference.mirrored(wo[i], wi, p.eta, p.roughness)[:, None]
            body = p.body_reflection * optics.body(wo[i, 2], wi[:, 2]) * wi[:, 2:]
            return specular * mirror + into_body[i] * body

        def at_exit(wi, i):
            out = reference.refracted(incident[i], wi, 1.0 / p.eta, p.exit_roughness)
            out = share[i] * (tau[i] * out)[:, None] * np.array(p.transmission_tint)
            return specular * (out - into_body[i] * color * wi[:, 2:])

        light = self.sunlight(x, frame, 1.0, at_entry) + self.sunlight(y, back, -1.0, at_exit)

        # The walk.
        u = self.rng.random((3, len(x)))
        mirror = u[0] < bounced
        through = ~mirror & (u[1] < passed)
        at_x = ~mirror & ~through & (u[2] < p.body_reflection)
        at_y = ~mirror & ~through & ~at_x
        next_, weight = np.zeros((len(x), 3)), np.zeros((len(x), 3))
        wi = 2.0 * dot(wo, h)[:, None] * h - wo
        keep = (wi[:, 2] > 0.0)[:, None]
        up = np.where(keep, wi, [0, 0, 1.0])
        next_[mirror] = frame.world(wi)[mirror]
        weight[mirror] = (keep * reference.masking(up, p.roughness)[:, None] * specular)[mirror]
        wi = reference.bent(incident, m, 1.0 / p.eta)
        keep = (wi[:, 2] < 0.0)[:, None]
        wi = np.where(keep, wi, [0, 0, -1.0])
        tint = specular * p.transmission_tint
        next_[through] = back.world(wi)[through]
        weight[through] = (
            keep * (entered * reference.masking(wi, p.exit_roughness))[:, None] * tint
        )[through]
        wi = diffuse(len(x), self.rng)
        brdf = optics.body(wo[:, 2], wi[:, 2]) * np.pi
        next_[at_x], weight[at_x] = frame.world(wi)[at_x], (entered[:, None] * brdf)[at_x]
        tint = specular * p.transmitted_color
        next_[at_y], weight[at_y] = back.world(-wi)[at_y], (entered[:, None] * tint)[at_y]
        return light, np.where((mirror | at_x)[:, None], x, y), next_, weight

    def way_inside(self, shape, frame, x, inside, yarn):
        """Where the way ends, the frame there (normal inwards), the direction back, the length."""
        if isinstance(shape, Ribbons):
            return x, frame, -inside, shape.thickness / -inside[:, 2]
        direction = frame.world(inside)
        parts = [slice(i, i + CHUNK) for i in range(0, len(x), CHUNK)]
        leave = [shape.leave(x[part], direction[part], yarn[part]) for part in parts]
        # Grazing ways may have no length at all.
        length = np.concatenate([*leave, np.zeros(0)])
        length = np.where(np.isinf(length), 0.0, length)
        y = x + length[:, None] * direction
        normal, tangent = shape.frame(y, yarn, direction)
        back = Frame.facing(-normal, tangent, -direction)
        return y, back, back.local(-direction), length

    def sunlight(self, point, frame, side, value):
        """`value` of local directions and their rows, where the sun is on that side and seen."""
        light = np.zeros((len(point), 3))
        if not self.irradiance.any():
            return light
        wi = frame.local(self.to_sun)
        rows = np.flatnonzero(wi[:, 2] * side > 0.0)
        t, *_ = self.cloth.hit(point[rows], np.tile(self.to_sun, (len(rows), 1)))
        rows = rows[np.isinf(t)]
        light[rows] = value(wi[rows], rows) * self.irradiance
        return light
