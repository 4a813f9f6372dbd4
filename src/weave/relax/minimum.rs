//! The least energy of one layer: Newton's method over the heights at its crossings.

use super::common_mode::CommonMode;
use super::components::Layer;
use super::contact::Contacts;
use super::field::Field;
use super::line_search;
use super::newton_system::{NewtonSystem, Step};
use super::strain::Strain;
use crate::control::Control;
use crate::error::Result;
use crate::weave::problem::{RelaxProblem, YarnData};

/// Newton steps after which the relaxation is given up.
pub(super) const ITERATIONS: u64 = 1000;
/// Relative residual of the linear solve for a step, far from the minimum and close to it: while
/// contacts still open and close, an accurate step is wasted.
const LOOSEST_STEP: f64 = 0.1;
const FINEST_STEP: f64 = 1e-4;
/// Decrease that the last step promised, relative to the energy.
const ENERGY_TOLERANCE: f64 = 1e-16;
/// What the linear solve may leave ungained of a negligible decrease.
const CG_MARGIN: f64 = 1e-6;
/// Energy per crossing, relative to the collision stiffness, that counts as none: contact ratios
/// within 1e-11 of 1.
const ENERGY_FLOOR: f64 = 1e-21;

/// The relaxation of a layer: everything that stays the same from step to step.
pub(super) struct Relaxation {
    pub warp_strain: Strain,
    pub weft_strain: Strain,
    contacts: Contacts,
    common_mode: CommonMode,
}

/// Where a relaxation ended.
pub(super) struct Minimum {
    pub heights: Field,
    /// Newton steps taken.
    pub iterations: u64,
    /// Whether it is one.
    pub found: bool,
}

impl Relaxation {
    pub fn new(problem: &RelaxProblem, layer: &Layer) -> Self {
        let strain = |yarns: &YarnData, own: &[usize], crossed: &YarnData, of: &[usize]| {
            let stiffness = own.iter().map(|&yarn| yarns.stiffness[yarn]).collect();
            Strain::new(stiffness, &crossed.spacing, of)
        };
        let (warp, weft) = (&problem.warp, &problem.weft);
        let warp_strain = strain(warp, &layer.ends, weft, &layer.picks);
        let weft_strain = strain(weft, &layer.picks, warp, &layer.ends);
        let common_mode = CommonMode::new(&warp_strain, &weft_strain);
        Self { warp_strain, weft_strain, contacts: Contacts::new(problem, layer), common_mode }
    }

    /// Goes from `heights`, or from touching yarns, to the minimum; `progress` is told which part of
    /// the way is done, by the decades that are left of the decrease.
    pub fn run(
        &self,
        collision_stiffness: f64,
        heights: Option<Field>,
        control: &Control,
        mut progress: impl FnMut(f64),
    ) -> Result<Minimum> {
        let floor = ENERGY_FLOOR * collision_stiffness * self.contacts.count() as f64;
        let mut heights = heights.unwrap_or_else(|| self.start());
        let mut tolerance = LOOSEST_STEP;
        for iteration in 1..=ITERATIONS {
            let (energy, descent, system) = self.at(&heights);
            let negligible = ENERGY_TOLERANCE * energy + floor;
            let Step { change, decrease } =
                system.solve(descent, tolerance, CG_MARGIN * negligible, control)?;
            if !decrease.is_finite() || !energy.is_finite() {
                return Ok(Minimum { heights, iterations: iteration, found: false });
            }
            self.advance(&mut heights, &change, -decrease);
            progress((decrease / energy).ln() / (negligible / energy).ln());
            if decrease <= negligible {
                return Ok(Minimum { heights, iterations: iteration, found: true });
            }
            tolerance = (decrease / energy).sqrt().clamp(FINEST_STEP, LOOSEST_STEP);
        }
        Ok(Minimum { heights, iterations: ITERATIONS, found: false })
    }

    /// Touching yarns, scaled towards the plane to the least energy.
    fn start(&self) -> Field {
        let mut heights = self.contacts.touching();
        let mut flat = heights.clone();
        flat.scale(-1.0);
        let (_, descent, _) = self.at(&heights);
        let slope = -descent.dot(&flat);
        drop(descent);
        self.advance(&mut heights, &flat, slope);
        heights
    }

    /// The energy, its negative gradient, and its second derivative.
    fn at(&self, heights: &Field) -> (f64, Field, NewtonSystem<'_>) {
        let ratios = self.contacts.ratios(heights);
        let mut forces = self.strain_forces(heights);
        let energy = heights.dot(&forces) / 2.0 + self.contacts.energy(&ratios);
        let system = NewtonSystem {
            warp_strain: &self.warp_strain,
            weft_strain: &self.weft_strain,
            common_mode: &self.common_mode,
            contacts: &self.contacts,
            curvatures: self.contacts.curvatures(&ratios),
        };
        let collisions = self.contacts.forces(ratios);
        forces.add_opposed(&collisions, self.contacts.picks, self.contacts.ends);
        forces.scale(-1.0);
        (energy, forces, system)
    }

    fn strain_forces(&self, heights: &Field) -> Field {
        let mut forces = Field::zeros(heights.warp.len());
        self.warp_strain.apply(&heights.warp, &mut forces.warp);
        self.weft_strain.apply(&heights.weft, &mut forces.weft);
        forces
    }

    /// Moves to the least energy along `direction`, along which it has this slope now.
    fn advance(&self, heights: &mut Field, direction: &Field, slope: f64) {
        if slope >= 0.0 {
            return;
        }
        let ratios = self.contacts.ratios(heights);
        let changes = self.contacts.ratios(direction);
        let forces = self.strain_forces(direction);
        let strain_slope = heights.dot(&forces);
        let strain_curvature = forces.dot(direction);
        drop(forces);
        let longest = Contacts::longest_step(&ratios, &changes);
        let step = line_search::search(slope, longest, |step| {
            let [slope, curvature] = self.contacts.along(&ratios, &changes, step);
            [slope + strain_slope + step * strain_curvature, curvature + strain_curvature]
        });
        heights.add(step, direction);
    }
}
