//! The walk over shared blocks against a loop over all segments of the whole cloth.

mod common;

use common::rays::direction;
use common::weaves::{
    mixed, press, pressed, random_ray, satin, swatch, thick_and_thin, thin, twill, uneven,
};
use common::whole::WholeCloth;
use common::{cloth, flat, plain, round, swatch_of};
use glam::DVec3;
use plycloth::accel::ray::Ray;
use plycloth::cloth::inside::Way;
use plycloth::cloth::spec::{ClothSpec, YarnKind, YarnShape, YarnSpec};
use plycloth::cloth::twist::Twist;
use plycloth::math::rng::Sampler;

/// Compares swatch and whole cloth along `count` random rays, and answers how many hit surfaces.
fn compare(spec: &ClothSpec, size: [f64; 2], count: u64) -> usize {
    let (walked, whole) = (swatch(spec, size), WholeCloth::new(spec, size));
    let unit = spec.unit();
    let (mut hits, mut ends) = (0, 0);
    for number in 0..count {
        let mut sampler = Sampler::new(11, number, 0);
        let ray = random_ray(&mut sampler, size);
        let (enter, leave) = whole.stretch(&ray);
        let expected = whole.nearest(&ray, enter.max(1e-6 * unit), leave);
        let found = walked.nearest(&ray);
        // By a cut end, which brute force has none of, the ray is inside a yarn at once.
        if let Some(hit) = found.filter(|hit| enter > 0.0 && (hit.t - enter).abs() < 1e-9) {
            let around = whole.containing(ray.at(enter + 1e-6));
            let same =
                around.iter().any(|ply| (ply.0, ply.1) == (hit.place.set, hit.place.number()));
            assert!(same && hit.surface.normal.z == 0.0, "{around:?} {hit:?}");
            assert!(walked.occluded(&ray, f64::INFINITY));
            ends += 1;
            continue;
        }
        if enter > 0.0 && found.is_none_or(|hit| hit.t > enter + 1e-3) {
            let around = whole.containing(ray.at(enter + 1e-7));
            assert!(around.is_empty(), "{around:?} {found:?}");
        }
        // Within the walk's tolerance of the rim or of the ray's start either answer is right.
        let doubtful = |t: f64| {
            let slack = 2e-6 * unit;
            (t - leave).abs() < slack || (t - enter.max(0.0)).abs() < slack
        };
        let distances = [expected.map(|e| e.0), found.map(|hit| hit.t)];
        if distances.iter().flatten().any(|&t| doubtful(t)) {
            continue;
        }
        let place = format!("ray {number} of {size:?} {ray:?}: {expected:?} {found:?}");
        assert_eq!(expected.is_some(), found.is_some(), "{place}");
        let (Some((t, set, yarn)), Some(hit)) = (expected, found) else {
            assert!(!walked.occluded(&ray, f64::INFINITY), "{place}");
            continue;
        };
        hits += 1;
        assert!((t - hit.t).abs() < 1e-9 * ray.origin.length().max(1.0), "{place}");
        assert_eq!((set, yarn), (hit.place.set, hit.place.yarn), "{place}");
        assert!(walked.occluded(&ray, f64::INFINITY), "{place}");
        assert!(walked.occluded(&ray, t + 1e-5) && !walked.occluded(&ray, t - 1e-5), "{place}");
    }
    let mut shapes = spec.warp.shapes().chain(spec.weft.shapes());
    let flat = shapes.all(|shape| matches!(shape, YarnShape::Flat { .. }));
    assert!(ends > 0 || flat || count < 1_000, "no cut ends");
    hits
}

#[test]
fn any_number_of_plies_is_met_where_brute_force_says() {
    for plies in 1..=12 {
        let hits = compare(&plain(thin(plies, 0.9, 2.1)), [3.7, 3.2], 1_500);
        assert!(hits > 500, "{hits}");
    }
}

#[test]
fn patterns_are_met_where_brute_force_says() {
    for shape in [round(3), thin(2, 1.0, -2.7), flat()] {
        for spec in [plain(shape), twill(2, 2, shape), twill(2, 1, shape), satin(shape)] {
            let hits = compare(&spec, [5.5, 4.3], 1_500);
            assert!(hits > 500, "{hits}");
        }
    }
}

#[test]
fn pressed_yarns_are_met_where_brute_force_says() {
    let mut two_aspects = uneven();
    press(&mut two_aspects.warp, 1.6);
    press(&mut two_aspects.weft, 2.5);
    let mut with_ribbons = mixed();
    press(&mut with_ribbons.weft, 3.0);
    let mut one_set = satin(thin(2, 1.0, -2.7));
    press(&mut one_set.warp, 4.0);
    for spec in [two_aspects, with_ribbons, one_set, plain(pressed(thin(1, 1.0, 1.0), 1.3))] {
        let hits = compare(&spec, [5.5, 4.3], 1_500);
        assert!(hits > 500, "{hits}");
    }
}

/// A pressed yarn of one ply that runs straight is an elliptic cylinder.
#[test]
fn normals_of_a_pressed_yarn_are_those_of_an_ellipse() {
    let yarn = pressed(YarnShape::round(0.4, 1, 0.4, 1.0), 4.0);
    let mut spec = cloth([1, 1], |_, _| true, yarn);
    spec.weft.kinds[0].shape = YarnShape::Flat { width: 0.1, thickness: 1e-3 };
    let swatch = swatch(&spec, [1.0, 1.0]);
    for step in 0..50 {
        let x = 0.39 * (f64::from(step) / 25.0 - 1.0);
        let ray = Ray { origin: DVec3::new(x, 0.1, 3.0), direction: DVec3::NEG_Z };
        let hit = swatch.nearest(&ray).unwrap();
        let gradient = DVec3::new(x / 0.16, 0.0, 0.1 * (1.0 - x * x / 0.16).sqrt() / 0.01);
        assert!((hit.surface.normal - gradient.normalize()).length() < 1e-9, "{hit:?}");
        assert!((hit.surface.tangent - DVec3::Y).length() < 1e-9, "{hit:?}");
        let inner = Ray { origin: ray.at(hit.t), direction: DVec3::NEG_Z };
        let Way { length, surface, .. } = swatch.way(&hit.place, &[], &inner);
        assert!((length - 0.2 * (1.0 - x * x / 0.16).sqrt()).abs() < 1e-9, "{length}");
        let mirrored = surface.normal * DVec3::new(-1.0, -1.0, 1.0);
        assert!((mirrored - hit.surface.normal).length() < 1e-9);
    }
}

#[test]
fn uneven_cloth_is_met_where_brute_force_says() {
    for spec in [uneven(), mixed()] {
        for size in [[3.5, 1.85], [1.1, 0.4], [8.3, 7.7], [2.0, 12.0]] {
            assert!(compare(&spec, size, 1_500) > 250);
        }
    }
}

#[test]
fn yarns_of_several_kinds_are_met_where_brute_force_says() {
    for size in [[3.5, 1.85], [1.1, 0.4], [8.3, 7.7], [2.0, 12.0]] {
        assert!(compare(&thick_and_thin(), size, 1_500) > 250);
    }
}

#[test]
fn a_set_of_equal_kinds_is_as_one_of_a_single_kind() {
    let one = uneven();
    let mut equal = uneven();
    equal.warp.kinds = vec![one.warp.kinds[0]; 2];
    equal.warp.kind_of = vec![0, 1, 1, 0];
    let [one, equal] = [one, equal].map(|spec| swatch(&spec, [5.0, 6.0]));
    for number in 0..3_000 {
        let ray = random_ray(&mut Sampler::new(16, number, 0), [5.0, 6.0]);
        let found = [&one, &equal].map(|swatch| swatch.nearest(&ray));
        let [one, equal] = found.map(|hit| hit.map(|hit| (hit.t, hit.place.set, hit.place.yarn)));
        assert_eq!(one, equal, "{ray:?}");
    }
}

#[test]
fn more_kinds_of_yarn_near_a_crossing_than_can_be_told_apart_are_refused() {
    let mut spec = cloth([2, 80], |pick, end| (pick + end) % 2 == 0, thin(1, 1.0, 1.0));
    spec.warp.spacing = (0..80).map(|end| if end % 40 == 0 { 20.0 } else { 0.02 }).collect();
    let kind =
        |end: u32| YarnKind { shape: thin(1, 2.0 + 0.01 * f64::from(end), 1.0), stiffness: 1.0 };
    spec.warp.kinds = (0..80).map(kind).collect();
    spec.warp.kind_of = (0..80).collect();
    let error = swatch_of(&spec, [1.0, 1.0]).unwrap_err().to_string();
    assert!(error.contains("at most 64"), "{error}");
}

/// Rays along the axes, where the walk divides by zero.
#[test]
fn rays_along_the_axes_are_met_where_brute_force_says() {
    let (spec, size) = (uneven(), [5.0, 6.0]);
    let (walked, whole) = (swatch(&spec, size), WholeCloth::new(&spec, size));
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    let mut hits = 0;
    for number in 0..3_000 {
        let mut sampler = Sampler::new(12, number, 0);
        let [u, v] = sampler.next_2d();
        let origin = DVec3::new(4.8 * (u - 0.5), 5.8 * (v - 0.5), sampler.next_1d() - 0.5);
        let ray = Ray { origin, direction: axes[number as usize % 6] };
        let leave = (0..2).map(|i| (0.5 * size[i] - origin[i].abs(), i));
        let leave = leave
            .filter(|&(_, i)| ray.direction[i] != 0.0)
            .map(|(_, i)| 0.5 * size[i] - origin[i] * ray.direction[i]);
        let expected = whole.nearest(&ray, 1e-6, leave.fold(f64::INFINITY, f64::min));
        let found = walked.nearest(&ray);
        assert_eq!(
            expected.map(|e| (e.1, e.2)),
            found.map(|h| (h.place.set, h.place.yarn)),
            "{ray:?}"
        );
        if let (Some((t, ..)), Some(hit)) = (expected, found) {
            hits += 1;
            assert!((t - hit.t).abs() < 1e-9, "{ray:?}");
        }
    }
    assert!(hits > 1_000, "{hits}");
}

/// Every way inside plies, against which plies hold points along it: until its end no ply begins, and
/// the one that it is in does not end; beyond it the plies are those that the way says.
#[test]
fn ways_inside_plies_end_where_plies_do_or_others_begin() {
    let (mut ends, mut contacts, mut edges) = (0, 0, 0);
    // A thicker single ply would bend by less than its own radius.
    let rod = plain(thin(1, 0.7, 1.0));
    let thick = plain(thin(12, 1.2, 2.3));
    let oval = satin(pressed(round(5), 1.7));
    // Points lie inside no ribbon.
    let mut thin_between = thick_and_thin();
    thin_between.warp.kind_of[3] = 1;
    for spec in [plain(thin(3, 0.9, 2.1)), oval, uneven(), rod, thick, thin_between] {
        let size = [3.7, 3.2];
        let swatch = swatch(&spec, size);
        let whole = WholeCloth::new(&spec, size);
        for number in 0..1_500 {
            let mut sampler = Sampler::new(13, number, 0);
            let ray = random_ray(&mut sampler, size);
            if !whole.containing(ray.origin).is_empty() {
                continue;
            }
            let Some(hit) = swatch.nearest(&ray) else { continue };
            let mut nest = match swatch.entered(&ray, &hit) {
                Some(sides) => sides.ahead.to_vec(),
                None => vec![hit.place],
            };
            let mut point = ray.at(hit.t);
            let inwards = (ray.direction / 1.5 - 0.5 * hit.surface.normal).normalize();
            let mut direction = inwards;
            // From contact to contact, turned a little at each.
            for _ in 0..6 {
                let inner = Ray { origin: point, direction };
                let (own, others) = nest.split_last().unwrap();
                let way = swatch.way(own, others, &inner);
                let ahead = way.sides.as_ref().map_or(vec![], |sides| sides.ahead.to_vec());
                let step = 1e-5;
                let checked = |t: f64| whole.containing(inner.at(t));
                if way.length > 4.0 * step {
                    let start = checked(step);
                    for u in [0.3, 0.7, 1.0] {
                        let along = checked(step + u * (way.length - 2.0 * step));
                        let new = along.iter().any(|ply| !start.contains(ply));
                        let own =
                            along.iter().filter(|ply| (ply.0, ply.1) == (own.set, own.number()));
                        assert!(!new && own.count() >= 1, "{along:?} {start:?} {way:?} {inner:?}");
                    }
                }
                let beyond = inner.at(way.length + step);
                if (0..2).any(|axis| beyond[axis].abs() > 0.5 * size[axis]) {
                    assert!(ahead.is_empty(), "{way:?} {inner:?}");
                    edges += 1;
                    break;
                }
                let expected = checked(way.length + step);
                // Where plies only just touch, a step on may be another ply already.
                if expected != checked(way.length + 1e-3 * step) {
                    break;
                }
                assert_eq!(expected.len(), ahead.len(), "{expected:?} {way:?} {inner:?}");
                assert!(
                    ahead.iter().all(|place| {
                        expected.iter().any(|ply| (ply.0, ply.1) == (place.set, place.number()))
                    }),
                    "{expected:?} {way:?} {inner:?}"
                );
                if ahead.is_empty() {
                    ends += 1;
                    break;
                }
                contacts += 1;
                (point, nest) = (inner.at(way.length), ahead);
                direction = (direction - 0.3 * way.surface.normal).normalize();
            }
        }
    }
    assert!(ends > 2_000 && contacts > 2_000 && edges > 20, "{ends} {contacts} {edges}");
}

/// The centre lines of plies and ribbons are the relaxed curves, where the pattern says.
#[test]
fn large_swatches_store_no_more_blocks_than_small_ones() {
    for shape in [round(3), flat()] {
        let blocks = |size| swatch(&plain(shape), [size, size]).tile().distinct_blocks();
        assert_eq!(blocks(4000.0), blocks(10.0), "{shape:?}");
    }
}

/// Where a ray starts makes no difference to what it meets, however far away that is.
#[test]
fn far_cameras_see_what_near_ones_see() {
    let swatch = swatch(&plain(thin(3, 0.9, 2.1)), [20.0, 20.0]);
    for number in 0..200_000 {
        let mut sampler = Sampler::new(15, number, 0);
        let [u, v] = sampler.next_2d();
        let target = DVec3::new(16.0 * (u - 0.5), 16.0 * (v - 0.5), 0.0);
        let direction = direction(&mut sampler);
        let direction = direction.with_z(-direction.z.abs() - 0.5).normalize();
        let from = |away: f64| {
            let ray = Ray { origin: target - away * direction, direction };
            swatch.nearest(&ray).map(|hit| hit.t - away)
        };
        match (from(3.0), from(2000.0)) {
            (None, None) => {}
            (Some(near), Some(far)) if (near - far).abs() < 1e-8 => {}
            different => panic!("{different:?} {target} {direction}"),
        }
    }
}

/// Many tiles away the cloth is the same.
#[test]
fn tiles_repeat_all_over_the_swatch() {
    let spec = uneven();
    let [ends, picks] = [&spec.warp, &spec.weft];
    // Yarns repeat, as seen in the direction across them, when those that cross them do.
    let length = |own: &YarnSpec, other: &YarnSpec| {
        let repeats = Twist::new(&other.kinds[0].shape, &own.spacing).repeats(own.spacing.len());
        repeats as f64 * own.spacing.iter().sum::<f64>()
    };
    let repeats = [length(ends, picks), length(picks, ends)];
    let swatch = swatch(&spec, [200.0 * repeats[0], 200.0 * repeats[1]]);
    let mut hits = 0;
    for number in 0..2_000 {
        let mut sampler = Sampler::new(14, number, 0);
        let ray = random_ray(&mut sampler, repeats);
        let [i, j] = sampler.next_2d().map(|u| (180.0 * (u - 0.5)).round());
        let far = DVec3::new(i * repeats[0], j * repeats[1], 0.0);
        let moved = Ray { origin: ray.origin + far, direction: ray.direction };
        let (here, there) = (swatch.nearest(&ray), swatch.nearest(&moved));
        assert_eq!(here.is_some(), there.is_some(), "{ray:?} {far}");
        if let (Some(here), Some(there)) = (here, there) {
            hits += 1;
            assert!((here.t - there.t).abs() < 1e-8, "{ray:?} {far}");
            assert_eq!((here.place.set, here.place.yarn), (there.place.set, there.place.yarn));
            assert!((here.surface.normal - there.surface.normal).length() < 1e-7);
        }
    }
    assert!(hits > 500, "{hits}");
}
