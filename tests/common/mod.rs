//! Small cloths and scenes for the integration tests.
#![allow(dead_code)]

pub mod chi2;
pub mod lobes;
pub mod rays;
pub mod weaves;
pub mod whole;

use glam::DVec3;
use plycloth::cloth::relaxed_cloth::RelaxedCloth;
use plycloth::cloth::spec::{ClothSpec, YarnShape, YarnSpec};
use plycloth::cloth::swatch::Swatch;
use plycloth::control::Control;
use plycloth::error::Result;
use plycloth::math::color::Rgb;
use plycloth::render::camera::{Camera, Projection};
use plycloth::render::driver::Film;
use plycloth::render::light::{Light, Lights};
use plycloth::render::path::PathLimits;
use plycloth::render::scene::{Material, Materials, Scene};
use plycloth::scatter::body::BodyKind;
use plycloth::scatter::ggx::Ggx;
use plycloth::scatter::ply::{PlyBsdf, PlyParameters};
use plycloth::weave::pattern::WeavePattern;

pub fn round(plies: usize) -> YarnShape {
    let radius = 0.4;
    let sin = (std::f64::consts::PI / plies as f64).sin();
    let ply_radius = if plies == 1 { radius } else { radius * sin / (1.0 + sin) };
    YarnShape::round(radius, plies, ply_radius, 3.0)
}

pub fn flat() -> YarnShape {
    YarnShape::Flat { width: 0.9, thickness: 0.1 }
}

/// A weave of `ends` x `picks` with unit spacing; `up(pick, end)` is true where the warp is up.
pub fn cloth(
    [picks, ends]: [usize; 2],
    up: impl Fn(usize, usize) -> bool,
    shape: YarnShape,
) -> ClothSpec {
    let warp_up = (0..picks * ends).map(|i| up(i / ends, i % ends)).collect();
    let set = |count| YarnSpec::uniform(shape, 1.0, vec![1.0; count]);
    ClothSpec {
        pattern: WeavePattern { picks, ends, warp_up },
        warp: set(ends),
        weft: set(picks),
        collision_stiffness: 1.0,
    }
}

pub fn plain(shape: YarnShape) -> ClothSpec {
    cloth([2, 2], |pick, end| pick == end, shape)
}

pub fn swatch(spec: &ClothSpec, size: f64) -> Swatch {
    swatch_of(spec, [size, size]).unwrap()
}

/// A relaxed piece of cloth.
pub fn swatch_of(spec: &ClothSpec, size: [f64; 2]) -> Result<Swatch> {
    RelaxedCloth::new(spec, &Control::default())?.swatch(size)
}

pub fn parameters() -> PlyParameters {
    PlyParameters {
        eta: 1.5,
        specular_tint: Rgb::new(0.9, 0.8, 0.7),
        transmission_tint: Rgb::new(0.6, 0.7, 0.8),
        base_color: Rgb::new(0.8, 0.5, 0.2),
        transmitted_color: Rgb::new(0.3, 0.6, 0.9),
        body_reflection: 0.6,
        extinction: 1.5,
        roughness: Ggx { along: 0.2, across: 0.3 },
        exit_roughness: Ggx { along: 0.3, across: 0.4 },
        body: BodyKind::Conserving,
    }
}

/// A ply that absorbs nothing.
pub fn white(roughness: Ggx, exit_roughness: Ggx) -> PlyParameters {
    PlyParameters {
        specular_tint: Rgb::ONE,
        transmission_tint: Rgb::ONE,
        base_color: Rgb::ONE,
        transmitted_color: Rgb::ONE,
        roughness,
        exit_roughness,
        ..parameters()
    }
}

pub fn ply(parameters: PlyParameters) -> Material {
    Material::Ply(Box::new(PlyBsdf::new(parameters).unwrap()))
}

/// A camera that looks from above at a square of 4 x 4, by so many pixels along each side.
pub fn above(pixels: usize) -> Camera {
    let (from, view) = (DVec3::new(0.0, 0.0, 10.0), Projection::Orthographic { width: 4.0 });
    Camera::new(from, DVec3::ZERO, DVec3::Y, view, [pixels; 2]).unwrap()
}

/// A swatch of `size`, all yarns of one material.
pub fn scene(spec: &ClothSpec, size: f64, material: Material, lights: Vec<Light>) -> Scene {
    Scene {
        swatch: swatch(spec, size),
        materials: Materials {
            list: vec![material],
            of_yarn: [vec![0; spec.pattern.ends], vec![0; spec.pattern.picks]],
        },
        lights: Lights::new(lights),
        background: None,
    }
}

pub fn furnace() -> Vec<Light> {
    vec![Light::Constant { radiance: Rgb::ONE }]
}

/// Mean over what is seen from above, and its standard error.
pub fn mean_radiance(scene: &Scene, spp: u32, max_depth: u32) -> (Rgb, Rgb) {
    mean_seen(above(32), scene, spp, max_depth)
}

/// Mean over all pixels of a camera's picture, and its standard error.
pub fn mean_seen(camera: Camera, scene: &Scene, spp: u32, max_depth: u32) -> (Rgb, Rgb) {
    let limits = PathLimits {
        max_depth,
        roulette_depth: 5.min(max_depth),
        both_sides: false,
        lobe_floor: 0.0,
    };
    let film = Film::new(camera, 1, limits).unwrap();
    film.run(scene, spp, &Control::default()).unwrap();
    let [means, variances] = film.image().unwrap().map(pixels);
    let n = means.len() as f64;
    let mean = means.into_iter().sum::<Rgb>() / n;
    let variance = variances.into_iter().sum::<Rgb>() / (n * n);
    (mean, variance.map(f64::sqrt))
}

/// Values of three channels each, as colours.
pub fn pixels(values: Vec<f32>) -> Vec<Rgb> {
    values
        .chunks_exact(3)
        .map(|value| Rgb::from_array([0, 1, 2].map(|c| value[c].into())))
        .collect()
}
