//! Rays inside plies: to where they leave them, or meet another ply that reaches in.
//!
//! Plies that bend around each other overlap a little. A ray inside one of them goes on in the other
//! as soon as it meets the other's surface, so that none can be passed unseen. All plies around a
//! point are remembered, the one that the ray is in last: when it leaves that, it may still be inside
//! another.

use glam::DVec3;
use smallvec::SmallVec;

use super::block::{Stretch, SurfacePoint};
use super::grid::{Located, walk};
use super::swatch::{Hit, Place, Swatch};
use crate::accel::ray::Ray;
use crate::math::extremes::{greater, lesser};

/// The plies that a point lies inside of, the one that a ray is in last; in the open if none.
pub type Nest = SmallVec<[Place; 2]>;

/// The end of a ray's way inside a ply.
#[derive(Debug, Clone)]
pub struct Way {
    /// Its length.
    pub length: f64,
    /// The surface there, seen from where the ray comes from.
    pub surface: SurfacePoint,
    /// The plies around the end of the way.
    pub behind: Nest,
    /// The plies around what lies beyond: none if that is the open.
    pub ahead: Nest,
}

impl Swatch {
    /// The plies around what lies beyond `hit` by `ray`, which came through the air.
    #[inline]
    pub fn entered(&self, ray: &Ray, hit: &Hit) -> Nest {
        if hit.cut {
            self.nest_at(self.to_grid(ray).at(hit.t))
        } else {
            Nest::from_slice(&[hit.place])
        }
    }

    /// The way of a ray that starts inside `nest` (one ply at least) and is in the last of it.
    ///
    /// It ends at that ply's own surface or cut end, or at the surface of another ply, whichever comes
    /// first. The cost grows with the number of blocks that it crosses.
    #[inline]
    pub fn way(&self, nest: &Nest, ray: &Ray) -> Way {
        let ray = self.to_grid(ray);
        let (current, others) = nest.split_last().expect("a ray inside plies is inside one");
        let (place, length) = self.leave(current, &ray);
        let edge = self.edge(&ray);
        let entered = self.other(&place, &ray, lesser(length, edge));
        let end = entered.map_or(length, |hit| hit.t);
        let mut behind = Nest::new();
        if end <= edge {
            let reach = others.iter().map(|other| self.leave(other, &ray));
            behind.extend(reach.filter(|&(_, t)| t > end).map(|(other, _)| other));
        }
        let mut ahead = behind.clone();
        behind.push(place);
        if let Some(hit) = entered {
            ahead = behind.clone();
            ahead.push(hit.place);
            return Way { length: end, surface: hit.surface, behind, ahead };
        }
        let length = lesser(length, edge);
        let mut surface =
            self.block(place.plan).surface(place.piece, &ray.shifted(place.corner), length);
        surface.normal = if length < edge {
            -surface.normal
        } else {
            -self.edge_normal(ray.at(edge), ray.direction)
        };
        Way { length, surface, behind, ahead }
    }

    /// Where the ray leaves the ply of `place`, in which it starts: the place and the distance.
    #[inline]
    fn leave(&self, place: &Place, ray: &Ray) -> (Place, f64) {
        let (mut place, mut t) = (*place, 0.0);
        loop {
            let stretch = self.block(place.plan).leave(place.piece, &ray.shifted(place.corner), t);
            let Stretch { piece, t: end, out } = stretch;
            let ended = Place { piece, ..place };
            // A ply goes on in the block there.
            match if out { None } else { self.continued(&ended, ray.at(end)) } {
                Some(next) => (place, t) = (next, end),
                None => return (ended, end),
            }
        }
    }

    /// The ply of `place` in the block at `point`, unless that is the one it is in.
    #[cold]
    fn continued(&self, place: &Place, point: DVec3) -> Option<Place> {
        let (own, along) = (place.set as usize, 1 - place.set as usize);
        let mut center = place.corner;
        center[own] += self.block(place.plan).strand(place.piece).offset;
        center[along] = point[along];
        let at = [0, 1].map(|axis| self.axes[axis].at(center[axis]));
        let (_, corner) = self.plan_at(&at);
        if corner == place.corner { None } else { self.same_ply(place, &at) }
    }

    /// The ply of `place` in another block, if it reaches into that.
    fn same_ply(&self, place: &Place, at: &[Located; 2]) -> Option<Place> {
        let (plan, corner) = self.plan_at(at);
        let own = place.set as usize;
        let yarn = i32::try_from(place.number - self.first_number(own, &at[own])).ok()?;
        let joint = self.block(place.plan).joint(place.piece)? + place.corner - corner;
        let piece = self.block(plan).piece_with(place.set, yarn, joint)?;
        Some(Place { plan, piece, corner, ..*place })
    }

    /// The nearest surface of another ply that the ray enters before `t_max`.
    #[inline]
    fn other(&self, own: &Place, ray: &Ray, t_max: f64) -> Option<Hit> {
        let inverse = ray.inverse();
        let (visit, piece, t) = walk(&self.axes, ray, inverse, t_max, |visit| {
            let (plan, corner) = self.visited(&visit);
            let same =
                if corner == own.corner { Some(*own) } else { self.same_ply(own, &visit.at) };
            let (t_enter, t_leave) = (visit.t_enter - self.t_min, visit.t_leave + self.t_min);
            let span = [greater(t_enter, self.t_min), lesser(t_leave, t_max)];
            let same = same.map(|place| place.piece);
            let hit = self.block(plan).nearest_other(same, &ray.shifted(corner), inverse, span);
            hit.map(|(piece, t)| (visit, piece, t))
        })?;
        Some(self.hit(ray, &visit, piece, t))
    }

    /// How far away the swatch's edge is, seen from inside.
    #[inline]
    fn edge(&self, ray: &Ray) -> f64 {
        let [width, height] = self.size;
        let far = |low: f64, high: f64, axis: usize| {
            let side = if ray.direction[axis] > 0.0 { high } else { low };
            (side - ray.origin[axis]) / ray.direction[axis]
        };
        // NaN, from a ray along an edge, loses.
        lesser(
            lesser(far(0.0, width, 0), f64::INFINITY),
            lesser(far(-height, 0.0, 1), f64::INFINITY),
        )
    }

    /// The outward normal of the edge at a `point` of it that a ray in the given direction leaves by.
    #[cold]
    fn edge_normal(&self, point: DVec3, direction: DVec3) -> DVec3 {
        let [width, height] = self.size;
        let beside = |axis: usize, low: f64, high: f64| {
            (point[axis] - low).abs().min((point[axis] - high).abs())
        };
        let axis =
            if beside(0, 0.0, width) < beside(1, -height, 0.0) { DVec3::X } else { DVec3::Y };
        axis * axis.dot(direction).signum()
    }

    /// The cut end that a ray meets which comes in by the swatch's edge across `axis`.
    #[cold]
    pub(super) fn cut_end(&self, ray: &Ray, axis: usize) -> Option<Hit> {
        let place = *self.nest_at(ray.origin).last()?;
        let block = self.block(place.plan);
        let SurfacePoint { tangent, .. } =
            block.surface(place.piece, &ray.shifted(place.corner), 0.0);
        let normal = -DVec3::AXES[axis] * ray.direction[axis].signum();
        Some(Hit { t: 0.0, place, surface: SurfacePoint { normal, tangent }, cut: true })
    }

    /// The plies around a point, in the grid's coordinates.
    pub(super) fn nest_at(&self, point: DVec3) -> Nest {
        // On the swatch's edge the block inside counts.
        let [width, height] = self.size;
        let within = [
            point.x.clamp(self.t_min, width - self.t_min),
            point.y.clamp(self.t_min - height, -self.t_min),
        ];
        let at = [0, 1].map(|axis| self.axes[axis].at(within[axis]));
        let (plan, corner) = self.plan_at(&at);
        let pieces = self.block(plan).containing(point - corner);
        pieces.into_iter().map(|piece| self.place(&at, plan, corner, piece)).collect()
    }
}
