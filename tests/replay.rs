//! Paths replayed with other roughness at y: the body's share (Eq. 14) is a mean over facets there,
//! and each recorded facet has to count as often as it is seen at the new roughness.

mod common;

use common::{above, flat, furnace, mean_radiance, parameters, plain, ply, round, scene};
use plycloth::cloth::spec::YarnShape;
use plycloth::control::Control;
use plycloth::math::color::Rgb;
use plycloth::render::cells::Cells;
use plycloth::render::path::PathLimits;
use plycloth::render::scene::Scene;
use plycloth::render::tape::Tape;
use plycloth::scatter::ggx::Ggx;
use plycloth::scatter::ply::PlyParameters;

const LIMITS: PathLimits =
    PathLimits { max_depth: 6, roulette_depth: 5, both_sides: true, lobe_floor: 0.05 };

/// Clear plies that show nothing but the body's reflection: what is turned back inside at y.
fn body_alone(exit: f64) -> PlyParameters {
    PlyParameters {
        specular_tint: Rgb::ZERO,
        base_color: Rgb::ONE,
        body_reflection: 1.0,
        extinction: 0.05,
        exit_roughness: Ggx { along: exit, across: exit },
        ..parameters()
    }
}

fn lit(shape: YarnShape, parameters: PlyParameters) -> Scene {
    scene(&plain(shape), 40.0, ply(parameters), furnace())
}

/// Mean over the picture of paths recorded in `scene` and replayed at other parameters, and its
/// standard error, by tapes of independent paths.
fn replayed(scene: &Scene, at: PlyParameters) -> [f64; 2] {
    let control = Control::default();
    let means: Vec<f64> = (0..16)
        .map(|seed| {
            let cells =
                Cells { camera: above(32), grid: [2, 2], paths: 2048, seed, limits: LIMITS };
            let tape = Tape::record(scene, cells, &control).unwrap();
            tape.evaluate(&[at], &control).unwrap().values.iter().sum::<f64>() / 12.0
        })
        .collect();
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    let squares = means.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
    [mean, (squares / (n * (n - 1.0))).sqrt()]
}

#[test]
fn recorded_facets_count_as_often_as_they_are_seen() {
    for shape in [flat(), round(1)] {
        for [recorded, there] in [[0.25, 0.45], [0.5, 0.3]] {
            let [mean, error] = replayed(&lit(shape, body_alone(recorded)), body_alone(there));
            let other = lit(shape, body_alone(there));
            let (expected, noise) = mean_radiance(&other, 256, LIMITS.max_depth);
            let z = (mean - expected.y) / error.hypot(noise.y);
            let summary =
                format!("{shape:?} {recorded} to {there}: {mean} {expected} z = {z}, {error}");
            println!("{summary}");
            assert!(z.abs() < 4.0, "{summary}");
            assert!(error.hypot(noise.y) < 1e-2 * mean, "too noisy to tell: {summary}");
        }
    }
}
