//! Rays inside plies: to where they leave them, or meet another ply that reaches in.
//!
//! Plies that bend around each other overlap a little. A ray inside one of them goes on in the other
//! as soon as it meets the other's surface, so that none can be passed unseen. All plies around a
//! point are remembered, the one that the ray is in last: when it leaves that, it may still be inside
//! another.

use glam::DVec3;
use smallvec::SmallVec;

use super::block::{Block, End, Piece, Stretch, SurfacePoint};
use super::grid::{Located, walk};
use super::swatch::{Hit, Swatch};
use super::tile::Place;
use crate::accel::ray::Ray;
use crate::math::extremes::{greater, lesser};
use crate::math::frame::Frame;

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
    #[cold]
    pub fn reversed(&self) -> Box<Self> {
        Box::new(Self { behind: self.ahead.clone(), ahead: self.behind.clone() })
    }
}

/// Where a ray inside a ply leaves it.
struct Leaving {
    /// The last piece that it passes.
    place: Place,
    /// The distance.
    t: f64,
    /// The piece of another ply in the same block that it enters there, if that ends the way.
    met: Option<Piece>,
    /// Whether all other plies are known that reach into the way.
    surveyed: bool,
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
    #[inline(always)]
    pub fn entered(&self, ray: &Ray, hit: &Hit) -> Option<Box<Sides>> {
        if hit.cut { self.entered_by_cut(ray, hit) } else { None }
    }

    #[cold]
    fn entered_by_cut(&self, ray: &Ray, hit: &Hit) -> Option<Box<Sides>> {
        let ahead = self.nest_at(self.to_grid(ray).at(hit.t));
        (ahead.len() > 1).then(|| Box::new(Sides { behind: Nest::new(), ahead }))
    }

    /// The way of a ray that starts inside the ply of `place`, and inside `others`.
    ///
    /// It ends at that ply's own surface or cut end, or at the surface of another ply, whichever comes
    /// first. The cost grows with the number of pieces that it passes.
    #[inline]
    pub fn way(&self, place: &Place, others: &[Place], ray: &Ray) -> Way {
        let ray = self.to_grid(ray);
        let pass =
            |block: &Block, piece, local: &Ray, t| block.pass(piece, local, t, self.tile.t_min);
        let left = self.follow(place, &ray, pass);
        let alone = left.surveyed && left.met.is_none() && others.is_empty();
        if !alone || !self.holds(ray.at(left.t)) {
            return self.way_into(&left, others, &ray);
        }
        Way { length: left.t, surface: self.wall(&left.place, &ray, left.t), sides: None }
    }

    /// The same, if other plies are around, or the swatch ends.
    #[inline(never)]
    fn way_into(&self, left: &Leaving, others: &[Place], ray: &Ray) -> Way {
        let Leaving { place, t, met, surveyed } = *left;
        let known = met.map(|piece| self.contact(&place, piece, ray, t));
        let entered = if surveyed { known } else { self.other(&place, ray, t).or(known) };
        let end = entered.map_or(t, |hit| hit.t);
        if !self.holds(ray.at(end)) {
            let edge = self.edge(ray);
            return Way { length: edge, surface: self.cap(&place, ray, edge), sides: None };
        }
        let still = |other: &Place| {
            let left = self.leave(other, ray);
            (left.t > end).then_some(left.place)
        };
        let mut behind: Nest = others.iter().filter_map(still).collect();
        let mut ahead = behind.clone();
        behind.push(place);
        if let Some(hit) = entered {
            ahead.extend([place, hit.place]);
        }
        let surface = entered.map_or_else(|| self.wall(&place, ray, end), |hit| hit.surface);
        let sides = (!ahead.is_empty()).then(|| Box::new(Sides { behind, ahead }));
        Way { length: end, surface, sides }
    }

    /// The wall of the ply of `place` that the ray leaves by at distance `t`, seen from inside.
    #[inline(always)]
    fn wall(&self, place: &Place, ray: &Ray, t: f64) -> SurfacePoint {
        let local = ray.shifted(place.corner);
        let surface = self.tile.block(place.plan).surface(place.piece, &local, t);
        SurfacePoint { normal: -surface.normal, ..surface }
    }

    /// Where the ray leaves the ply of `place`, in which it starts.
    fn leave(&self, place: &Place, ray: &Ray) -> Leaving {
        self.follow(place, ray, |block, piece, local, t| block.leave(piece, local, t))
    }

    /// Follows a ply from block to block by `stretch`.
    #[inline(always)]
    fn follow(
        &self,
        place: &Place,
        ray: &Ray,
        stretch: impl Fn(&Block, Piece, &Ray, f64) -> Stretch,
    ) -> Leaving {
        let (mut place, mut start, mut all_surveyed) = (*place, 0.0, true);
        loop {
            let local = ray.shifted(place.corner);
            let Stretch { piece, t, end, surveyed } =
                stretch(&self.tile.block(place.plan), place.piece, &local, start);
            all_surveyed &= surveyed;
            place.piece = piece;
            let met = match end {
                End::Wall => None,
                End::Other(other) => Some(other),
                End::Open => match self.continued(&place, ray.at(t)) {
                    Some(next) => {
                        (place, start) = (next, t);
                        continue;
                    }
                    None => None,
                },
            };
            return Leaving { place, t, met, surveyed: all_surveyed };
        }
    }

    /// Where a ray inside the ply of `place` meets a piece of another in the same block.
    fn contact(&self, place: &Place, other: Piece, ray: &Ray, t: f64) -> Hit {
        let at = [0, 1].map(|axis| self.tile.axes[axis].at(place.corner[axis] + self.tile.t_min));
        self.hit(ray, &at, other, t)
    }

    /// The ply of `place` in the block at `point`, unless that is the one it is in.
    #[cold]
    fn continued(&self, place: &Place, point: DVec3) -> Option<Place> {
        let (own, along) = (place.set as usize, 1 - place.set as usize);
        let mut center = place.corner;
        center[own] += self.tile.block(place.plan).strand(place.piece).offset;
        center[along] = point[along];
        let at = [0, 1].map(|axis| self.tile.axes[axis].at(center[axis]));
        let (_, corner) = self.tile.plan_at(&at);
        if corner == place.corner { None } else { self.same_ply(place, &at) }
    }

    /// The ply of `place` in another block, if it reaches into that.
    fn same_ply(&self, place: &Place, at: &[Located; 2]) -> Option<Place> {
        let (plan, corner) = self.tile.plan_at(at);
        let own = place.set as usize;
        let yarn = i32::try_from(place.number - self.tile.first_number(own, &at[own])).ok()?;
        let joint = self.tile.block(place.plan).joint(place.piece)? + place.corner - corner;
        let piece = self.tile.block(plan).piece_with(place.set, yarn, joint)?;
        Some(Place { plan, piece, corner, ..*place })
    }

    /// The nearest surface of another ply that the ray enters before `t_max`.
    #[inline]
    fn other(&self, own: &Place, ray: &Ray, t_max: f64) -> Option<Hit> {
        let inverse = ray.inverse();
        let (visit, piece, t) = walk(&self.tile.axes, ray, inverse, t_max, |visit| {
            let (plan, corner) = self.tile.visited(&visit);
            let same =
                if corner == own.corner { Some(*own) } else { self.same_ply(own, &visit.at) };
            let (t_enter, t_leave) =
                (visit.t_enter - self.tile.t_min, visit.t_leave + self.tile.t_min);
            let span = [greater(t_enter, self.tile.t_min), lesser(t_leave, t_max)];
            let same = same.map(|place| place.piece);
            let hit =
                self.tile.block(plan).nearest_other(same, &ray.shifted(corner), inverse, span);
            hit.map(|(piece, t)| (visit, piece, t))
        })?;
        Some(self.hit(ray, &visit.at, piece, t))
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
        // NaN, from a ray along an edge, loses; rounding may put a cut end a little outside.
        let edges = [(0.0, width, 0), (-height, 0.0, 1)].map(far);
        edges.into_iter().fold(f64::INFINITY, f64::min).max(0.0)
    }

    /// The cut end of the ply of `place` that a ray leaves by at distance `t`.
    #[cold]
    fn cap(&self, place: &Place, ray: &Ray, t: f64) -> SurfacePoint {
        let (point, [width, height]) = (ray.at(t), self.size);
        let beside = |axis: usize, low: f64, high: f64| {
            (point[axis] - low).abs().min((point[axis] - high).abs())
        };
        let axis =
            if beside(0, 0.0, width) < beside(1, -height, 0.0) { DVec3::X } else { DVec3::Y };
        self.cut_surface(place, ray, t, axis)
    }

    /// A cut end across an axis, seen from where the ray comes from.
    #[cold]
    fn cut_surface(&self, place: &Place, ray: &Ray, t: f64, axis: DVec3) -> SurfacePoint {
        let normal = -axis * axis.dot(ray.direction).signum();
        let local = ray.shifted(place.corner);
        let along = self.tile.block(place.plan).surface(place.piece, &local, t).tangent;
        // The fibers stand on it, more or less.
        SurfacePoint { normal, tangent: Frame::new(normal, along).tangent() }
    }

    /// The cut end that a ray meets which comes in by the swatch's edge across `axis`.
    #[cold]
    pub(super) fn cut_end(&self, ray: &Ray, axis: usize) -> Option<Hit> {
        let place = *self.nest_at(ray.origin).last()?;
        let surface = self.cut_surface(&place, ray, 0.0, DVec3::AXES[axis]);
        Some(Hit { t: 0.0, place, surface, cut: true })
    }

    /// The plies around a point, in the grid's coordinates.
    fn nest_at(&self, point: DVec3) -> Nest {
        // On the swatch's edge the block inside counts.
        let [width, height] = self.size;
        let within = [
            point.x.clamp(self.tile.t_min, width - self.tile.t_min),
            point.y.clamp(self.tile.t_min - height, -self.tile.t_min),
        ];
        let at = [0, 1].map(|axis| self.tile.axes[axis].at(within[axis]));
        let (plan, corner) = self.tile.plan_at(&at);
        let block = self.tile.block(plan);
        let place = |piece| self.tile.place(&at, block.strand(piece), plan, corner, piece);
        block.containing(point - corner).into_iter().map(place).collect()
    }
}
