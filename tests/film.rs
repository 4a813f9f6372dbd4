//! Pictures in the making: stopped, looked at, gone on with, saved, merged, and met by a panic.

mod common;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use common::{above, furnace, parameters, plain, ply, round, scene};
use plycloth::control::Control;
use plycloth::render::driver::Film;
use plycloth::render::path::PathLimits;
use plycloth::render::scene::Scene;

const LIMITS: PathLimits =
    PathLimits { max_depth: 6, roulette_depth: 5, both_sides: false, lobe_floor: 0.0 };

fn cloth() -> Scene {
    scene(&plain(round(3)), 4.0, ply(parameters()), furnace())
}

fn film(scene: &Scene, seed: u64, samples: u32) -> Film {
    let film = Film::new(above(32), seed, LIMITS).unwrap();
    if samples > 0 {
        film.run(scene, samples, &Control::default()).unwrap();
    }
    film
}

/// Runs until a part of the samples are taken, and stops there.
fn run_in_part(film: &Film, scene: &Scene, samples: u32, part: f64) {
    let (control, over) = (Control::default(), AtomicBool::new(false));
    let enough = part * film.remaining(samples) as f64;
    thread::scope(|scope| {
        scope.spawn(|| {
            while (control.done() as f64) < enough && !over.load(Ordering::Relaxed) {
                thread::yield_now();
            }
            control.stop();
        });
        assert!(film.run(scene, samples, &control).is_err(), "it ended before it was stopped");
        over.store(true, Ordering::Relaxed);
    });
}

#[test]
fn what_is_stopped_has_its_samples_everywhere() {
    let scene = cloth();
    let stopped = film(&scene, 3, 0);
    run_in_part(&stopped, &scene, 400, 0.1);
    let taken = stopped.samples();
    assert!((40..300).contains(&taken), "{taken}");
    // All pixels have as many samples, or one more: those that are left are told by the count.
    let left = 400 * 32 * 32 - stopped.remaining(1) + 32 * 32;
    assert!((taken..=taken + 1).contains(&(left / (32 * 32))), "{left}");
    // The samples that it has are the same as those of a run that was to be so short.
    let short = film(&scene, 3, taken as u32).image().unwrap();
    let [means, _] = stopped.image().unwrap();
    let same = means.iter().zip(&short[0]).filter(|(a, b)| a == b).count();
    assert!(same > 0 && means.iter().all(|value| *value > 0.0));
    stopped.run(&scene, 1, &Control::default()).unwrap();
    assert_eq!(stopped.image().unwrap(), film(&scene, 3, 401).image().unwrap());
}

#[test]
fn two_runs_at_once_take_the_samples_of_both() {
    let scene = cloth();
    let shared = film(&scene, 3, 0);
    thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| shared.run(&scene, 20, &Control::default()).unwrap());
        }
    });
    assert_eq!(shared.samples(), 40);
    assert_eq!(shared.image().unwrap(), film(&scene, 3, 40).image().unwrap());
}

#[test]
fn a_panic_spoils_nothing() {
    let (scene, mut broken) = (cloth(), cloth());
    broken.materials.of_yarn = [vec![], vec![]];
    let film_after = film(&scene, 3, 2);
    let run = || film_after.run(&broken, 2, &Control::default());
    assert!(catch_unwind(AssertUnwindSafe(run)).is_err());
    assert_eq!(film_after.samples(), 2);
    film_after.run(&scene, 1, &Control::default()).unwrap();
    assert_eq!(film_after.image().unwrap(), film(&scene, 3, 5).image().unwrap());
}

#[test]
fn what_is_saved_is_gone_on_with() {
    let scene = cloth();
    let saved = film(&scene, 3, 0);
    run_in_part(&saved, &scene, 100, 0.3);
    let copy = film(&scene, 3, 0);
    copy.restore(saved.target(), &saved.words().unwrap()).unwrap();
    assert_eq!(copy.image().unwrap(), saved.image().unwrap());
    for film in [&saved, &copy] {
        film.run(&scene, 5, &Control::default()).unwrap();
    }
    assert_eq!(copy.image().unwrap(), film(&scene, 3, 105).image().unwrap());
    assert!(copy.restore(1, &[0; 7]).is_err());
}

/// The mean of all samples, wherever they were taken, and as many samples as both had.
#[test]
fn merged_films_have_the_samples_of_both() {
    let scene = cloth();
    let (one, other) = (film(&scene, 3, 10), film(&scene, 4, 30));
    let [[a, _], [b, _]] = [&one, &other].map(|film| film.image().unwrap());
    one.merge(&other.words().unwrap()).unwrap();
    assert_eq!(one.samples(), 40);
    for ((merged, a), b) in one.image().unwrap()[0].iter().zip(&a).zip(&b) {
        assert!((merged - (0.25 * a + 0.75 * b)).abs() <= 1e-6 * merged.abs());
    }
    one.run(&scene, 5, &Control::default()).unwrap();
    assert_eq!(one.samples(), 45);
    assert_eq!(one.target(), 15);
}
