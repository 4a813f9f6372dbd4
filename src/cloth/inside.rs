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
pub type Nest = SmallVec<[Place; 4]>;

/// The plies on both sides of a place where a ray passes from inside some to inside others.
#[derive(Debug, Clone, Default)]
pub struct Sides {
    /// Those that it comes from the inside of.
    pub behind: Nest,
    /// Those that it goes into.
    pub ahead: Nest,
}

impl Sides {
    /// The same for a ray that turns back.
    pub fn reversed(&self) -> Self {
        Self { behind: self.ahead.clone(), ahead: self.behind.clone() }
    }
}

/// The end of a ray's way inside a ply.
#[derive(Debug, Clone)]
pub struct Way {
    /// Its length.
    pub length: f64,
    /// The surface there, seen from where the ray comes from.
    pub surface: SurfacePoint,
    /// The plies there; `None` if it comes out into the open.
    pub sides: Option<Box<Sides>>,
}

impl Swatch {
    /// The plies around what lies beyond `hit` by `ray`, which came through the open, if they are
    /// more than the one hit.
    #[inline]
    pub fn entered(&self, ray: &Ray, hit: &Hit) -> Option<Box<Sides>> {
        if !hit.cut {
            return None;
        }
        let ahead = self.nest_at(self.to_grid(ray).at(hit.t));
        (ahead.len() > 1).then(|| Box::new(Sides { behind: Nest::new(), ahead }))
    }

    /// The way of a ray that starts inside the ply of `place`, and inside `others`.
    ///
    /// It ends at that ply's own surface or cut end, or at the surface of another ply, whichever comes
    /// first. The cost grows with the number of blocks that it crosses.
    #[inline]
    pub fn way(&self, place: &Place, others: &[Place], ray: &Ray) -> Way {
        let ray = self.to_grid(ray);
        let (place, length, crowded) = self.leave(place, &ray);
        let edge = if self.holds(ray.at(length)) { f64::INFINITY } else { self.edge(&ray) };
        if (crowded || !others.is_empty())
            && let Some(way) = self.way_into(&place, others, &ray, [length, edge])
        {
            return way;
        }
        let end = lesser(length, edge);
        let local = ray.shifted(place.corner);
        let mut surface = self.block(place.plan).surface(place.piece, &local, end);
        surface.normal =
            if length < edge { -surface.normal } else { -self.edge_normal(&ray, edge) };
        Way { length: end, surface, sides: None }
    }

    /// The same, if it ends inside other plies; `place` is where the ray leaves its own.
    #[inline(never)]
    fn way_into(
        &self,
        place: &Place,
        others: &[Place],
        ray: &Ray,
        [length, edge]: [f64; 2],
    ) -> Option<Way> {
        let entered = self.other(place, ray, lesser(length, edge));
        let end = entered.map_or(length, |hit| hit.t);
        if end > edge {
            return None;
        }
        let reach = others.iter().map(|other| self.leave(other, ray));
        let mut behind: Nest = reach.filter(|way| way.1 > end).map(|way| way.0).collect();
        let mut ahead = behind.clone();
        behind.push(*place);
        let surface = if let Some(hit) = entered {
            ahead.push(*place);
            ahead.push(hit.place);
            hit.surface
        } else {
            let local = ray.shifted(place.corner);
            let surface = self.block(place.plan).surface(place.piece, &local, end);
            SurfacePoint { normal: -surface.normal, ..surface }
        };
        let inside = !ahead.is_empty();
        inside.then(|| Way { length: end, surface, sides: Some(Box::new(Sides { behind, ahead })) })
    }

    /// Where the ray leaves the ply of `place`, in which it starts, the distance, and whether other
    /// plies may reach into the way.
    #[inline]
    fn leave(&self, place: &Place, ray: &Ray) -> (Place, f64, bool) {
        let (mut place, mut t, mut crowded) = (*place, 0.0, false);
        loop {
            let stretch = self.block(place.plan).leave(place.piece, &ray.shifted(place.corner), t);
            let ended = Place { piece: stretch.piece, ..place };
            crowded |= stretch.crowded;
            let Stretch { t: end, out, .. } = stretch;
            // A ply goes on in the block there.
            match if out { None } else { self.continued(&ended, ray.at(end)) } {
                Some(next) => (place, t) = (next, end),
                None => return (ended, end, crowded),
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

    /// Whether a point lies over the swatch.
    #[inline]
    fn holds(&self, point: DVec3) -> bool {
        let [width, height] = self.size;
        (point.x > 0.0) & (point.x < width) & (point.y > -height) & (point.y < 0.0)
    }

    /// How far away the swatch's edge is, seen from inside.
    #[cold]
    fn edge(&self, ray: &Ray) -> f64 {
        let far = |(low, high, axis): (f64, f64, usize)| {
            let side = if ray.direction[axis] > 0.0 { high } else { low };
            (side - ray.origin[axis]) / ray.direction[axis]
        };
        let [width, height] = self.size;
        // NaN, from a ray along an edge, loses.
        [(0.0, width, 0), (-height, 0.0, 1)].map(far).into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The outward normal of the edge that a ray leaves by at distance `t`.
    #[cold]
    fn edge_normal(&self, ray: &Ray, t: f64) -> DVec3 {
        let (point, [width, height]) = (ray.at(t), self.size);
        let beside = |axis: usize, low: f64, high: f64| {
            (point[axis] - low).abs().min((point[axis] - high).abs())
        };
        let axis =
            if beside(0, 0.0, width) < beside(1, -height, 0.0) { DVec3::X } else { DVec3::Y };
        axis * axis.dot(ray.direction).signum()
    }

    /// The cut end that a ray meets which comes in by the swatch's edge across `axis`.
    #[cold]
    pub(super) fn cut_end(&self, ray: &Ray, axis: usize) -> Option<Hit> {
        let place = *self.nest_at(ray.origin).last()?;
        let local = ray.shifted(place.corner);
        let SurfacePoint { tangent, .. } = self.block(place.plan).surface(place.piece, &local, 0.0);
        let normal = -DVec3::AXES[axis] * ray.direction[axis].signum();
        Some(Hit { t: 0.0, place, surface: SurfacePoint { normal, tangent }, cut: true })
    }

    /// The plies around a point, in the grid's coordinates.
    fn nest_at(&self, point: DVec3) -> Nest {
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
