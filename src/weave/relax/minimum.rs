//! The least energy of one layer: Newton's method over the heights at its crossings.

use super::common_mode::CommonMode;
use super::components::Layer;
use super::contact::Contacts;
use super::field::Field;
use super::line_search;
use super::newton_system::{NewtonSystem, Step};
use super::softening::Softening;
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
/// The residual in between, relative to how much less a step promised than the one before (S.
/// Eisenstat and H. Walker 1996): contacts that still change show in steps that gain little.
const STEP_PER_GAIN: f64 = 0.1;
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
    /// Iterations of conjugate gradients, over all steps.
    pub linear_iterations: u64,
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
        let (mut heights, mut softening) = match heights {
            Some(heights) => (heights, Softening::none()),
            None => self.start(),
        };
        let (mut tolerance, mut before) = (LOOSEST_STEP, 0.0);
        let mut linear_iterations = 0;
        for iteration in 1..=ITERATIONS {
            let softness = softening.softness();
            let (energy, descent, system) = self.at(&heights, softness);
            let negligible = ENERGY_TOLERANCE * energy + floor;
            let Step { change, decrease, iterations } =
                system.solve(descent, tolerance, CG_MARGIN * negligible, control)?;
            linear_iterations += iterations;
            if !decrease.is_finite() || !energy.is_finite() {
                return Ok(Minimum {
                    heights,
                    iterations: iteration,
                    linear_iterations,
                    found: false,
                });
            }
            self.advance(&mut heights, &change, -decrease, softness);
            progress((decrease / energy).ln() / (negligible / energy).ln());
            let settled = decrease <= negligible;
            if softness == 0.0 {
                if settled {
                    return Ok(Minimum {
                        heights,
                        iterations: iteration,
                        linear_iterations,
                        found: true,
                    });
                }
                let accurate = STEP_PER_GAIN * decrease / before;
                tolerance = accurate.clamp(FINEST_STEP, LOOSEST_STEP);
            } else if settled {
                softening.end();
            } else {
                softening.harden();
            }
            before = decrease;
        }
        Ok(Minimum { heights, iterations: ITERATIONS, linear_iterations, found: false })
    }

    /// Touching yarns, scaled towards the plane to the least energy, and how soft they begin.
    fn start(&self) -> (Field, Softening) {
        let mut heights = self.contacts.touching();
        let mut flat = heights.clone();
        flat.scale(-1.0);
        let (_, descent, _) = self.at(&heights, 0.0);
        let slope = -descent.dot(&flat);
        drop(descent);
        self.advance(&mut heights, &flat, slope, 0.0);
        let pushes = self.contacts.mean_square_push(&self.contacts.ratios(&heights));
        (heights, Softening::of(pushes))
    }

    /// The energy, its negative gradient, and its second derivative; the two with soft collisions.
    fn at(&self, heights: &Field, softness: f64) -> (f64, Field, NewtonSystem<'_>) {
        let ratios = self.contacts.ratios(heights);
        let mut forces = self.strain_forces(heights);
        let energy = heights.dot(&forces) / 2.0 + self.contacts.energy(&ratios);
        let system = NewtonSystem {
            warp_strain: &self.warp_strain,
            weft_strain: &self.weft_strain,
            common_mode: &self.common_mode,
            contacts: &self.contacts,
            curvatures: self.contacts.curvatures(&ratios, softness),
        };
        let collisions = self.contacts.forces(ratios, softness);
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
    fn advance(&self, heights: &mut Field, direction: &Field, slope: f64, softness: f64) {
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
            let [slope, curvature] = self.contacts.along(&ratios, &changes, softness, step);
            [slope + strain_slope + step * strain_curvature, curvature + strain_curvature]
        });
        heights.add(step, direction);
    }
}
