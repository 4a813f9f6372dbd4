//! Cloths of many kinds, and rays to look at them.

use glam::DVec3;
use plycloth::accel::ray::Ray;
use plycloth::cloth::spec::{ClothSpec, YarnKind, YarnShape, YarnSpec};
use plycloth::cloth::swatch::Swatch;
use plycloth::math::rng::Sampler;

use super::rays::direction;
use super::{cloth, flat, round, swatch_of};

/// The swatch of a cloth.
pub fn swatch(spec: &ClothSpec, size: [f64; 2]) -> Swatch {
    swatch_of(spec, size).unwrap()
}

/// A warp-faced twill: `over` over, `under` under.
pub fn twill(over: usize, under: usize, shape: YarnShape) -> ClothSpec {
    let n = over + under;
    cloth([n, n], |pick, end| (end + n - pick) % n < over, shape)
}

/// A satin of five.
pub fn satin(shape: YarnShape) -> ClothSpec {
    cloth([5, 5], |pick, end| end != (2 * pick) % 5, shape)
}

/// A yarn of `plies` that fits between others which are `spacing` apart.
pub fn thin(plies: usize, spacing: f64, pitch: f64) -> YarnShape {
    let YarnShape::Round { radius, ply_radius, .. } = round(plies) else { unreachable!() };
    YarnShape::round(spacing * radius, plies, spacing * ply_radius, pitch)
}

/// Two ribbons and three plies, all spacings different, 3 picks and 4 ends.
pub fn uneven() -> ClothSpec {
    let mut spec = cloth([3, 4], |pick, end| (pick + end) % 3 == 0, thin(3, 0.6, -1.9));
    spec.warp.spacing = vec![0.9, 0.7, 1.3, 0.6];
    spec.weft.spacing = vec![0.5, 0.8, 0.55];
    spec.weft.kinds[0].shape = thin(2, 0.5, 0.8);
    spec
}

/// The same yarn, `aspect` times wider than high.
pub fn pressed(shape: YarnShape, aspect: f64) -> YarnShape {
    let mut pressed = shape;
    if let YarnShape::Round { radius, thickness, collision, .. } = &mut pressed {
        *thickness = 2.0 * *radius / aspect;
        *collision = *radius / aspect;
    }
    pressed
}

/// Presses all yarns of one direction.
pub fn press(yarns: &mut YarnSpec, aspect: f64) {
    for kind in &mut yarns.kinds {
        kind.shape = pressed(kind.shape, aspect);
    }
}

/// Thick, thin and flat yarns in one set, thick and thin ones of other aspects in the other.
pub fn thick_and_thin() -> ClothSpec {
    let kind = |shape| YarnKind { shape, stiffness: 1.0 };
    let mut spec = uneven();
    let ribbon = YarnShape::Flat { width: 0.5, thickness: 0.1 };
    spec.warp.kinds = [thin(3, 0.6, -1.9), thin(1, 0.25, 1.0), ribbon].map(kind).to_vec();
    spec.warp.kind_of = vec![0, 1, 0, 2];
    spec.weft.kinds = [pressed(thin(2, 0.5, 0.8), 1.6), thin(4, 0.4, 1.3)].map(kind).to_vec();
    spec.weft.kind_of = vec![1, 0, 0];
    spec
}

/// A twill of ribbons over round yarns.
pub fn mixed() -> ClothSpec {
    let mut spec = twill(2, 1, flat());
    spec.weft.kinds[0].shape = thin(4, 0.5, 1.7);
    spec.weft.spacing = vec![0.6; 3];
    spec
}

/// Rays from above and below, some from far away, and from between the yarns.
pub fn random_ray(sampler: &mut Sampler, size: [f64; 2]) -> Ray {
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
