//! Recorded paths against the path tracer, and their derivatives against finite differences.

mod common;

use common::{above, flat, mean_radiance, parameters, plain, ply, round, scene};
use glam::DVec3;
use plycloth::cloth::spec::YarnShape;
use plycloth::control::Control;
use plycloth::math::color::Rgb;
use plycloth::render::cells::Cells;
use plycloth::render::light::{Light, Rectangle};
use plycloth::render::path::PathLimits;
use plycloth::render::scene::Scene;
use plycloth::render::tape::{Tape, parameter};
use plycloth::scatter::body::BodyKind;
use plycloth::scatter::ply::PlyParameters;

const LIMITS: PathLimits =
    PathLimits { max_depth: 6, roulette_depth: 3, both_sides: true, lobe_floor: 0.05 };

/// Light from in front and from behind, from a point, a rectangle and everywhere.
fn lights() -> Vec<Light> {
    let edges = [DVec3::new(3.0, 0.0, 0.0), DVec3::new(0.0, 3.0, 0.0)];
    vec![
        Light::Point { position: DVec3::new(0.0, 6.0, 8.0), intensity: Rgb::new(90.0, 80.0, 70.0) },
        Light::Rectangle(Rectangle::new(DVec3::new(0.0, 1.0, -4.0), edges, Rgb::splat(5.0))),
        Light::Constant { radiance: Rgb::new(0.3, 0.2, 0.1) },
    ]
}

fn lit(shape: YarnShape, parameters: PlyParameters) -> Scene {
    scene(&plain(shape), 40.0, ply(parameters), lights())
}

fn cells(paths: u32, seed: u64) -> Cells {
    Cells { camera: above(32), grid: [2, 2], paths, seed, limits: LIMITS }
}

fn record(scene: &Scene, paths: u32) -> Tape {
    Tape::record(scene, cells(paths, 3), &Control::default()).unwrap()
}

#[test]
fn averages_at_the_recorded_parameters_are_those_of_the_path_tracer() {
    for shape in [round(3), flat()] {
        let scene = lit(shape, parameters());
        let averages = record(&scene, 2048).evaluate(&[parameters()], &Control::default()).unwrap();
        let mean: Rgb = averages.values.chunks(3).map(Rgb::from_slice).sum::<Rgb>() / 4.0;
        let (expected, error) = mean_radiance(&scene, 64, LIMITS.max_depth);
        let z = ((mean - expected) / error).abs().max_element();
        // The tape has an eighth of the tracer's samples, each no noisier than one of those.
        assert!(z < 4.0 * (1.0f64 + 8.0).sqrt(), "{mean} {expected} {error}");
    }
}

#[test]
fn the_same_paths_have_the_same_averages_recorded_or_not() {
    let scene = lit(round(3), parameters());
    let control = Control::default();
    let replayed = record(&scene, 256).evaluate(&[parameters()], &control).unwrap().values;
    let traced = cells(256, 3).averages(&scene, &control).unwrap();
    for (replayed, traced) in replayed.chunks(3).map(Rgb::from_slice).zip(traced) {
        assert!((replayed / traced - 1.0).abs().max_element() < 1e-9, "{replayed} {traced}");
    }
}

/// Mean over the picture, and its standard error, by tapes of independent paths.
fn replayed(scene: &Scene, at: PlyParameters) -> (Rgb, Rgb) {
    let tapes = 12;
    let (mut sum, mut squares) = (Rgb::ZERO, Rgb::ZERO);
    for seed in 0..tapes {
        let tape = Tape::record(scene, cells(2048, seed), &Control::default()).unwrap();
        let averages = tape.evaluate(&[at], &Control::default()).unwrap();
        let mean: Rgb = averages.values.chunks(3).map(Rgb::from_slice).sum::<Rgb>() / 4.0;
        sum += mean;
        squares += mean * mean;
    }
    let n = tapes as f64;
    let mean = sum / n;
    (mean, ((squares / n - mean * mean).max(Rgb::ZERO) / (n - 1.0)).map(f64::sqrt))
}

/// Away from the recorded parameters no factor of a path's weight is one: each has to be right.
#[test]
fn averages_at_other_parameters_are_those_of_the_path_tracer_there() {
    for body in [BodyKind::Conserving, BodyKind::Printed] {
        for shape in [round(2), flat()] {
            for factor in [0.88, 1.1] {
                let recorded = PlyParameters { body, ..parameters() };
                let mut there = recorded;
                for index in 0..parameter::COUNT {
                    let factor = if index % 2 == 0 { factor } else { 1.0 / factor };
                    set(&mut there, index, (get(&recorded, index) * factor).min(1.0));
                }
                there.extinction = recorded.extinction * factor;
                there.eta = (2.0 - factor) * recorded.eta;
                let (mean, error) = replayed(&lit(shape, recorded), there);
                let (expected, noise) = mean_radiance(&lit(shape, there), 64, LIMITS.max_depth);
                let z = ((mean - expected) / (error * error + noise * noise).map(f64::sqrt)).abs();
                assert!(
                    z.max_element() < 4.5,
                    "{body:?} {shape:?} {factor}: {mean} {expected} {z}"
                );
                assert!(error.max_element() < 0.02 * mean.max_element(), "{mean} {error}");
            }
        }
    }
}

/// What paths are recorded with, and another place that they are evaluated at.
fn moves() -> Vec<(&'static str, PlyParameters, PlyParameters)> {
    let p = parameters();
    let (dark, grey) = (Rgb::ZERO, Rgb::splat(0.4));
    let red = Rgb::new(1.0, 0.0, 0.0);
    vec![
        ("r from 1", PlyParameters { body_reflection: 1.0, ..p }, p),
        ("r from 0", PlyParameters { body_reflection: 0.0, ..p }, p),
        ("a body from black", PlyParameters { base_color: dark, ..p }, p),
        ("two channels from 0", PlyParameters { transmitted_color: red, ..p }, p),
        (
            "both transmissions from 0",
            PlyParameters { transmission_tint: dark, transmitted_color: dark, ..p },
            p,
        ),
        (
            "all but the body from 0",
            PlyParameters { specular_tint: dark, ..p },
            PlyParameters { specular_tint: grey, ..p },
        ),
        (
            "all from 0",
            PlyParameters {
                specular_tint: dark,
                transmission_tint: dark,
                base_color: dark,
                transmitted_color: dark,
                body_reflection: 0.0,
                ..p
            },
            PlyParameters { specular_tint: grey, ..p },
        ),
        ("eta up from 1.05", PlyParameters { eta: 1.05, ..p }, PlyParameters { eta: 1.1, ..p }),
        ("eta down to 1.05", PlyParameters { eta: 1.1, ..p }, PlyParameters { eta: 1.05, ..p }),
        ("eta up", PlyParameters { eta: 1.5, ..p }, PlyParameters { eta: 1.65, ..p }),
        ("eta down", PlyParameters { eta: 1.5, ..p }, PlyParameters { eta: 1.35, ..p }),
        ("eta up to 2", PlyParameters { eta: 1.8, ..p }, PlyParameters { eta: 2.0, ..p }),
        ("eta down from 2", PlyParameters { eta: 2.0, ..p }, PlyParameters { eta: 1.8, ..p }),
    ]
}

/// Mean and standard error of what `value` answers for independent seeds.
fn over_seeds(seeds: u64, value: impl Fn(u64) -> f64) -> [f64; 2] {
    let values: Vec<_> = (0..seeds).map(value).collect();
    let n = seeds as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    [mean, (variance / n).sqrt()]
}

/// The derivative by eta of the picture's mean green against differences of pictures apart.
#[test]
fn derivatives_by_eta_are_those_of_pictures() {
    for shape in [round(1), flat()] {
        for eta in [1.05, 1.2, 1.5, 2.0] {
            let at = |eta| PlyParameters { eta, ..parameters() };
            let scene = lit(shape, at(eta));
            let green = |values: &[f64]| values.iter().skip(1).step_by(3).sum::<f64>() / 4.0;
            let [slope, error] = over_seeds(16, |seed| {
                let tape = Tape::record(&scene, cells(2048, seed), &Control::default()).unwrap();
                let averages = tape.evaluate(&[at(eta)], &Control::default()).unwrap();
                let rows = averages.jacobian.chunks(parameter::COUNT);
                let by_eta: Vec<_> = rows.map(|row| row[parameter::ETA]).collect();
                green(&by_eta)
            });
            let step = 0.02 * eta;
            let moved = [-step, step].map(|step| lit(shape, at(eta + step)));
            let [expected, noise] = over_seeds(32, |seed| {
                let [below, above] = [0, 1].map(|side| {
                    let averages =
                        cells(8192, 100 + seed).averages(&moved[side], &Control::default());
                    averages.unwrap().iter().map(|color| color.y).sum::<f64>() / 4.0
                });
                (above - below) / (2.0 * step)
            });
            let z = (slope - expected) / (error * error + noise * noise).sqrt();
            println!("eta {eta} {shape:?}: {slope:.4} +- {error:.4}, {expected:.4} +- {noise:.4}");
            assert!(z.abs() < 4.0, "eta {eta} {shape:?}: {slope} {error} {expected} {noise}");
        }
    }
}

/// What is dark where paths are drawn may be lit elsewhere.
#[test]
fn paths_from_bounds_are_those_of_the_path_tracer_elsewhere() {
    for shape in [round(2), flat()] {
        for (name, recorded, there) in moves() {
            let (mean, error) = replayed(&lit(shape, recorded), there);
            let (expected, noise) = mean_radiance(&lit(shape, there), 64, LIMITS.max_depth);
            let z = (mean - expected) / (error * error + noise * noise).map(f64::sqrt);
            println!("{name} {shape:?}: {mean:.4} +- {error:.4}, {expected:.4} +- {noise:.4}");
            assert!(z.abs().max_element() < 4.5, "{name}: {mean} {expected} {z}");
            // Lobes that come from nothing are noisy: they had one path in twenty.
            assert!(error.max_element() < 0.08 * mean.max_element(), "{name}: {mean} {error}");
        }
    }
}

fn set(parameters: &mut PlyParameters, index: usize, value: f64) {
    use parameter::*;
    let p = parameters;
    match index {
        ETA => p.eta = value,
        i if i < TRANSMISSION_TINT => p.specular_tint[i - SPECULAR_TINT] = value,
        i if i < BASE_COLOR => p.transmission_tint[i - TRANSMISSION_TINT] = value,
        i if i < TRANSMITTED_COLOR => p.base_color[i - BASE_COLOR] = value,
        i if i < BODY_REFLECTION => p.transmitted_color[i - TRANSMITTED_COLOR] = value,
        BODY_REFLECTION => p.body_reflection = value,
        EXTINCTION => p.extinction = value,
        ROUGHNESS => p.roughness.along = value,
        i if i < EXIT_ROUGHNESS => p.roughness.across = value,
        EXIT_ROUGHNESS => p.exit_roughness.along = value,
        _ => p.exit_roughness.across = value,
    }
}

fn get(parameters: &PlyParameters, index: usize) -> f64 {
    let p = parameters;
    let colors = [p.specular_tint, p.transmission_tint, p.base_color, p.transmitted_color];
    let mut all = vec![p.eta];
    all.extend(colors.iter().flat_map(|color| color.to_array()));
    all.extend([p.body_reflection, p.extinction]);
    all.extend([p.roughness.along, p.roughness.across]);
    all.extend([p.exit_roughness.along, p.exit_roughness.across]);
    all[index]
}

/// Derivatives by all but eta, of which those of single paths miss what comes over the horizon.
#[test]
fn derivatives_agree_with_central_differences() {
    for body in [BodyKind::Conserving, BodyKind::Printed] {
        for shape in [round(2), flat()] {
            let recorded = PlyParameters { body, ..parameters() };
            let tape = record(&lit(shape, recorded), 256);
            // Away from the recorded parameters, where every weight differs from one.
            let mut here = recorded;
            for index in 0..parameter::COUNT {
                set(&mut here, index, get(&recorded, index) * 1.03);
            }
            let evaluate = |p: PlyParameters| tape.evaluate(&[p], &Control::default()).unwrap();
            let exact = evaluate(here);
            for index in parameter::ETA + 1..parameter::COUNT {
                let step = 1e-7 * get(&here, index);
                let moved = |sign: f64| {
                    let mut moved = here;
                    set(&mut moved, index, get(&here, index) + sign * step);
                    evaluate(moved).values
                };
                let (plus, minus) = (moved(1.0), moved(-1.0));
                for (i, (plus, minus)) in plus.iter().zip(&minus).enumerate() {
                    let expected = (plus - minus) / (2.0 * step);
                    let got = exact.jacobian[i * parameter::COUNT + index];
                    let scale = expected.abs().max(1e-4 * exact.values[i] / get(&here, index));
                    assert!(
                        (got - expected).abs() <= 1e-4 * scale,
                        "{body:?} {shape:?} parameter {index} value {i}: {got} {expected}"
                    );
                }
            }
        }
    }
}
