//! Twisted and bent plies against fine triangle meshes of their tubes: first hits, normals and exits.
//!
//! The mesh is made from the relaxed curves and docs/conventions.md alone: ends along y, picks along
//! x, the first pick at the top, plies in right-handed helices if the pitch is positive, one of them
//! level with the yarn's centre at its side where a crossing's slot starts.

mod common;

use std::f64::consts::TAU;

use common::rays::direction;
use common::{cloth, swatch_of};
use glam::DVec3;
use plycloth::accel::ray::Ray;
use plycloth::cloth::inside::Way;
use plycloth::cloth::spec::{ClothSpec, YarnShape};
use plycloth::cloth::yarn_path::YarnSet;
use plycloth::control::Control;
use plycloth::math::rng::Sampler;
use plycloth::weave::curve::HeightCurve;
use plycloth::weave::relax::relax;

const CROSSINGS: usize = 4;
const RINGS_PER_CROSSING: usize = 40;
const AROUND: usize = 40;
const RAYS: u64 = 3_000;

/// Yarns whose plies turn by one symmetry from crossing to crossing, so that all slots look alike.
fn yarn(plies: usize, turn: f64) -> YarnShape {
    let radius: f64 = 0.2;
    let sin = (TAU / 2.0 / plies as f64).sin();
    // A tenth thinner than fits: they clear each other.
    let ply_radius = 0.9 * if plies == 1 { radius } else { radius * sin / (1.0 + sin) };
    YarnShape::round(radius, plies, ply_radius, turn * plies as f64)
}

fn spec(plies: usize, turn: f64) -> ClothSpec {
    let mut spec = cloth([2, 2], |pick, end| pick == end, yarn(plies, turn));
    spec.collision_stiffness = 1e4;
    spec
}

/// A triangle with its corners' normals.
struct Triangle {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
}

/// A ply's surface: its yarn, its box and its triangles.
struct Tube {
    set: YarnSet,
    yarn: usize,
    rings: Vec<Ring>,
}

/// A piece of a tube between two rings, with a ball around it.
struct Ring {
    center: DVec3,
    radius: f64,
    triangles: Vec<Triangle>,
}

/// The centre of a ply: along its yarn by `s`, in crossings from the swatch's middle.
fn ply_center(
    curve: &HeightCurve,
    set: YarnSet,
    place: f64,
    s: f64,
    (helix, turns, angle): (f64, f64, f64),
) -> DVec3 {
    let half = 0.5 * CROSSINGS as f64;
    let (height, slope) = curve.eval(s + half);
    let (forward, center, side) = match set {
        YarnSet::Warp => (DVec3::Y, DVec3::new(place, s, height), DVec3::X),
        YarnSet::Weft => (DVec3::X, DVec3::new(s, place, height), DVec3::NEG_Y),
    };
    let tangent = (forward + slope * DVec3::Z).normalize();
    // Turned about the tangent as the fingers of a right hand are.
    let (sin, cos) = (TAU * turns * (s + half) + angle).sin_cos();
    center + helix * (cos * side + sin * tangent.cross(side))
}

fn tubes(spec: &ClothSpec) -> Vec<Tube> {
    let spec = spec.bottom_up();
    let relaxed = relax(&spec.relax_problem(), &Control::default()).unwrap();
    let YarnShape::Round { radius, plies, ply_radius, pitch, .. } = spec.warp.kinds[0].shape else {
        unreachable!()
    };
    let helix = if plies == 1 { 0.0 } else { radius - ply_radius };
    let half = 0.5 * CROSSINGS as f64;
    let mut tubes = Vec::new();
    for (set, curves) in [(YarnSet::Warp, &relaxed.warp), (YarnSet::Weft, &relaxed.weft)] {
        for yarn in 0..CROSSINGS {
            let place = yarn as f64 + 0.5 - half;
            for ply in 0..plies {
                let twist = (helix, 1.0 / pitch, TAU * ply as f64 / plies as f64);
                let curve = &curves.yarn(yarn % curves.len());
                let at = |s: f64| ply_center(curve, set, place, s, twist);
                tubes.push(Tube { set, yarn: yarn % curves.len(), rings: rings(at, ply_radius) });
            }
        }
    }
    tubes
}

/// Triangles around a curve, a crossing further than the swatch.
fn rings(at: impl Fn(f64) -> DVec3, radius: f64) -> Vec<Ring> {
    let half = 0.5 * CROSSINGS as f64 + 1.0;
    let count = (CROSSINGS + 2) * RINGS_PER_CROSSING;
    // Vertices as far out as makes the polygon as large as the circle.
    let reach = radius / (TAU / 2.0 / AROUND as f64).cos().sqrt();
    let circle = |ring: usize| -> (DVec3, Vec<(DVec3, DVec3)>) {
        let s = ring as f64 / RINGS_PER_CROSSING as f64 - half;
        let (center, tangent) = (at(s), (at(s + 1e-5) - at(s - 1e-5)).normalize());
        let side = DVec3::Z.cross(tangent).normalize();
        let spoke = |k: usize| {
            let (sin, cos) = (TAU * k as f64 / AROUND as f64).sin_cos();
            let normal = cos * side + sin * tangent.cross(side);
            (center + reach * normal, normal)
        };
        (center, (0..AROUND).map(spoke).collect())
    };
    let circles: Vec<_> = (0..=count).map(circle).collect();
    let ring = |pair: &[(DVec3, Vec<(DVec3, DVec3)>)]| {
        let [(a, first), (b, second)] = pair else { unreachable!() };
        let triangles = (0..AROUND).flat_map(|k| {
            let next = (k + 1) % AROUND;
            let quad = [first[k], first[next], second[next], second[k]];
            [[0, 1, 2], [0, 2, 3]].map(|corners| Triangle {
                corners: corners.map(|c| quad[c].0),
                normals: corners.map(|c| quad[c].1),
            })
        });
        let triangles = triangles.collect();
        Ring { center: 0.5 * (*a + *b), radius: reach + a.distance(*b), triangles }
    };
    circles.windows(2).map(ring).collect()
}

impl Triangle {
    /// Distance and normal (Moeller and Trumbore 1997).
    fn meet(&self, ray: &Ray) -> Option<(f64, DVec3)> {
        let [a, b, c] = self.corners;
        let (u_edge, v_edge) = (b - a, c - a);
        let p = ray.direction.cross(v_edge);
        let determinant = u_edge.dot(p);
        let offset = ray.origin - a;
        let u = offset.dot(p) / determinant;
        let q = offset.cross(u_edge);
        let v = ray.direction.dot(q) / determinant;
        let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
        let [n0, n1, n2] = self.normals;
        let normal = (1.0 - u - v) * n0 + u * n1 + v * n2;
        inside.then(|| (v_edge.dot(q) / determinant, normal.normalize()))
    }
}

impl Tube {
    /// All places where the ray meets the tube.
    fn meet(&self, ray: &Ray) -> impl Iterator<Item = (f64, DVec3)> {
        let near = |ring: &&Ring| {
            let offset = ring.center - ray.origin;
            let along = offset.dot(ray.direction);
            offset.length_squared() - along * along <= ring.radius * ring.radius
        };
        let rings = self.rings.iter().filter(near);
        rings.flat_map(|ring| ring.triangles.iter().filter_map(|t| t.meet(ray)))
    }

    /// The nearest place in (`least`, infinity) where the ray goes in (`side` -1) or comes out (1).
    fn first(&self, ray: &Ray, least: f64, side: f64) -> Option<(f64, DVec3)> {
        self.meet(ray)
            .filter(|(t, normal)| *t > least && normal.dot(ray.direction) * side > 0.0)
            .min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// Rays from all around at the middle crossings.
fn random_ray(sampler: &mut Sampler) -> Ray {
    let [u, v] = sampler.next_2d();
    let target = DVec3::new(2.0 * u - 1.0, 2.0 * v - 1.0, 0.6 * (sampler.next_1d() - 0.5));
    let steep = direction(sampler);
    let direction = steep.with_z(2.0 * steep.z).normalize();
    Ray { origin: target - 3.0 * direction, direction }
}

/// Differences, sorted by size.
#[derive(Default)]
struct Errors(Vec<f64>);

impl Errors {
    fn at(&mut self, share: f64) -> f64 {
        self.0.sort_by(f64::total_cmp);
        self.0[((self.0.len() - 1) as f64 * share) as usize]
    }
}

#[test]
fn twisted_and_bent_plies_are_met_where_their_meshes_are() {
    for (plies, turn) in [(1, 1.0), (2, 1.0), (3, -1.0), (4, 1.0)] {
        let spec = spec(plies, turn);
        let swatch = swatch_of(&spec, [CROSSINGS as f64; 2]).unwrap();
        let tubes = tubes(&spec);
        let (mut depths, mut angles, mut lengths) =
            (Errors::default(), Errors::default(), Errors::default());
        let (mut out, mut turned) = (Errors::default(), 0.0);
        let (mut other, mut hits) = (0, 0);
        for number in 0..RAYS {
            let sampler = &mut Sampler::new(31, number, 0);
            let ray = random_ray(sampler);
            // In the swatch alone: what lies before its edge is not there.
            let edge = (0..2).map(|axis| {
                let half = 0.5 * CROSSINGS as f64;
                (-half * ray.direction[axis].signum() - ray.origin[axis]) / ray.direction[axis]
            });
            let start = edge.fold(0.0, f64::max);
            let found = swatch.nearest(&ray);
            // By a cut end, which tubes have none of.
            if found.is_some_and(|hit| start > 0.0 && hit.t < start + 1e-9) {
                continue;
            }
            let expected = tubes
                .iter()
                .filter_map(|tube| tube.first(&ray, start, -1.0).map(|(t, n)| (t, n, tube)))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            let (hit, t, normal, tube) = match (found, expected) {
                (None, None) => continue,
                (Some(hit), Some((t, normal, tube)))
                    if (hit.place.set, hit.place.yarn) == (tube.set, tube.yarn)
                        && (hit.t - t).abs() < 0.1 =>
                {
                    (hit, t, normal, tube)
                }
                _ => {
                    other += 1;
                    continue;
                }
            };
            hits += 1;
            depths.0.push(((hit.t - t) * normal.dot(ray.direction)).abs());
            angles.0.push(hit.surface.normal.angle_between(normal).to_degrees());
            turned += hit.surface.tangent.dot(normal);
            // Refracted as by an index of 1.5, and a little at random.
            let bend = 0.2 * direction(sampler);
            let inwards = (ray.direction / 1.5 - 0.5 * normal + bend).normalize();
            let from_hit = Ray { origin: ray.at(hit.t), direction: inwards };
            let from_mesh = Ray { origin: ray.at(t), direction: inwards };
            let Way { length, surface, .. } = swatch.way(&hit.place, &[], &from_hit);
            if let Some((expected, normal)) = tube.first(&from_mesh, 1e-3, 1.0) {
                lengths.0.push(((length - expected) * normal.dot(inwards)).abs());
                out.0.push((-surface.normal).angle_between(normal).to_degrees());
            }
        }
        let other = f64::from(other) / f64::from(hits);
        let summary = format!(
            "{plies} plies: {hits} hits, {other:.4} others; depth {:.1e} {:.1e}, angle {:.2} {:.2},\
             exits {}, depth {:.1e} {:.1e}, angle {:.2} {:.2}, tangent {:.1e}",
            depths.at(0.5),
            depths.at(0.98),
            angles.at(0.5),
            angles.at(0.98),
            lengths.0.len(),
            lengths.at(0.5),
            lengths.at(0.98),
            out.at(0.5),
            out.at(0.98),
            turned / f64::from(hits),
        );
        println!("{summary}");
        assert!(hits > 1_500 && lengths.0.len() > 1_300, "{summary}");
        // Silhouettes, and chords in place of arcs: 16 to a turn, so 2% of the helix's radius.
        assert!(other < 0.03, "{summary}");
        assert!(depths.at(0.5) < 2e-3 && depths.at(0.98) < 1e-2, "{summary}");
        assert!(lengths.at(0.5) < 3e-3 && lengths.at(0.98) < 1.2e-2, "{summary}");
        assert!(angles.at(0.5) < 2.5 && angles.at(0.98) < 8.0, "{summary}");
        assert!(out.at(0.5) < 3.0 && out.at(0.98) < 10.0, "{summary}");
    }
}
