//! Ways inside straight plies against the circle's closed form: far along the ply, too.

mod common;

use common::rays::direction;
use common::{cloth, swatch_of};
use glam::DVec3;
use plycloth::accel::ray::Ray;
use plycloth::cloth::spec::{ClothSpec, YarnShape};
use plycloth::cloth::yarn_path::YarnSet;
use plycloth::math::rng::Sampler;

const RADIUS: f64 = 0.4;

/// Ends that lie straight above threads: nothing bends them.
fn straight() -> ClothSpec {
    let round = |radius| YarnShape::round(radius, 1, radius, 1.0);
    let mut spec = cloth([2, 2], |_, _| true, round(RADIUS));
    spec.weft.kinds[0].shape = round(1e-3);
    spec
}

/// The worst relative error of ways inside whose extent along the ply lies within a range, in
/// spacings, and how many there were.
fn worst([low, high]: [f64; 2]) -> (f64, usize) {
    let swatch = swatch_of(&straight(), [40.0, 200.0]).unwrap();
    let (mut worst, mut count) = (0.0f64, 0);
    for number in 0..20_000 {
        let sampler = &mut Sampler::new(21, number, 0);
        let [u, v] = sampler.next_2d();
        let origin = DVec3::new(0.9 * u - 0.45, 2.0 * v - 1.0, 3.0);
        let ray = Ray { origin, direction: DVec3::NEG_Z };
        let Some(hit) = swatch.nearest(&ray).filter(|hit| hit.place.set == YarnSet::Warp) else {
            continue;
        };
        let normal = DVec3::new(hit.surface.normal.x, 0.0, hit.surface.normal.z).normalize();
        // A direction inwards, mostly along the ply.
        let sideways = direction(sampler);
        let along = 12.0 * (2.0 * sampler.next_1d() - 1.0);
        let inwards = DVec3::new(sideways.x, along, sideways.z).normalize();
        let sine = -inwards.dot(normal);
        if sine < 1e-3 {
            continue;
        }
        // Across the ply a chord of the circle; the way is longer by the slope.
        let across2 = 1.0 - inwards.y * inwards.y;
        let expected = 2.0 * RADIUS * sine / across2;
        if !(low..high).contains(&(expected * inwards.y.abs())) {
            continue;
        }
        let inner = Ray { origin: ray.at(hit.t), direction: inwards };
        let length = swatch.way(&hit.place, &[], &inner).length;
        worst = worst.max((length / expected - 1.0).abs());
        count += 1;
    }
    println!("{low} to {high}: {count} ways, worst {worst}");
    (worst, count)
}

#[test]
fn ways_of_a_crossing_and_a_half_end_at_the_wall() {
    let (worst, count) = worst([0.0, 1.5]);
    assert!(count > 1_000 && worst < 1e-6, "{worst} of {count}");
}

#[test]
fn ways_of_many_crossings_end_at_the_wall() {
    let (worst, count) = worst([1.5, 30.0]);
    assert!(count > 1_000 && worst < 1e-6, "{worst} of {count}");
}
