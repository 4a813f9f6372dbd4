//! White cloth in a white world: what comes back is never more than what came.

mod common;

use common::{
    above, flat, furnace, mean_radiance, mean_seen, parameters, plain, ply, round, scene,
};
use glam::DVec3;
use plycloth::cloth::spec::{ClothSpec, YarnShape};
use plycloth::math::color::Rgb;
use plycloth::math::rng::Sampler;
use plycloth::render::camera::{Camera, Projection};
use plycloth::render::light::{Light, Rectangle};
use plycloth::scatter::body::BodyKind;
use plycloth::scatter::ggx::Ggx;
use plycloth::scatter::ply::PlyParameters;
use statrs::distribution::{ContinuousCDF, Normal};

/// White, as rough along as across, where light enters and where it leaves.
fn white(roughness: f64) -> PlyParameters {
    let ggx = Ggx { along: roughness, across: roughness };
    common::white(ggx, ggx)
}

#[test]
fn cloth_that_absorbs_nothing_vanishes() {
    for (roughness, tolerance) in [(0.01, 0.005), (0.05, 0.02)] {
        for shape in [round(1), round(3), flat()] {
            let scene = scene(&plain(shape), 40.0, ply(white(roughness)), furnace());
            let (mean, error) = mean_radiance(&scene, 640, 400);
            let off = (mean - Rgb::ONE).abs().max_element();
            println!("roughness {roughness} {shape:?}: {mean:.5} +- {error:.5}");
            assert!(off < tolerance + 4.0 * error.max_element(), "{mean} +- {error}");
        }
    }
}

/// A small swatch seen from the side, where the edge cuts its yarns.
#[test]
fn cut_ends_neither_lose_nor_make_light() {
    for shape in [round(1), round(3)] {
        let scene = scene(&plain(shape), 3.3, ply(white(0.01)), furnace());
        let from = DVec3::new(6.0, -5.0, 1.0);
        let view = Projection::Orthographic { width: 4.0 };
        let camera = Camera::new(from, DVec3::ZERO, DVec3::Z, view, [64, 64]).unwrap();
        let (mean, error) = mean_seen(camera, &scene, 160, 400);
        let off = (mean - Rgb::ONE).abs().max_element();
        println!("cut ends of {shape:?}: {mean:.5} +- {error:.5}");
        assert!(off < 0.003 + 4.0 * error.max_element(), "{mean} +- {error}");
        assert!(error.max_element() < 0.005, "{error}");
    }
}

/// An opaque yarn seen into its end, with all light behind it.
#[test]
fn no_light_passes_through_an_opaque_yarn_along_its_axis() {
    let black = PlyParameters {
        specular_tint: Rgb::ZERO,
        base_color: Rgb::ZERO,
        transmitted_color: Rgb::ZERO,
        extinction: 1e3,
        ..parameters()
    };
    let edges = [DVec3::new(40.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 40.0)];
    let lamp = Light::Rectangle(Rectangle::new(DVec3::new(0.0, 20.0, 0.0), edges, Rgb::ONE));
    let scene = scene(&plain(round(1)), 4.0, ply(black), vec![lamp]);
    // Onto the end at x = 0.5, where the swatch ends half way between two picks.
    let (from, at) = (DVec3::new(0.5, -9.0, 0.0), DVec3::new(0.5, 0.0, 0.0));
    let view = |width| Projection::Orthographic { width };
    let camera = |width| Camera::new(from, at, DVec3::Z, view(width), [16, 16]).unwrap();
    let (mean, _) = mean_seen(camera(0.5), &scene, 16, 60);
    assert_eq!(mean, Rgb::ZERO);
    // Around it the lamp is seen.
    assert!(mean_seen(camera(6.0), &scene, 16, 60).0.min_element() > 0.1);
}

/// How many parameter sets a cloth is tried with.
const SETS: u64 = 200;

/// A number within [`low`, `high`] that is each bound itself once in four times.
fn within(sampler: &mut Sampler, low: f64, high: f64) -> f64 {
    match sampler.next_2d() {
        [choice, _] if choice < 0.25 => low,
        [choice, _] if choice < 0.5 => high,
        [_, u] => low + u * (high - low),
    }
}

fn random_parameters(set: u64) -> PlyParameters {
    let sampler = &mut Sampler::new(5, set, 0);
    let mut color = || Rgb::from_array([(); 3].map(|()| within(sampler, 0.0, 1.0)));
    let colors = [color(), color(), color(), color()];
    let mut ggx = || {
        let [along, across] = [(); 2].map(|()| within(sampler, 0.001, 1.0));
        Ggx { along, across }
    };
    let (roughness, exit_roughness) = (ggx(), ggx());
    PlyParameters {
        eta: within(sampler, 1.01, 3.0),
        specular_tint: colors[0],
        transmission_tint: colors[1],
        base_color: colors[2],
        transmitted_color: colors[3],
        body_reflection: within(sampler, 0.0, 1.0),
        extinction: match within(sampler, -3.0, 6.0) {
            -3.0 => 0.0,
            power => 10f64.powf(power),
        },
        roughness,
        exit_roughness,
        body: BodyKind::Conserving,
    }
}

/// Plies with so much room between them that few see another.
fn lone_plies() -> ClothSpec {
    let ply = YarnShape::round(0.4, 1, 0.4, 3.0);
    let mut spec = plain(ply);
    (spec.warp.spacing, spec.weft.spacing) = (vec![3.0; 2], vec![3.0; 2]);
    spec
}

#[test]
fn no_parameters_return_more_than_was_received() {
    let cloths = [lone_plies(), plain(flat()), plain(round(3))];
    // Sidak over all sets, cloths and channels at 1% together: this many standard errors.
    let tests = 3.0 * 3.0 * SETS as f64;
    let limit = Normal::standard().inverse_cdf(0.99f64.powf(1.0 / tests));
    for spec in cloths {
        let mut scene = scene(&spec, 40.0, ply(parameters()), furnace());
        for set in 0..SETS {
            let parameters = random_parameters(set);
            scene.materials.list = vec![ply(parameters)];
            let (mean, error) = mean_seen(above(12), &scene, 4, 60);
            let z = ((mean - Rgb::ONE) / error.max(Rgb::splat(1e-6))).max_element();
            assert!(mean.is_finite() && mean.min_element() >= 0.0, "{mean} {parameters:?}");
            assert!(z < limit, "z = {z}: {mean} +- {error} {parameters:?}");
            assert!(error.max_element() < 0.25, "{mean} +- {error} {parameters:?}");
        }
    }
}

#[test]
fn a_ply_without_any_lobe_is_black() {
    let black = PlyParameters { specular_tint: Rgb::ZERO, body_reflection: 0.0, ..parameters() };
    let scene = scene(&plain(round(3)), 40.0, ply(black), furnace());
    // What is seen between the yarns is all there is: paths of one segment see as much.
    let (mean, _) = mean_radiance(&scene, 4, 60);
    let (between, _) = mean_radiance(&scene, 4, 1);
    assert_eq!(mean, between);
    assert!(between.max_element() < 0.2, "{between}");
}

/// Microfacets that scatter light once lose what others block: more, the rougher they are.
#[test]
fn rough_plies_lose_what_is_scattered_more_than_once() {
    let mut scene = scene(&plain(round(3)), 40.0, ply(parameters()), furnace());
    let mut brighter = 1.0;
    for roughness in [0.02, 0.1, 0.2, 0.3, 0.5, 1.0] {
        scene.materials.list = vec![ply(white(roughness))];
        let (mean, error) = mean_radiance(&scene, 160, 200);
        println!(
            "roughness {roughness}: loses {:.2}% +- {:.2}%",
            100.0 * (1.0 - mean.y),
            100.0 * error.y
        );
        assert!(mean.y < brighter + 4.0 * error.y, "{mean} +- {error}");
        brighter = mean.y;
    }
}
