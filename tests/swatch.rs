//! The walk over shared blocks against a loop over all segments of the whole cloth.

mod common;

use common::rays::direction;
use common::whole::{QUANTUM, WholeCloth};
use common::{cloth, flat, plain, round};
use glam::DVec3;
use plycloth::accel::ray::Ray;
use plycloth::cloth::spec::{ClothSpec, YarnShape};
use plycloth::cloth::swatch::Swatch;
use plycloth::cloth::yarn_path::YarnSet;
use plycloth::control::Control;
use plycloth::math::rng::Sampler;
use plycloth::weave::relax::relax;

fn swatch(spec: &ClothSpec, size: [f64; 2]) -> Swatch {
    Swatch::new(spec, size, &Control::default()).unwrap()
}

/// A warp-faced twill: `over` over, `under` under.
fn twill(over: usize, under: usize, shape: YarnShape) -> ClothSpec {
    let n = over + under;
    cloth([n, n], |pick, end| (end + n - pick) % n < over, shape)
}

fn satin(shape: YarnShape) -> ClothSpec {
    cloth([5, 5], |pick, end| end != (2 * pick) % 5, shape)
}

/// A yarn of `plies` that fits between others which are `spacing` apart.
fn thin(plies: usize, spacing: f64, pitch: f64) -> YarnShape {
    let YarnShape::Round { radius, ply_radius, .. } = round(plies) else { unreachable!() };
    YarnShape::round(spacing * radius, plies, spacing * ply_radius, pitch)
}

/// Two ribbons and three plies, all spacings different, 3 picks and 4 ends.
fn uneven() -> ClothSpec {
    let mut spec = cloth([3, 4], |pick, end| (pick + end) % 3 == 0, thin(3, 0.6, -1.9));
    spec.warp.spacing = vec![0.9, 0.7, 1.3, 0.6];
    spec.weft.spacing = vec![0.5, 0.8, 0.55];
    spec.weft.shape = thin(2, 0.5, 0.8);
    spec
}

/// The same yarn, `aspect` times wider than high.
fn pressed(shape: YarnShape, aspect: f64) -> YarnShape {
    let mut pressed = shape;
    if let YarnShape::Round { radius, thickness, collision, .. } = &mut pressed {
        *thickness = 2.0 * *radius / aspect;
        *collision = *radius / aspect;
    }
    pressed
}

fn mixed() -> ClothSpec {
    let mut spec = twill(2, 1, flat());
    spec.weft.shape = thin(4, 0.5, 1.7);
    spec.weft.spacing = vec![0.6; 3];
    spec
}

/// Rays from above and below, some from far away, and from between the yarns.
fn random_ray(sampler: &mut Sampler, size: [f64; 2]) -> Ray {
    let place = |sampler: &mut Sampler, z: f64| {
        let [u, v] = sampler.next_2d();
        DVec3::new((u - 0.5) * size[0], (v - 0.5) * size[1], z)
    };
    let height = 1.6 * sampler.next_1d() - 0.8;
    let target = place(sampler, height);
    let direction = direction(sampler);
    let away = match (sampler.next_1d() * 4.0) as u32 {
        0 | 1 => 0.0,
        2 => 10.0,
        _ => 1000.0,
    };
    Ray { origin: target - away * direction, direction }
}

/// Compares swatch and whole cloth along `count` random rays, and answers how many hit.
fn compare(spec: &ClothSpec, size: [f64; 2], count: u64) -> usize {
    let (walked, whole) = (swatch(spec, size), WholeCloth::new(spec, size));
    let unit = spec.unit();
    let mut hits = 0;
    for number in 0..count {
        let mut sampler = Sampler::new(11, number, 0);
        let ray = random_ray(&mut sampler, size);
        let (enter, leave) = whole.stretch(&ray);
        let expected = whole.nearest(&ray, enter.max(1e-6 * unit), leave);
        let found = walked.nearest(&ray);
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
        assert_eq!((set, yarn), (hit.set, hit.yarn), "{place}");
        assert!(walked.occluded(&ray, f64::INFINITY), "{place}");
        assert!(walked.occluded(&ray, t + 1e-5) && !walked.occluded(&ray, t - 1e-5), "{place}");
    }
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
    two_aspects.warp.shape = pressed(two_aspects.warp.shape, 1.6);
    two_aspects.weft.shape = pressed(two_aspects.weft.shape, 2.5);
    let mut with_ribbons = mixed();
    with_ribbons.weft.shape = pressed(with_ribbons.weft.shape, 3.0);
    let mut one_set = satin(thin(2, 1.0, -2.7));
    one_set.warp.shape = pressed(one_set.warp.shape, 4.0);
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
    spec.weft.shape = YarnShape::Flat { width: 0.1, thickness: 1e-3 };
    let swatch = swatch(&spec, [1.0, 1.0]);
    for step in 0..50 {
        let x = 0.39 * (f64::from(step) / 25.0 - 1.0);
        let ray = Ray { origin: DVec3::new(x, 0.1, 3.0), direction: DVec3::NEG_Z };
        let hit = swatch.nearest(&ray).unwrap();
        let gradient = DVec3::new(x / 0.16, 0.0, 0.1 * (1.0 - x * x / 0.16).sqrt() / 0.01);
        assert!((hit.surface.normal - gradient.normalize()).length() < 1e-9, "{hit:?}");
        assert!((hit.surface.tangent - DVec3::Y).length() < 1e-9, "{hit:?}");
        let inner = Ray { origin: ray.at(hit.t), direction: DVec3::NEG_Z };
        let (length, surface) = swatch.leave(&hit, &inner);
        assert!((length - 0.2 * (1.0 - x * x / 0.16).sqrt()).abs() < 1e-9, "{length}");
        assert!((surface.normal * DVec3::new(1.0, 1.0, -1.0) - hit.surface.normal).length() < 1e-9);
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
        assert_eq!(expected.map(|e| (e.1, e.2)), found.map(|h| (h.set, h.yarn)), "{ray:?}");
        if let (Some((t, ..)), Some(hit)) = (expected, found) {
            hits += 1;
            assert!((t - hit.t).abs() < 1e-9, "{ray:?}");
        }
    }
    assert!(hits > 1_000, "{hits}");
}

/// A ray that enters a ply and is turned inwards comes out on the surface of the same ply.
#[test]
fn what_enters_a_ply_leaves_it_on_its_surface() {
    let mut exits = 0;
    for spec in [plain(thin(3, 0.9, 2.1)), satin(pressed(round(5), 1.7)), uneven()] {
        let swatch = swatch(&spec, [6.0, 6.0]);
        let whole = WholeCloth::new(&spec, [6.0, 6.0]);
        for number in 0..3_000 {
            let mut sampler = Sampler::new(13, number, 0);
            let ray = random_ray(&mut sampler, [5.0, 5.0]);
            let Some(hit) = swatch.nearest(&ray) else { continue };
            let direction = (ray.direction / 1.5 - 0.5 * hit.surface.normal).normalize();
            let inner = Ray { origin: ray.at(hit.t), direction };
            let (length, surface) = swatch.leave(&hit, &inner);
            assert!(direction.dot(surface.normal) > -0.2, "{surface:?} {direction}");
            // Back along the same line the yarn is entered where it was left.
            let back = Ray { origin: inner.at(length + 1e-4), direction: -direction };
            let mut entries = whole.entries(&back, 0.0, 2e-4);
            let same = entries.any(|(t, set, yarn)| {
                (set, yarn) == (hit.set, hit.yarn) && (t - 1e-4).abs() < 1e-9
            });
            assert!(same, "no exit after {length} {inner:?}");
            exits += 1;
            let again = swatch.nearest(&Ray { origin: inner.at(length), direction });
            assert!(again.is_none_or(|again| again.t > 1e-6), "{again:?}");
        }
    }
    assert!(exits > 3_000, "{exits}");
}

/// The centre lines of plies and ribbons are the relaxed curves, where the pattern says.
#[test]
fn yarns_follow_their_relaxed_curves() {
    let mut spec = uneven();
    let thread = YarnShape::round(1e-3, 1, 1e-3, 1.0);
    (spec.warp.shape, spec.weft.shape) = (thread, thread);
    let thin = relax(&spec.bottom_up().relax_problem(), &Control::default()).unwrap();
    let size = [2.0 * 3.5, 2.0 * 1.85];
    let swatch = swatch(&spec, size);
    let unit = spec.unit();
    let mut x = -0.5 * size[0];
    for (end, spacing) in spec.warp.spacing.iter().enumerate() {
        x += 0.5 * spacing;
        for step in 0..100 {
            let y = (f64::from(step) / 100.0 - 0.5) * size[1];
            let ray = Ray { origin: DVec3::new(x, y, 3.0), direction: DVec3::NEG_Z };
            let hit = swatch.nearest(&ray).unwrap();
            let (height, _) = thin.warp[end].eval((y + 0.5 * size[1]) / unit);
            if hit.set == YarnSet::Warp {
                let expected = height * unit + 1e-3;
                assert!((3.0 - hit.t - expected).abs() < 2.0 * QUANTUM, "{hit:?} {expected}");
                assert_eq!(hit.yarn, end);
            }
        }
        x += 0.5 * spacing;
    }
}

/// Seen from above, the yarn on top of each crossing is the one of the drawdown.
#[test]
fn the_face_shows_the_drawdown_with_the_first_pick_at_the_top() {
    let mut spec = cloth([3, 4], |pick, end| (pick + end) % 4 < 2, flat());
    spec.warp.spacing = vec![1.0, 1.2, 1.4, 1.1];
    spec.weft.spacing = vec![1.3, 1.0, 1.5];
    let size = [2.0 * 4.7, 2.0 * 3.8];
    let swatch = swatch(&spec, size);
    let mut y = 0.5 * size[1];
    for pick in 0..6 {
        y -= 0.5 * spec.weft.spacing[pick % 3];
        let mut x = -0.5 * size[0];
        for end in 0..8 {
            x += 0.5 * spec.warp.spacing[end % 4];
            let ray = Ray { origin: DVec3::new(x, y, 5.0), direction: DVec3::NEG_Z };
            let hit = swatch.nearest(&ray).unwrap();
            let up = spec.pattern.is_warp_up(pick % 3, end % 4);
            let expected =
                if up { (YarnSet::Warp, end % 4) } else { (YarnSet::Weft, 2 - pick % 3) };
            assert_eq!((hit.set, hit.yarn), expected, "pick {pick} end {end}");
            x += 0.5 * spec.warp.spacing[end % 4];
        }
        y -= 0.5 * spec.weft.spacing[pick % 3];
    }
}

#[test]
fn large_swatches_store_no_more_blocks_than_small_ones() {
    for shape in [round(3), flat()] {
        let blocks = |size| swatch(&plain(shape), [size, size]).distinct_blocks();
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
    let repeats = [8.0 * 3.5, 8.0 * 1.85];
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
            assert_eq!((here.set, here.yarn), (there.set, there.yarn));
            assert!((here.surface.normal - there.surface.normal).length() < 1e-7);
        }
    }
    assert!(hits > 500, "{hits}");
}
