//! What a cloth is made of, in millimetres.

use crate::error::{Error, Result, check_range};
use crate::weave::pattern::WeavePattern;
use crate::weave::problem::{RelaxProblem, YarnData};

/// The cross section of a yarn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum YarnShape {
    /// Twisted plies with circular cross sections, which may be pressed flat: then the yarn is that
    /// of radius thickness / 2, stretched along its width.
    Round {
        /// Half the width of the whole yarn.
        radius: f64,
        /// The height of its cross section, at most twice the radius.
        thickness: f64,
        /// R of Eq. 3: how far the yarn keeps from others at a crossing.
        collision: f64,
        /// How many plies, 1 to 12.
        plies: usize,
        /// The radius of each ply, along the yarn's width.
        ply_radius: f64,
        /// The length of a turn of the plies; positive for a right-handed helix.
        pitch: f64,
    },
    /// A ribbon.
    Flat {
        /// Its width.
        width: f64,
        /// Its thickness, which keeps crossing ribbons apart.
        thickness: f64,
    },
}

impl YarnShape {
    /// Whether it is flat.
    pub fn is_ribbon(&self) -> bool {
        matches!(self, Self::Flat { .. })
    }

    /// A yarn of that radius, not pressed.
    pub fn round(radius: f64, plies: usize, ply_radius: f64, pitch: f64) -> Self {
        let (thickness, collision) = (2.0 * radius, radius);
        Self::Round { radius, thickness, collision, plies, ply_radius, pitch }
    }

    /// How many times wider than high a pressed yarn is; 1 for others.
    pub fn aspect(&self) -> f64 {
        match *self {
            Self::Round { radius, thickness, .. } => 2.0 * radius / thickness,
            Self::Flat { .. } => 1.0,
        }
    }

    /// The yarn before it was pressed: as high, but round.
    pub fn unpressed(&self) -> Self {
        match *self {
            Self::Round { thickness, collision, plies, ply_radius, pitch, .. } => Self::Round {
                radius: 0.5 * thickness,
                thickness,
                collision,
                plies,
                ply_radius: ply_radius / self.aspect(),
                pitch,
            },
            flat @ Self::Flat { .. } => flat,
        }
    }

    /// The distance of the ply centres from the yarn's centre, along its width.
    pub fn helix_radius(&self) -> f64 {
        match *self {
            Self::Round { radius, plies, ply_radius, .. } if plies > 1 => radius - ply_radius,
            _ => 0.0,
        }
    }

    /// The height of the cross section.
    pub fn thickness(&self) -> f64 {
        match *self {
            Self::Round { thickness, .. } | Self::Flat { thickness, .. } => thickness,
        }
    }

    /// Half of the yarn's extent in the plane of the cloth.
    pub fn half_width(&self) -> f64 {
        match *self {
            Self::Round { radius, .. } => radius,
            Self::Flat { width, .. } => 0.5 * width,
        }
    }

    /// The radius with which the yarn collides with others.
    pub fn collision_radius(&self) -> f64 {
        match *self {
            Self::Round { collision, .. } => collision,
            Self::Flat { thickness, .. } => 0.5 * thickness,
        }
    }

    /// How far the yarn's surface is from its centre line at most.
    pub fn reach(&self) -> f64 {
        match *self {
            Self::Round { ply_radius, .. } => self.helix_radius() + ply_radius,
            Self::Flat { width, .. } => 0.5 * width,
        }
    }

    fn check(&self, name: &str) -> Result<()> {
        let positive = |field: &str, value| {
            check_range(&format!("{name}.{field}"), value, f64::MIN_POSITIVE, f64::MAX).map(drop)
        };
        match *self {
            Self::Round { radius, thickness, collision, plies, ply_radius, pitch } => {
                positive("collision_radius_mm", collision)?;
                positive("radius_mm", radius)?;
                positive("thickness_mm", thickness)?;
                check_range(&format!("{name}.thickness_mm"), thickness, 0.0, 2.0 * radius)?;
                positive("ply_radius_mm", ply_radius)?;
                positive("pitch_mm", pitch.abs())?;
                check_range(&format!("{name}.plies"), plies as f64, 1.0, 12.0)?;
                check_range(&format!("{name}.ply_radius_mm"), ply_radius, 0.0, radius).map(drop)
            }
            Self::Flat { width, thickness } => {
                positive("width_mm", width)?;
                positive("thickness_mm", thickness)
            }
        }
    }
}

/// A kind of yarn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YarnKind {
    /// Its cross section.
    pub shape: YarnShape,
    /// Its stiffness in the relaxation.
    pub stiffness: f64,
}

/// The yarns of one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct YarnSpec {
    /// The different kinds, at least one.
    pub kinds: Vec<YarnKind>,
    /// Of each yarn the number of its kind.
    pub kind_of: Vec<u32>,
    /// The width of each yarn's slot, across the yarn.
    pub spacing: Vec<f64>,
}

impl YarnSpec {
    /// Yarns of one kind, with these slots.
    pub fn uniform(shape: YarnShape, stiffness: f64, spacing: Vec<f64>) -> Self {
        let kind_of = vec![0; spacing.len()];
        Self { kinds: vec![YarnKind { shape, stiffness }], kind_of, spacing }
    }

    /// The kind of a yarn.
    pub fn kind(&self, yarn: usize) -> &YarnKind {
        &self.kinds[self.kind_of[yarn] as usize]
    }

    /// The cross sections of the kinds.
    pub fn shapes(&self) -> impl Iterator<Item = &YarnShape> {
        self.kinds.iter().map(|kind| &kind.shape)
    }

    /// Whether a kind is a ribbon.
    pub fn has_ribbons(&self) -> bool {
        self.shapes().any(YarnShape::is_ribbon)
    }

    /// Whether ribbons and others lie side by side.
    pub fn mixes_ribbons(&self) -> bool {
        self.has_ribbons() && !self.shapes().all(YarnShape::is_ribbon)
    }

    /// The greatest of what `measure` says of the kinds.
    pub fn greatest(&self, measure: impl Fn(&YarnShape) -> f64) -> f64 {
        self.shapes().map(measure).fold(f64::NEG_INFINITY, f64::max)
    }

    /// The least of it.
    pub fn least(&self, measure: impl Fn(&YarnShape) -> f64) -> f64 {
        self.shapes().map(measure).fold(f64::INFINITY, f64::min)
    }

    fn check(&self, name: &str, count: usize) -> Result<()> {
        let rows = [("spacing_mm", self.spacing.len()), ("yarns", self.kind_of.len())];
        if let Some((field, rows)) = rows.into_iter().find(|(_, rows)| *rows != count) {
            let problem = format!("has {rows} values for {count} yarns");
            return Err(Error::invalid(format!("{name}_{field}"), problem));
        }
        if self.kind_of.iter().any(|&kind| kind as usize >= self.kinds.len()) {
            let problem = format!("names a yarn beyond the {} there are", self.kinds.len());
            return Err(Error::invalid(format!("{name}_yarns"), problem));
        }
        self.shapes().try_for_each(|shape| shape.check(name))
    }
}

/// A woven cloth: ends run along y, picks along x, the first pick at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct ClothSpec {
    /// The weave.
    pub pattern: WeavePattern,
    /// The ends.
    pub warp: YarnSpec,
    /// The picks.
    pub weft: YarnSpec,
    /// The collision coefficient k_c of Eq. 3.
    pub collision_stiffness: f64,
}

impl ClothSpec {
    /// Passes the description on if every number in it makes sense.
    pub fn checked(self) -> Result<Self> {
        self.warp.check("warp", self.pattern.ends)?;
        self.weft.check("weft", self.pattern.picks)?;
        Ok(self)
    }

    /// The unit of weave space: the spacing, averaged over ends and picks.
    pub fn unit(&self) -> f64 {
        let mean =
            |yarns: &YarnSpec| yarns.spacing.iter().sum::<f64>() / yarns.spacing.len() as f64;
        0.5 * (mean(&self.warp) + mean(&self.weft))
    }

    /// R_A + R_B of Eq. 3 where both are the thickest.
    pub fn contact(&self) -> f64 {
        [&self.warp, &self.weft]
            .map(|yarns| yarns.greatest(YarnShape::collision_radius))
            .iter()
            .sum()
    }

    /// The thickness of the thinnest yarn.
    pub fn thinnest(&self) -> f64 {
        self.warp.least(YarnShape::thickness).min(self.weft.least(YarnShape::thickness))
    }

    /// The same cloth with its picks counted from the bottom, as they lie along y.
    pub fn bottom_up(&self) -> Self {
        let WeavePattern { picks, ends, ref warp_up } = self.pattern;
        let warp_up = warp_up.chunks_exact(ends).rev().collect::<Vec<_>>().concat();
        let mut weft = self.weft.clone();
        weft.spacing.reverse();
        weft.kind_of.reverse();
        let pattern = WeavePattern { picks, ends, warp_up };
        Self { pattern, weft, warp: self.warp.clone(), ..*self }
    }

    /// The relaxation of this cloth, in units of [`ClothSpec::unit`].
    pub fn relax_problem(&self) -> RelaxProblem {
        let unit = self.unit();
        let set = |yarns: &YarnSpec| {
            let each = |value: fn(&YarnKind) -> f64| {
                (0..yarns.spacing.len()).map(move |yarn| value(yarns.kind(yarn)))
            };
            YarnData {
                radius: each(|kind| kind.shape.collision_radius()).map(|r| r / unit).collect(),
                stiffness: each(|kind| kind.stiffness).collect(),
                spacing: yarns.spacing.iter().map(|spacing| spacing / unit).collect(),
            }
        };
        RelaxProblem {
            pattern: self.pattern.clone(),
            warp: set(&self.warp),
            weft: set(&self.weft),
            collision_stiffness: self.collision_stiffness,
        }
    }
}
