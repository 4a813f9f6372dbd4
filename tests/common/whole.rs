//! A whole cloth without blocks: every yarn from edge to edge, and a loop over all its segments.

use plycloth::accel::bilinear::Bilinear;
use plycloth::accel::cylinder::Cylinder;
use plycloth::accel::ray::Ray;
use plycloth::cloth::spec::{ClothSpec, YarnShape, YarnSpec};
use plycloth::cloth::twist::{Twist, common_multiple};
use plycloth::cloth::yarn_path::{YarnPath, YarnSet};
use plycloth::control::Control;
use plycloth::weave::curve::HeightCurve;
use plycloth::weave::relax::relax;

/// The rounding of heights and slopes that the swatch documents: 1/1024, halved until it is at most a
/// sixteenth of the thinner yarns' radius.
pub fn quantum(spec: &ClothSpec) -> f64 {
    let radii = spec.warp.shapes().chain(spec.weft.shapes()).map(|shape| match *shape {
        YarnShape::Round { radius, .. } => radius,
        YarnShape::Flat { thickness, .. } => 0.5 * thickness,
    });
    let least = radii.fold(f64::INFINITY, f64::min) / spec.unit();
    (10..).map(|power| 0.5_f64.powi(power)).find(|quantum| 16.0 * quantum <= least).unwrap()
}

pub enum Piece {
    Cylinder(Cylinder),
    Patch(Bilinear),
}

impl Piece {
    fn enter(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<f64> {
        match self {
            Self::Cylinder(cylinder) => cylinder.enter(ray, t_min, t_max),
            Self::Patch(patch) => patch.intersect(ray, t_min, t_max),
        }
    }
}

/// All pieces of a swatch, each with its yarn: the set and the number in the pattern (picks counted
/// from the bottom). They lie where the yarns of their set are round.
pub struct WholeCloth {
    pub pieces: Vec<(YarnSet, usize, Piece)>,
    /// Of each piece, the number of its yarn through all repeats and that of its ply.
    numbers: Vec<(i64, usize)>,
    /// How many times wider than high the yarns of the pattern are.
    aspects: [Vec<f64>; 2],
    size: [f64; 2],
}

/// Yarns side by side along one axis, without end; yarn 0 starts at the swatch's top left corner.
struct Row<'a> {
    spacing: &'a [f64],
}

impl Row<'_> {
    fn index(&self, yarn: i64) -> usize {
        yarn.rem_euclid(self.spacing.len() as i64) as usize
    }

    fn slot(&self, yarn: i64) -> f64 {
        self.spacing[self.index(yarn)]
    }

    /// Where the slot of `yarn` starts if that of yarn 0 starts at 0.
    fn start(&self, yarn: i64) -> f64 {
        if yarn >= 0 {
            (0..yarn).map(|i| self.slot(i)).sum()
        } else {
            -(yarn..0).map(|i| self.slot(i)).sum::<f64>()
        }
    }

    /// How many yarns cover `length`.
    fn covering(&self, length: f64) -> i64 {
        (1..).find(|&yarn| self.start(yarn) >= length).unwrap()
    }
}

impl WholeCloth {
    pub fn new(spec: &ClothSpec, size: [f64; 2]) -> Self {
        let spec = spec.bottom_up();
        let relaxed = relax(&spec.relax_problem(), &Control::default()).unwrap();
        let ends = Row { spacing: &spec.warp.spacing };
        let picks = Row { spacing: &spec.weft.spacing };
        // Beyond the edges, enough yarns for all that reaches into the swatch.
        let around = 4;
        let columns = -around..ends.covering(size[0]) + around;
        let rows = -picks.covering(size[1]) - around..around;
        let (unit, quantum) = (spec.unit(), quantum(&spec));
        let (mut pieces, mut numbers) = (Vec::new(), Vec::new());
        let mut add =
            |set, yarn: i64, (own, crossing): (&Row, &Row), range: &std::ops::Range<i64>| {
                let (curves, yarns, phase_offset) = match set {
                    YarnSet::Warp => (&relaxed.warp, &spec.warp, turned(&spec, size[1])),
                    YarnSet::Weft => (&relaxed.weft, &spec.weft, 0),
                };
                let kind = yarns.kind_of[own.index(yarn)] as usize;
                let shape = yarns.kinds[kind].shape;
                let aspect = aspect(shape);
                let twist = twists(yarns, crossing.spacing)[kind];
                let path = YarnPath {
                    set,
                    kind,
                    offset: (own.start(yarn) + 0.5 * own.slot(yarn)) / aspect,
                    start: crossing.start(range.start),
                    slots: range.clone().map(|i| crossing.slot(i)).collect(),
                    knots: knots(&curves.yarn(own.index(yarn)), range, unit, quantum),
                    phase: twist.phase(range.start + phase_offset),
                };
                for (ply, piece) in shapes(&path, round(shape), twist) {
                    pieces.push((set, own.index(yarn), piece));
                    numbers.push((yarn, ply));
                }
            };
        for end in columns.clone() {
            add(YarnSet::Warp, end, (&ends, &picks), &rows);
        }
        for pick in rows.clone() {
            add(YarnSet::Weft, pick, (&picks, &ends), &columns);
        }
        let aspects = [&spec.warp, &spec.weft].map(|yarns| {
            (0..yarns.spacing.len()).map(|yarn| aspect(yarns.kind(yarn).shape)).collect()
        });
        Self { pieces, numbers, aspects, size }
    }

    /// The stretch of `ray` above the swatch's rectangle.
    pub fn stretch(&self, ray: &Ray) -> (f64, f64) {
        let slab = |axis: usize| {
            let half = 0.5 * self.size[axis];
            let at = |side: f64| (side * half - ray.origin[axis]) / ray.direction[axis];
            (at(1.0).min(at(-1.0)), at(1.0).max(at(-1.0)))
        };
        let (x, y) = (slab(0), slab(1));
        (x.0.max(y.0), x.1.min(y.1))
    }

    /// All entries within (`t_min`, `t_max`): distance, set and yarn.
    pub fn entries(
        &self,
        ray: &Ray,
        t_min: f64,
        t_max: f64,
    ) -> impl Iterator<Item = (f64, YarnSet, usize)> {
        let corner = glam::DVec3::new(-0.5 * self.size[0], 0.5 * self.size[1], 0.0);
        let ray = ray.shifted(corner);
        self.pieces.iter().filter_map(move |(set, yarn, piece)| {
            // Where the yarns are round: with a unit direction, in the lengths of that space.
            let narrow = self.narrow(*set, *yarn);
            let length = (narrow * ray.direction).length();
            let direction = narrow * ray.direction / length;
            let ray = Ray { origin: narrow * ray.origin, direction };
            let t = piece.enter(&ray, t_min * length, t_max * length)?;
            Some((t / length, *set, *yarn))
        })
    }

    /// What takes points to where a yarn of the pattern is round.
    fn narrow(&self, set: YarnSet, yarn: usize) -> glam::DMat3 {
        let across = 1.0 / self.aspects[set as usize][yarn];
        match set {
            YarnSet::Warp => glam::DMat3::from_diagonal([across, 1.0, 1.0].into()),
            YarnSet::Weft => glam::DMat3::from_diagonal([1.0, across, 1.0].into()),
        }
    }

    /// The plies around a point, each once: set, number of the yarn through all repeats, ply.
    pub fn containing(&self, point: glam::DVec3) -> Vec<(YarnSet, i64, usize)> {
        let point = point + glam::DVec3::new(0.5 * self.size[0], -0.5 * self.size[1], 0.0);
        let inside = |set: YarnSet, yarn: usize, piece: &Piece| match piece {
            Piece::Cylinder(cylinder) => cylinder.contains(self.narrow(set, yarn) * point),
            Piece::Patch(_) => false,
        };
        let pieces = self.pieces.iter().zip(&self.numbers);
        let mut found: Vec<_> = pieces
            .filter(|((set, yarn, piece), _)| inside(*set, *yarn, piece))
            .map(|((set, ..), (yarn, ply))| (*set, *yarn, *ply))
            .collect();
        found.sort_by_key(|(set, yarn, ply)| (*set as usize, *yarn, *ply));
        found.dedup();
        found
    }

    /// The nearest of [`WholeCloth::entries`].
    pub fn nearest(&self, ray: &Ray, t_min: f64, t_max: f64) -> Option<(f64, YarnSet, usize)> {
        self.entries(ray, t_min, t_max).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

/// How many picks up from the top edge the ends' twist counts from: a swatch of less than a whole
/// tile counts from the bottom of the patterns that cover it.
fn turned(spec: &ClothSpec, height: f64) -> i64 {
    let picks = spec.weft.spacing.len();
    let repeat: f64 = spec.weft.spacing.iter().sum();
    let repeats = twists(&spec.warp, &spec.weft.spacing).into_iter().map(|t| t.repeats(picks));
    let whole = repeats.fold(1, common_multiple);
    let covering = (height / repeat).ceil() as usize;
    (picks * covering.min(whole)) as i64
}

/// Of each kind of yarn, how it twists.
fn twists(yarns: &YarnSpec, spacing: &[f64]) -> Vec<Twist> {
    let shapes: Vec<_> = yarns.shapes().copied().collect();
    Twist::together(&shapes, spacing)
}

/// How many times wider than high a yarn is.
fn aspect(shape: YarnShape) -> f64 {
    match shape {
        YarnShape::Round { radius, thickness, .. } => radius / (0.5 * thickness),
        YarnShape::Flat { .. } => 1.0,
    }
}

/// The yarn where it is round.
fn round(mut shape: YarnShape) -> YarnShape {
    let aspect = aspect(shape);
    if let YarnShape::Round { radius, ply_radius, .. } = &mut shape {
        *radius /= aspect;
        *ply_radius /= aspect;
    }
    shape
}

/// Rounded heights and slopes at the start and the middle of each slot, and at the end.
fn knots(
    curve: &HeightCurve,
    range: &std::ops::Range<i64>,
    unit: f64,
    quantum: f64,
) -> Vec<(f64, f64)> {
    let round = |value: f64| (value / quantum).round() * quantum;
    (2 * range.start..=2 * range.end)
        .map(|knot| {
            let i = knot.rem_euclid(curve.knots.len() as i64) as usize;
            (round(curve.height[i]) * unit, round(curve.slope[i]))
        })
        .collect()
}

/// The pieces of a yarn, each with the number of its ply.
fn shapes(path: &YarnPath, shape: YarnShape, twist: Twist) -> impl Iterator<Item = (usize, Piece)> {
    let pieces: Vec<_> = match shape {
        YarnShape::Round { plies, ply_radius, .. } => {
            let cylinder = |j: &[_]| Piece::Cylinder(Cylinder::new(j[0], j[1], ply_radius));
            let all = path.plies(&shape, plies, twist).into_iter().enumerate();
            all.flat_map(|(ply, joints)| {
                joints.windows(2).map(|j| (ply, cylinder(j))).collect::<Vec<_>>()
            })
            .collect()
        }
        YarnShape::Flat { width, .. } => {
            let edges = path.ribbon(width);
            edges.windows(2).map(|e| (0, Piece::Patch(Bilinear::new(e[0], e[1])))).collect()
        }
    };
    pieces.into_iter()
}
