//! A flat swatch of cloth: one tile of blocks, repeated within a rectangle.
//!
//! Memory is that of the tile, whatever the size of the swatch; a ray costs as many block visits as
//! its stretch inside the cloth crosses.

use std::sync::Arc;

use glam::DVec3;

use super::block::{Piece, SurfacePoint};
use super::grid::{Located, walk};
use super::tile::{Place, Tile};
use crate::accel::ray::Ray;
use crate::math::extremes::{greater, greater3, lesser, lesser3};

/// A swatch, ready for rays.
#[derive(Debug)]
pub struct Swatch {
    pub(super) tile: Arc<Tile>,
    pub(super) size: [f64; 2],
}

/// A place where a ray enters a yarn.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// The distance along the ray.
    pub t: f64,
    /// Of which yarn.
    pub place: Place,
    /// The surface, seen from where the ray comes from.
    pub surface: SurfacePoint,
    /// Whether the yarn is entered by a cut end.
    pub(super) cut: bool,
}

/// The stretch of a ray inside the swatch.
pub(super) struct Clipped {
    /// It, in the grid's coordinates.
    pub ray: Ray,
    /// Of its direction.
    pub inverse: DVec3,
    /// Where along the whole ray it starts; the other distances are measured from there.
    pub start: f64,
    /// The least distance of a hit.
    pub t_min: f64,
    /// Its length.
    pub t_max: f64,
    /// The axis (0 or 1) across which the swatch's edge cuts it off, if one does.
    pub cut: Option<usize>,
}

impl Swatch {
    /// A piece of a cloth, `size` millimetres wide and high.
    pub fn new(tile: Arc<Tile>, size: [f64; 2]) -> Self {
        Self { tile, size }
    }

    /// The cloth that it is of.
    #[inline]
    pub fn tile(&self) -> &Tile {
        &self.tile
    }

    /// The nearest yarn that the ray enters from outside, by its surface or by a cut end.
    #[inline]
    pub fn nearest(&self, ray: &Ray) -> Option<Hit> {
        let clipped = self.clip(ray, f64::INFINITY)?;
        let Clipped { ray, inverse, start, t_min, t_max, cut } = clipped;
        if let Some(axis) = cut
            && let Some(end) = self.cut_end(&ray, axis)
        {
            return Some(Hit { t: start, ..end });
        }
        let (at, piece, t) = walk(&self.tile.axes, &ray, inverse, t_max, |visit| {
            let (plan, corner) = self.tile.visited(&visit);
            let (t_enter, t_leave) =
                (visit.t_enter - self.tile.t_min, visit.t_leave + self.tile.t_min);
            let local = ray.shifted(corner);
            let hit =
                self.tile.block(plan).nearest(&local, inverse, greater(t_enter, t_min), t_leave);
            hit.map(|(piece, t)| (visit.at, piece, t))
        })?;
        Some(Hit { t: start + t, ..self.hit(&ray, &at, piece, t) })
    }

    /// What the ray (in the grid's coordinates) hits at distance `t`.
    #[inline(always)]
    pub(super) fn hit(&self, ray: &Ray, at: &[Located; 2], piece: Piece, t: f64) -> Hit {
        let (place, surface) = self.tile.entered(ray, at, piece, t);
        Hit { t, place, surface, cut: false }
    }

    /// Whether the ray enters any yarn before `t_max`.
    #[inline]
    pub fn occluded(&self, ray: &Ray, t_max: f64) -> bool {
        let Some(clipped) = self.clip(ray, t_max) else { return false };
        let Clipped { ray, inverse, t_min, t_max, cut, .. } = clipped;
        if cut.is_some_and(|axis| self.cut_end(&ray, axis).is_some()) {
            return true;
        }
        let found = walk(&self.tile.axes, &ray, inverse, t_max, |visit| {
            let (plan, corner) = self.tile.visited(&visit);
            let (t_enter, t_leave) =
                (visit.t_enter - self.tile.t_min, visit.t_leave + self.tile.t_min);
            let (t_enter, t_leave) = (greater(t_enter, t_min), lesser(t_leave, t_max));
            self.tile.block(plan).any(&ray.shifted(corner), inverse, t_enter, t_leave).then_some(())
        });
        found.is_some()
    }

    /// The stretch of the ray inside the swatch, if any. It starts there, since what a far camera
    /// sees would suffer from rounding.
    #[inline(always)]
    fn clip(&self, ray: &Ray, t_max: f64) -> Option<Clipped> {
        let ray = self.to_grid(ray);
        let inverse = ray.inverse();
        let [width, height] = self.size;
        let low = (DVec3::new(0.0, -height, self.tile.heights[0]) - ray.origin) * inverse;
        let high = (DVec3::new(width, 0.0, self.tile.heights[1]) - ray.origin) * inverse;
        let (enter, leave) = (lesser3(low, high), greater3(low, high));
        let start = greater(greater(enter.x, enter.y), greater(enter.z, 0.0));
        let end = lesser(lesser(leave.x, leave.y), lesser(leave.z, t_max));
        let cut = if enter.x > enter.y { 0 } else { 1 };
        (start < end).then(|| Clipped {
            ray: Ray { origin: ray.at(start), ..ray },
            inverse,
            start,
            t_min: self.tile.t_min - start,
            t_max: end - start,
            cut: (start > 0.0 && enter[cut] == start).then_some(cut),
        })
    }

    /// Grid coordinates have their origin at the swatch's top left corner.
    #[inline]
    pub(super) fn to_grid(&self, ray: &Ray) -> Ray {
        ray.shifted(DVec3::new(-0.5 * self.size[0], 0.5 * self.size[1], 0.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::relaxed_cloth::RelaxedCloth;
    use crate::cloth::spec::{ClothSpec, YarnShape, YarnSpec};
    use crate::control::Control;
    use crate::weave::pattern::WeavePattern;

    fn twill() -> RelaxedCloth {
        let shape = YarnShape::round(0.4, 3, 0.18, 3.0);
        let yarns = || YarnSpec::uniform(shape, 1.0, vec![1.0; 4]);
        let warp_up = (0..16).map(|index| (index / 4 + index % 4) % 4 < 2).collect();
        let spec = ClothSpec {
            pattern: WeavePattern::new(4, 4, warp_up).unwrap(),
            warp: yarns(),
            weft: yarns(),
            collision_stiffness: 100.0,
        };
        RelaxedCloth::new(&spec, &Control::default()).unwrap()
    }

    /// What rays from above meet, at many places.
    fn hits(swatch: &Swatch) -> Vec<Option<(f64, DVec3, i64)>> {
        let ray = |index: u32| {
            let place = f64::from(index);
            let origin = DVec3::new(3.9 * (0.7 * place).sin(), 3.9 * (1.3 * place).cos(), 5.0);
            let direction = DVec3::new(0.2 * place.sin(), 0.3 * place.cos(), -1.0).normalize();
            Ray { origin, direction }
        };
        let hit = |hit: Hit| (hit.t, hit.surface.normal, hit.place.number());
        (0..2000).map(|index| swatch.nearest(&ray(index)).map(hit)).collect()
    }

    #[test]
    fn blocks_that_there_is_no_room_for_are_the_same() {
        let kept = twill().swatch([8.0, 8.0]).unwrap();
        let lent = Arc::into_inner(twill().swatch([8.0, 8.0]).unwrap().tile).unwrap();
        let lent = Swatch::new(Arc::new(lent.keeping_none()), [8.0, 8.0]);
        let expected = hits(&kept);
        assert!(expected.iter().flatten().count() > 1000);
        assert!(hits(&lent) == expected);
    }

    #[test]
    fn swatches_of_one_cloth_share_a_tile_as_long_as_one_is_left() {
        let cloth = twill();
        let [one, other] = [[40.0, 40.0], [39.0, 37.0]].map(|size| cloth.swatch(size).unwrap());
        assert!(Arc::ptr_eq(&one.tile, &other.tile));
        let tile = Arc::downgrade(&one.tile);
        drop((one, other));
        assert!(tile.upgrade().is_none());
    }
}
