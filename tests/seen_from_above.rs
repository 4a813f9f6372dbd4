//! What a swatch shows from above: yarns at their heights, in the order of the drawdown, and how often
//! plies turn.

mod common;

use common::weaves::{swatch, uneven};
use common::whole::quantum;
use common::{cloth, flat, plain};
use glam::DVec3;
use plycloth::accel::ray::Ray;
use plycloth::cloth::spec::{ClothSpec, YarnShape};
use plycloth::cloth::swatch::Swatch;
use plycloth::cloth::yarn_path::YarnSet;
use plycloth::control::Control;
use plycloth::weave::relax::relax;

#[test]
fn yarns_follow_their_relaxed_curves() {
    let mut spec = uneven();
    let thread = YarnShape::round(1e-3, 1, 1e-3, 1.0);
    (spec.warp.kinds[0].shape, spec.weft.kinds[0].shape) = (thread, thread);
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
            let (height, _) = thin.warp.yarn(end).eval((y + 0.5 * size[1]) / unit);
            if hit.place.set == YarnSet::Warp {
                let expected = height * unit + 1e-3;
                assert!(
                    (3.0 - hit.t - expected).abs() < 2.0 * quantum(&spec),
                    "{hit:?} {expected}"
                );
                assert_eq!(hit.place.yarn, end);
            }
        }
        x += 0.5 * spacing;
    }
}

/// A cloth whose spacings all differ, 3 picks and 4 ends.
fn wide(shape: YarnShape) -> ClothSpec {
    let mut spec = cloth([3, 4], |pick, end| (pick + end) % 4 < 2, shape);
    spec.warp.spacing = vec![1.0, 1.2, 1.4, 1.1];
    spec.weft.spacing = vec![1.3, 1.0, 1.5];
    spec
}

/// Seen from above, the yarn on top of each crossing is the one of the drawdown.
fn shows_its_drawdown(spec: &ClothSpec) {
    let size = [2.0 * 4.7, 2.0 * 3.8];
    let swatch = swatch(spec, size);
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
            assert_eq!((hit.place.set, hit.place.yarn), expected, "pick {pick} end {end}");
            x += 0.5 * spec.warp.spacing[end % 4];
        }
        y -= 0.5 * spec.weft.spacing[pick % 3];
    }
}

#[test]
fn the_face_shows_the_drawdown_with_the_first_pick_at_the_top() {
    shows_its_drawdown(&wide(flat()));
}

/// However thin the yarns are.
#[test]
fn thin_yarns_lie_in_the_order_of_the_drawdown() {
    let round = |radius| YarnShape::round(radius, 1, radius, 1.0);
    let flat = |thickness| YarnShape::Flat { width: 0.9, thickness };
    for radius in [1e-3, 4e-4, 1e-5, 1e-7] {
        let (thread, ribbon) = (round(radius), flat(2.0 * radius));
        for (warp, weft) in [(thread, thread), (ribbon, ribbon), (thread, ribbon), (ribbon, thread)]
        {
            println!("{warp:?} {weft:?}");
            let mut spec = wide(warp);
            spec.weft.kinds[0].shape = weft;
            shows_its_drawdown(&spec);
        }
    }
}

/// Times that a ply comes to the top of the end at x = 0.5, seen along its middle.
fn tops(swatch: &Swatch, length: f64) -> usize {
    let (mut count, mut was_top) = (0, true);
    let steps = (200.0 * length) as u32;
    for step in 0..steps {
        let y = length * ((f64::from(step) + 0.5) / f64::from(steps) - 0.5);
        let ray = Ray { origin: DVec3::new(0.5, y, 3.0), direction: DVec3::NEG_Z };
        let hit = swatch.nearest(&ray);
        if hit.is_some_and(|hit| hit.place.set == YarnSet::Weft) {
            continue;
        }
        // Between two plies the ray falls through, or on another at the bottom.
        let is_top = hit.is_some_and(|hit| hit.t < 3.0);
        count += usize::from(is_top && !was_top);
        was_top = is_top;
    }
    count
}

#[test]
fn plies_turn_as_often_as_their_pitch_says() {
    let length = 600.0;
    let thread = YarnShape::round(1e-3, 1, 1e-3, 1.0);
    for plies in [2, 3, 5] {
        for pitch in [0.9, 2.0, -3.3, 6.6, 8.25, 23.0, 50.0] {
            let mut spec = plain(thread);
            spec.warp.kinds[0].shape = YarnShape::round(0.2, plies, 0.03, pitch);
            let counted = tops(&swatch(&spec, [4.0, length]), length) as f64;
            let expected = plies as f64 * length / pitch.abs();
            let off = (counted - expected).abs();
            assert!(off <= 0.02 * expected + 1.5, "{plies} {pitch}: {counted} {expected}");
        }
    }
}
