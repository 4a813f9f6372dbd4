//! White cloth of any kind in a white world: sharp enough that a surplus of a hundredth is seen.

mod common;

use common::{above, flat, furnace, mean_seen, parameters, plain, ply, round, scene, white};
use plycloth::cloth::spec::YarnShape;
use plycloth::math::rng::Sampler;
use plycloth::render::scene::Scene;
use plycloth::scatter::ggx::Ggx;
use plycloth::scatter::ply::PlyParameters;
use statrs::distribution::{ContinuousCDF, Normal};

/// Segments after which what is left of a path no longer counts.
const DEPTH: u32 = 2_000;

/// All tests of the file fail by chance once in a thousand times.
const SIGNIFICANCE: f64 = 1e-3;

fn shapes() -> [YarnShape; 3] {
    [round(1), round(3), flat()]
}

/// Mean and standard error of one channel; all are alike.
fn mean(scene: &mut Scene, parameters: PlyParameters, spp: u32) -> [f64; 2] {
    scene.materials.list = vec![ply(parameters)];
    let (mean, error) = mean_seen(above(12), scene, spp, DEPTH);
    [mean.y, error.y.max(1e-6)]
}

fn limit(tests: usize) -> f64 {
    Normal::standard().inverse_cdf((1.0 - SIGNIFICANCE).powf(1.0 / tests as f64))
}

fn small(shape: YarnShape) -> Scene {
    scene(&plain(shape), 40.0, ply(parameters()), furnace())
}

/// Mean and standard error, of as many samples as it takes: paths inside white plies that overlap are
/// long, and some weigh much.
fn sharp_mean(scene: &mut Scene, set: PlyParameters) -> [f64; 2] {
    let tries = [256, 1024, 4096].map(|spp| move |scene: &mut Scene| mean(scene, set, spp));
    let mut last = [0.0, f64::INFINITY];
    for sample in tries {
        if last[1] >= LEAST_SHARP {
            last = sample(scene);
        }
    }
    last
}

/// Means with a larger standard error do not tell enough.
const LEAST_SHARP: f64 = 4e-3;

/// Smooth facets block nothing, so what comes back is what came: no lobe may have a hundredth more
/// or less, whichever of them the light goes through.
#[test]
fn smooth_white_cloth_returns_what_it_receives() {
    let smooth = Ggx { along: 0.01, across: 0.01 };
    let kinds = [("opaque", 1e6), ("cloudy", 3.0), ("clear", 0.0)];
    let mut tests = Vec::new();
    for shape in shapes() {
        let mut scene = small(shape);
        for (name, extinction) in kinds {
            for body_reflection in [0.0, 0.5, 1.0] {
                for eta in [1.05, 1.5] {
                    let white = white(smooth, smooth);
                    let set = PlyParameters { extinction, body_reflection, eta, ..white };
                    let [mean, error] = sharp_mean(&mut scene, set);
                    let name = format!("{shape:?} {name}, r = {body_reflection}, eta = {eta}");
                    tests.push((name, mean, error));
                }
            }
        }
    }
    let limit = limit(2 * tests.len());
    for (name, mean, error) in &tests {
        println!("{name}: {mean:.5} +- {error:.5}");
        assert!(*error < LEAST_SHARP, "too noisy to tell: {name}: {mean} +- {error}");
        // What facets of this width lose was found to be below 0.3%.
        assert!(mean - 1.0 < limit * error, "{name}: {mean} +- {error}");
        assert!(1.0 - mean < 5e-3 + limit * error, "{name}: {mean} +- {error}");
    }
    let n = tests.len() as f64;
    let pooled = tests.iter().map(|test| test.1).sum::<f64>() / n;
    let error = tests.iter().map(|test| test.2.powi(2)).sum::<f64>().sqrt() / n;
    println!("all: {pooled:.5} +- {error:.5}");
    assert!(error < 5e-4, "too noisy to tell: {error}");
    assert!(pooled - 1.0 < limit * error, "{pooled} +- {error}");
    assert!(1.0 - pooled < 3e-3, "{pooled} +- {error}");
}

/// Rough facets lose light and win none.
#[test]
fn no_white_cloth_returns_more_than_it_receives() {
    let sets = 40;
    let mut surplus = Vec::new();
    for shape in shapes() {
        let mut scene = small(shape);
        for number in 0..sets {
            let sampler = &mut Sampler::new(8, number, 0);
            let mut within = |low: f64, high: f64| low + sampler.next_1d() * (high - low);
            let mut ggx = || Ggx { along: within(0.02, 0.6), across: within(0.02, 0.6) };
            let white = white(ggx(), ggx());
            let extinction = 10f64.powf(within(-1.0, 4.0));
            let (body_reflection, eta) = (within(0.0, 1.0), within(1.01, 2.5));
            let set = PlyParameters { extinction, body_reflection, eta, ..white };
            let [mean, error] = mean(&mut scene, set, 64);
            surplus.push(((mean - 1.0) / error, error, set));
        }
    }
    // Clear plies that bend light strongly are noisy; most sets have to be sharp.
    surplus.sort_by(|a, b| a.1.total_cmp(&b.1));
    let [half, most] = [0.5, 0.9].map(|part| surplus[(part * surplus.len() as f64) as usize].1);
    println!("standard errors: half below {half:.4}, nine of ten below {most:.4}");
    assert!(half < 0.01 && most < 0.03, "too noisy to tell: {half} {most}");
    let limit = limit(surplus.len());
    for (z, error, set) in surplus {
        assert!(z < limit, "z = {z}, error {error}: {set:?}");
    }
}
