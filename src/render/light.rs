//! Lights: where light comes from, and how to look for it.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use crate::accel::ray::Ray;
use crate::math::color::{Rgb, mean};
use crate::sampling::distribution::Distribution2d;
use crate::sampling::warp::{SPHERE_PDF, square_to_sphere};

/// A source of light.
#[derive(Debug, Clone)]
pub enum Light {
    /// A point that sends `intensity` into every direction.
    Point {
        /// Where it is.
        position: DVec3,
        /// Radiant intensity.
        intensity: Rgb,
    },
    /// Parallel light.
    Directional {
        /// The unit direction in which it travels.
        direction: DVec3,
        /// On a surface perpendicular to it.
        irradiance: Rgb,
    },
    /// A rectangle that shines to one side.
    Rectangle(Rectangle),
    /// The same radiance from everywhere.
    Constant {
        /// The radiance.
        radiance: Rgb,
    },
    /// A picture of the surroundings.
    Environment(Environment),
}

/// A rectangular light.
#[derive(Debug, Clone, PartialEq)]
pub struct Rectangle {
    corner: DVec3,
    edges: [DVec3; 2],
    /// The dual basis: what an offset is multiplied with to give its part along each edge.
    duals: [DVec3; 2],
    normal: DVec3,
    area: f64,
    radiance: Rgb,
}

impl Rectangle {
    /// The rectangle (or parallelogram) around `center` with the given edges; it shines to the side
    /// of `edges[0]` x `edges[1]`.
    pub fn new(center: DVec3, edges: [DVec3; 2], radiance: Rgb) -> Self {
        let cross = edges[0].cross(edges[1]);
        let corner = center - 0.5 * (edges[0] + edges[1]);
        let duals =
            [edges[1].cross(cross), cross.cross(edges[0])].map(|d| d / cross.length_squared());
        Self { corner, edges, duals, normal: cross.normalize(), area: cross.length(), radiance }
    }

    #[inline]
    fn intersect(&self, ray: &Ray) -> Option<f64> {
        let approach = ray.direction.dot(self.normal);
        let t = (self.corner - ray.origin).dot(self.normal) / approach;
        if !t.is_finite() || t <= 0.0 {
            return None;
        }
        let offset = ray.at(t) - self.corner;
        let inside = self.duals.iter().all(|dual| (0.0..=1.0).contains(&offset.dot(*dual)));
        inside.then_some(t)
    }

    #[inline]
    fn emitted(&self, direction: DVec3) -> Rgb {
        if direction.dot(self.normal) < 0.0 { self.radiance } else { Rgb::ZERO }
    }

    #[inline]
    fn pdf(&self, direction: DVec3, t: f64) -> f64 {
        t * t / (self.area * direction.dot(self.normal).abs())
    }
}

/// A latitude-longitude picture of the surroundings; +y is up, its middle lies towards +z.
#[derive(Debug, Clone)]
pub struct Environment {
    pixels: Vec<Rgb>,
    size: [usize; 2],
    /// The angle about +y by which the picture is turned.
    rotation: f64,
    distribution: Distribution2d,
}

impl Environment {
    /// The picture `pixels`, row-major with `width` columns, turned by `rotation` radians about +y,
    /// counter-clockwise as seen from above.
    pub fn new(pixels: Vec<Rgb>, width: usize, rotation: f64) -> Self {
        let height = pixels.len() / width;
        let weights: Vec<_> = pixels
            .iter()
            .enumerate()
            .map(|(i, &color)| {
                mean(color) * (PI * ((i / width) as f64 + 0.5) / height as f64).sin()
            })
            .collect();
        let distribution = Distribution2d::new(&weights, width);
        Self { pixels, size: [width, height], rotation, distribution }
    }

    #[inline]
    fn to_uv(&self, direction: DVec3) -> [f64; 2] {
        let azimuth = direction.x.atan2(-direction.z) + self.rotation;
        [(azimuth / TAU).rem_euclid(1.0), direction.y.clamp(-1.0, 1.0).acos() / PI]
    }

    #[inline]
    fn radiance(&self, direction: DVec3) -> Rgb {
        let [u, v] = self.to_uv(direction);
        let cell = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
        self.pixels[cell(v, self.size[1]) * self.size[0] + cell(u, self.size[0])]
    }

    #[inline]
    fn sample(&self, u: [f64; 2]) -> (DVec3, f64) {
        let ([x, y], pdf) = self.distribution.sample(u);
        let (sin_azimuth, cos_azimuth) = (TAU * x - self.rotation).sin_cos();
        let (sin, cos) = (PI * y).sin_cos();
        let direction = DVec3::new(sin * sin_azimuth, cos, -sin * cos_azimuth);
        (direction, pdf / (TAU * PI * sin.max(1e-12)))
    }

    #[inline]
    fn pdf(&self, direction: DVec3) -> f64 {
        let sin = (1.0 - direction.y * direction.y).max(1e-24).sqrt();
        self.distribution.pdf(self.to_uv(direction)) / (TAU * PI * sin)
    }
}

/// Light arriving at a point from a chosen direction.
#[derive(Debug, Clone, Copy)]
pub struct LightSample {
    /// Unit, away from the point.
    pub direction: DVec3,
    /// How far the light is; infinite for the surroundings.
    pub distance: f64,
    /// Radiance over density (for point and directional lights: irradiance facing the light).
    pub weight: Rgb,
    /// The density of the direction; `None` for lights that no other direction could have found.
    pub pdf: Option<f64>,
}

/// All lights of a scene.
#[derive(Debug, Clone, Default)]
pub struct Lights {
    /// Those without extent, which only connections find.
    lamps: Vec<Light>,
    /// The others, which directions may meet.
    extended: Vec<Light>,
}

impl Lights {
    /// These lights.
    pub fn new(lights: Vec<Light>) -> Self {
        let is_lamp =
            |light: &Light| matches!(light, Light::Point { .. } | Light::Directional { .. });
        let (lamps, extended) = lights.into_iter().partition(is_lamp);
        Self { lamps, extended }
    }

    /// Whether there are lights without extent.
    #[inline]
    pub fn have_lamps(&self) -> bool {
        !self.lamps.is_empty()
    }

    /// Light arriving at `point` from a light without extent; all are chosen with equal probability.
    #[inline]
    pub fn sample_lamp(&self, point: DVec3, choice: f64) -> Option<LightSample> {
        let (lamp, probability) = chosen(&self.lamps, choice)?;
        let sample = lamp.sample(point, [0.5; 2])?;
        Some(LightSample { weight: sample.weight / probability, ..sample })
    }

    /// Light arriving at `point` from one of the others, chosen with equal probability.
    #[inline]
    pub fn sample_extended(&self, point: DVec3, choice: f64, u: [f64; 2]) -> Option<LightSample> {
        let (light, probability) = chosen(&self.extended, choice)?;
        let sample = light.sample(point, u)?;
        Some(LightSample {
            weight: sample.weight / probability,
            pdf: sample.pdf.map(|pdf| pdf * probability),
            ..sample
        })
    }

    /// The nearest rectangle that the ray meets: its distance and its number.
    #[inline]
    pub fn nearest(&self, ray: &Ray) -> Option<(f64, usize)> {
        let mut nearest: Option<(f64, usize)> = None;
        for (number, light) in self.extended.iter().enumerate() {
            if let Light::Rectangle(rectangle) = light
                && let Some(t) = rectangle.intersect(ray)
                && nearest.is_none_or(|(best, _)| t < best)
            {
                nearest = Some((t, number));
            }
        }
        nearest
    }

    /// Whether a rectangle other than the one at `t_max` is in the ray's way.
    #[inline]
    pub fn occluded(&self, ray: &Ray, t_max: f64) -> bool {
        self.nearest(ray).is_some_and(|(t, _)| t < t_max * (1.0 - 1e-9))
    }

    /// Radiance that arrives along the ray from a rectangle, and the density with which
    /// [`Lights::sample_extended`] would have chosen it.
    #[inline]
    pub fn emitted(&self, ray: &Ray, (t, number): (f64, usize)) -> (Rgb, f64) {
        let Light::Rectangle(rectangle) = &self.extended[number] else { return (Rgb::ZERO, 0.0) };
        let pdf = rectangle.pdf(ray.direction, t) / self.extended.len() as f64;
        (rectangle.emitted(ray.direction), pdf)
    }

    /// What the surroundings send against `direction`, light by light, each with the density with
    /// which [`Lights::sample_extended`] would have chosen it.
    #[inline]
    pub fn surroundings(&self, direction: DVec3) -> impl Iterator<Item = (Rgb, f64)> + '_ {
        let probability = 1.0 / self.extended.len() as f64;
        self.extended.iter().filter_map(move |light| match light {
            Light::Constant { radiance } => Some((*radiance, SPHERE_PDF * probability)),
            Light::Environment(environment) => {
                Some((environment.radiance(direction), environment.pdf(direction) * probability))
            }
            _ => None,
        })
    }
}

/// The light that `choice` names, a number in [0, 1), and its probability.
#[inline]
fn chosen(lights: &[Light], choice: f64) -> Option<(&Light, f64)> {
    let count = lights.len();
    let light = lights.get(((choice * count as f64) as usize).min(count.max(1) - 1))?;
    Some((light, 1.0 / count as f64))
}

impl Light {
    fn sample(&self, point: DVec3, u: [f64; 2]) -> Option<LightSample> {
        let infinite = f64::INFINITY;
        match self {
            Self::Point { position, intensity } => {
                let offset = *position - point;
                let distance = offset.length();
                let weight = *intensity / (distance * distance);
                (distance > 0.0).then(|| LightSample {
                    direction: offset / distance,
                    distance,
                    weight,
                    pdf: None,
                })
            }
            Self::Directional { direction, irradiance } => Some(LightSample {
                direction: -*direction,
                distance: infinite,
                weight: *irradiance,
                pdf: None,
            }),
            Self::Rectangle(rectangle) => {
                let [a, b] = rectangle.edges;
                let offset = rectangle.corner + u[0] * a + u[1] * b - point;
                let distance = offset.length();
                let direction = offset / distance;
                let pdf = rectangle.pdf(direction, distance);
                let radiance = rectangle.emitted(direction);
                (radiance != Rgb::ZERO && pdf.is_finite()).then(|| LightSample {
                    direction,
                    distance,
                    weight: radiance / pdf,
                    pdf: Some(pdf),
                })
            }
            Self::Constant { radiance } => Some(LightSample {
                direction: square_to_sphere(u),
                distance: infinite,
                weight: *radiance / SPHERE_PDF,
                pdf: Some(SPHERE_PDF),
            }),
            Self::Environment(environment) => {
                let (direction, pdf) = environment.sample(u);
                (pdf > 0.0).then(|| LightSample {
                    direction,
                    distance: infinite,
                    weight: environment.radiance(direction) / pdf,
                    pdf: Some(pdf),
                })
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn environment() -> Environment {
        let pixels = (0..8 * 4).map(|i| Rgb::splat((i % 5) as f64 + 0.1)).collect();
        Environment::new(pixels, 8, 0.3)
    }

    #[test]
    fn environment_finds_what_it_sampled_and_its_density_integrates_to_one() {
        let environment = environment();
        let n = 400;
        let mut integral = 0.0;
        for i in 0..n * n {
            let u = [((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64];
            let (direction, pdf) = environment.sample(u);
            assert!((environment.pdf(direction) / pdf - 1.0).abs() < 1e-6);
            integral += environment.pdf(square_to_sphere(u)) / SPHERE_PDF / (n * n) as f64;
        }
        assert!((integral - 1.0).abs() < 0.01, "{integral}");
    }

    /// Irradiance under a square light, against the closed form of the form factor of a
    /// rectangle seen from below its corner, four times.
    #[test]
    fn irradiance_under_a_square_is_that_of_the_form_factor() {
        let (edge_x, edge_y) = (DVec3::new(0.0, 2.0, 0.0), DVec3::new(2.0, 0.0, 0.0));
        let rectangle = Rectangle::new(DVec3::new(0.0, 0.0, 1.5), [edge_x, edge_y], Rgb::ONE);
        let lights = Lights::new(vec![Light::Rectangle(rectangle)]);
        let n = 300;
        let mut irradiance = 0.0;
        for i in 0..n * n {
            let u = [((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64];
            let sample = lights.sample_extended(DVec3::ZERO, 0.5, u).unwrap();
            irradiance += sample.weight.x * sample.direction.z / (n * n) as f64;
        }
        let a: f64 = 1.0 / 1.5;
        let s = (1.0 + a * a).sqrt();
        let form_factor = 4.0 / TAU * 2.0 * (a / s * (a / s).atan());
        assert!((irradiance / PI - form_factor).abs() < 1e-5);
    }
}
