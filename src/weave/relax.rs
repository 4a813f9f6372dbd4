//! Yarn relaxation: the heights with the least energy (Montazeri et al. 2020, section 3.1).
//!
//! The pattern fixes the order of the yarns at each crossing, and among heights in that order the
//! energy of Eq. 4 is convex: it is minimised by Newton's method over the heights at the crossings,
//! with an exact line search that ends before any collision barrier. Slopes and the heights between
//! crossings follow from these heights (see `strain`).

mod common_mode;
mod contact;
mod cyclic;
mod field;
mod line_search;
mod newton_system;
mod strain;
mod transpose;

use crate::control::Control;
use crate::error::{Error, Result};

use super::curve::HeightCurve;
use super::energy::Energy;
use super::problem::RelaxProblem;
use common_mode::CommonMode;
use contact::Contacts;
use field::Field;
use newton_system::NewtonSystem;
use strain::Strain;

/// Newton steps after which the relaxation is given up.
const ITERATIONS: u64 = 1000;
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

/// Relaxed yarns of one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Relaxed {
    /// E of Eq. 4, for one cell.
    pub energy: f64,
    /// Euclidean norm of the energy's gradient with respect to all heights and slopes.
    pub gradient_norm: f64,
    /// Newton steps taken.
    pub iterations: u64,
    /// One curve per warp yarn; knot 2j + 1 is the crossing with pick j.
    pub warp: Vec<HeightCurve>,
    /// One curve per weft yarn; knot 2i + 1 is the crossing with end i.
    pub weft: Vec<HeightCurve>,
}

/// Relaxes the yarns of a cell; the mean height of all crossings is zero.
///
/// Each yarn has two knots per crossing, at the boundaries and at the middles of the slots of the
/// yarns that it crosses. `control` counts Newton steps. The result does not depend on the number
/// of threads.
///
/// Errors: [`Error::Invalid`] for bad input, [`Error::Stopped`], and [`Error::NotConverged`] if
/// numbers so far apart were given that the minimum cannot be found in double precision.
pub fn relax(problem: &RelaxProblem, control: &Control) -> Result<Relaxed> {
    relax_beginning(problem, None, control)
}

/// What [`relax`] finds, in fewer steps: `near` is another cell of the same pattern, relaxed, whose
/// heights times `scale` (greater than 0) are close to those looked for.
pub fn relax_near(
    problem: &RelaxProblem,
    near: &Relaxed,
    scale: f64,
    control: &Control,
) -> Result<Relaxed> {
    let mut heights = near.crossing_heights();
    heights.scale(scale);
    relax_beginning(problem, Some(heights), control)
}

fn relax_beginning(
    problem: &RelaxProblem,
    heights: Option<Field>,
    control: &Control,
) -> Result<Relaxed> {
    problem.check()?;
    let mut outcome = Err(Error::Stopped);
    // Inside the pool from the start, a small cell never waits for another thread.
    rayon::scope(|_| outcome = Relaxation::new(problem).run(problem, heights, control));
    outcome
}

impl Relaxed {
    fn crossing_heights(&self) -> Field {
        let heights = |curves: &[HeightCurve]| {
            curves
                .iter()
                .flat_map(|curve| curve.height.iter().skip(1).step_by(2).copied())
                .collect()
        };
        Field { warp: heights(&self.warp), weft: heights(&self.weft) }
    }
}

/// Everything that stays the same from step to step.
struct Relaxation {
    warp_strain: Strain,
    weft_strain: Strain,
    contacts: Contacts,
    common_mode: CommonMode,
}

/// Heights, and what derives from them.
struct State {
    heights: Field,
    ratios: Vec<f64>,
    strain_forces: Field,
}

impl Relaxation {
    fn new(problem: &RelaxProblem) -> Self {
        let warp_strain = Strain::new(&problem.warp, &problem.weft);
        let weft_strain = Strain::new(&problem.weft, &problem.warp);
        let common_mode = CommonMode::new(&warp_strain, &weft_strain);
        Self { warp_strain, weft_strain, contacts: Contacts::new(problem), common_mode }
    }

    fn run(
        &self,
        problem: &RelaxProblem,
        heights: Option<Field>,
        control: &Control,
    ) -> Result<Relaxed> {
        let floor = ENERGY_FLOOR * problem.collision_stiffness * self.contacts.count() as f64;
        let mut state = heights.map_or_else(|| self.start(), |heights| self.at(heights));
        let mut tolerance = LOOSEST_STEP;
        for iteration in 1..=ITERATIONS {
            let energy = self.energy(&state);
            let negligible = ENERGY_TOLERANCE * energy + floor;
            let descent = self.descent(&state);
            let step = self.system(&state).solve(
                descent.clone(),
                tolerance,
                CG_MARGIN * negligible,
                control,
            )?;
            let decrease = descent.dot(&step);
            if !decrease.is_finite() || !energy.is_finite() {
                break;
            }
            state = self.advance(state, &step, -decrease);
            control.advance(1);
            if decrease <= negligible {
                return Ok(self.finish(problem, state.heights, iteration));
            }
            tolerance = (decrease / energy).sqrt().clamp(FINEST_STEP, LOOSEST_STEP);
        }
        let last = self.finish(problem, state.heights, ITERATIONS);
        Err(Error::NotConverged { iterations: ITERATIONS, gradient_norm: last.gradient_norm })
    }

    fn system(&self, state: &State) -> NewtonSystem<'_> {
        let strains = [&self.warp_strain, &self.weft_strain];
        NewtonSystem::new(strains, &self.common_mode, &self.contacts, &state.ratios)
    }

    /// Touching yarns, scaled towards the plane to the least energy.
    fn start(&self) -> State {
        let state = self.at(self.contacts.touching());
        let mut flat = state.heights.clone();
        flat.scale(-1.0);
        let slope = -self.descent(&state).dot(&flat);
        self.advance(state, &flat, slope)
    }

    fn at(&self, heights: Field) -> State {
        let ratios = self.contacts.ratios(&heights);
        let strain_forces = self.strain_forces(&heights);
        State { heights, ratios, strain_forces }
    }

    fn strain_forces(&self, heights: &Field) -> Field {
        Field {
            warp: self.warp_strain.apply(&heights.warp),
            weft: self.weft_strain.apply(&heights.weft),
        }
    }

    fn energy(&self, state: &State) -> f64 {
        state.heights.dot(&state.strain_forces) / 2.0 + self.contacts.energy(&state.ratios)
    }

    /// The energy's negative gradient.
    fn descent(&self, state: &State) -> Field {
        let mut forces = state.strain_forces.clone();
        let collisions = self.contacts.forces(&state.ratios);
        forces.add_opposed(&collisions, self.contacts.picks, self.contacts.ends);
        forces.scale(-1.0);
        forces
    }

    /// Moves to the least energy along `direction`, along which it has this slope now.
    fn advance(&self, state: State, direction: &Field, slope: f64) -> State {
        if slope >= 0.0 {
            return state;
        }
        let changes = self.contacts.ratios(direction);
        let forces = self.strain_forces(direction);
        let strain_slope = state.strain_forces.dot(direction);
        let strain_curvature = forces.dot(direction);
        let longest = Contacts::longest_step(&state.ratios, &changes);
        let step = line_search::search(slope, longest, |step| {
            let [slope, curvature] = self.contacts.along(&state.ratios, &changes, step);
            [slope + strain_slope + step * strain_curvature, curvature + strain_curvature]
        });
        let mut heights = state.heights;
        heights.add(step, direction);
        self.at(heights)
    }

    fn finish(&self, problem: &RelaxProblem, mut heights: Field, iterations: u64) -> Relaxed {
        heights.shift(-heights.mean());
        let curves = |strain: &Strain, heights: &[f64]| {
            heights.chunks(strain.crossings()).map(|heights| strain.curve(heights)).collect()
        };
        let warp: Vec<HeightCurve> = curves(&self.warp_strain, &heights.warp);
        let weft: Vec<HeightCurve> = curves(&self.weft_strain, &heights.weft);
        let energy = Energy::of(problem, &warp, &weft);
        let gradient_norm = energy.gradient_norm();
        Relaxed { energy: energy.value, gradient_norm, iterations, warp, weft }
    }
}

#[cfg(test)]
mod tests;
