//! The anisotropic GGX distribution of microfacet normals with Smith's masking.
//!
//! Local frame: z is the mean normal, x runs along the fiber. Walter et al. 2007; visible normals
//! after Heitz 2018.

use std::f64::consts::{FRAC_1_PI, TAU};

use glam::DVec3;

use crate::math::dual::{Real, Vector, dot};

/// The widths of the distribution along x and y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ggx<T = f64> {
    /// Along the fiber (x).
    pub along: T,
    /// Across the fiber (y).
    pub across: T,
}

impl<T: Real> Ggx<T> {
    /// D(h): microfacet area per macroscopic area and solid angle of normals around `h` (unit).
    #[inline(always)]
    pub fn density(&self, h: &Vector<T>) -> T {
        let (x, y) = (h[0] / self.along, h[1] / self.across);
        let stretched = x * x + y * y + h[2] * h[2];
        (self.along * self.across * stretched * stretched).recip() * FRAC_1_PI
    }

    /// G1(w): the part of the microfacets facing `w` (unit, either side) that `w` sees.
    #[inline(always)]
    pub fn masking(&self, w: &Vector<T>) -> T {
        let (x, y) = (self.along * w[0], self.across * w[1]);
        let slope2 = (x * x + y * y) / (w[2] * w[2]);
        ((slope2 + 1.0).sqrt() + 1.0).recip() * 2.0
    }

    /// The density of visible normals, by solid angle of `h`: G1(w) D(h) |w.h| / |w_z|.
    #[inline(always)]
    pub fn visible_normal_pdf(&self, w: &Vector<T>, h: &Vector<T>) -> T {
        self.masking(w) * self.density(h) * dot(w, h).abs() / w[2].abs()
    }
}

impl Ggx {
    /// A normal visible from `w` (z > 0), with density [`Ggx::visible_normal_pdf`] (Heitz 2018).
    #[inline(always)]
    pub fn sample_visible_normal(&self, w: DVec3, [u, v]: [f64; 2]) -> DVec3 {
        let stretched = DVec3::new(self.along * w.x, self.across * w.y, w.z).normalize();
        let length2 = stretched.x * stretched.x + stretched.y * stretched.y;
        let first = if length2 > 1e-30 {
            DVec3::new(-stretched.y, stretched.x, 0.0) / length2.sqrt()
        } else {
            DVec3::X
        };
        let second = stretched.cross(first);
        let (sin, cos) = (TAU * v).sin_cos();
        let (p, q) = (u.sqrt() * cos, u.sqrt() * sin);
        let s = 0.5 * (1.0 + stretched.z);
        let q = (1.0 - s) * (1.0 - p * p).max(0.0).sqrt() + s * q;
        let height = (1.0 - p * p - q * q).max(0.0).sqrt();
        let normal = p * first + q * second + height * stretched;
        DVec3::new(self.along * normal.x, self.across * normal.y, normal.z.max(1e-12)).normalize()
    }
}
