//! Yarn relaxation: the heights with the least energy (Montazeri et al. 2020, section 3.1).
//!
//! The pattern fixes the order of the yarns at each crossing, and among heights in that order the
//! energy of Eq. 4 is convex. The cloth falls into layers that do not hold each other (see
//! `components`). Each is minimised alone, by Newton's method over the heights at its crossings, with
//! an exact line search that ends before any collision barrier; slopes and the heights between
//! crossings follow from these heights (see `strain`). Then the layers are laid onto each other.
//!
//! The size of the problem is that of the crossings within layers: floats over yarns of other layers
//! cost nothing. A Newton step takes some solves of single yarns and Fourier transforms, each
//! proportional to the crossings but for a logarithm. Where all interlaces evenly there are some 15
//! steps whatever the size. Where floats as long as the pattern lie on each other, contacts open and
//! close along them. Collisions begin soft, so that many do at once (see `softening`); in a square of
//! floats in a frame of plain weave the solves grow in number with about the square root of the
//! length of the floats. Some weaves take far more: rows of floats that only a few yarns hold, and
//! thin frames (`benches/relaxation.py` has them).

mod common_mode;
mod components;
mod contact;
mod cyclic;
mod field;
mod float;
mod lanes;
mod line_search;
mod minimum;
mod newton_system;
mod softening;
mod stack;
mod strain;
mod transpose;

use crate::control::Control;
use crate::error::{Error, Result};
use crate::memory;

use super::curve::HeightCurves;
use super::energy::Energy;
use super::problem::RelaxProblem;
use components::{Layer, layers};
use field::Field;
use minimum::Relaxation;
use stack::stack;
use strain::Strain;

/// Memory that a relaxation takes at most for each crossing.
pub const BYTES_PER_CROSSING: usize = 100;

/// Units of work that a relaxation counts in its control.
pub const UNITS: u64 = 100;

/// Relaxed yarns of one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Relaxed {
    /// E of Eq. 4, for one cell.
    pub energy: f64,
    /// Euclidean norm of the energy's gradient with respect to all heights and slopes.
    pub gradient_norm: f64,
    /// Newton steps taken, over all layers.
    pub iterations: u64,
    /// Iterations of conjugate gradients within them, over all layers.
    pub linear_iterations: u64,
    /// The warp yarns; knot 2j + 1 is the crossing with pick j.
    pub warp: HeightCurves,
    /// The weft yarns; knot 2i + 1 is the crossing with end i.
    pub weft: HeightCurves,
}

impl Relaxed {
    /// Heights that come from elsewhere: what a relaxation would say of itself is not known.
    pub fn known(warp: HeightCurves, weft: HeightCurves) -> Self {
        let (energy, gradient_norm) = (f64::NAN, f64::NAN);
        Self { energy, gradient_norm, iterations: 0, linear_iterations: 0, warp, weft }
    }
}

/// Relaxes the yarns of a cell; the mean height of all crossings is zero.
///
/// Each yarn has two knots per crossing, at the boundaries and at the middles of the slots of the
/// yarns that it crosses. Yarns that nothing holds together come to lie on each other. `control`
/// counts up to [`UNITS`]. The result does not depend on the number of threads. The memory taken is
/// [`BYTES_PER_CROSSING`], 64 of which are the result.
///
/// Errors: [`Error::Invalid`] for bad input, [`Error::OutOfMemory`], [`Error::Stopped`], and
/// [`Error::NotConverged`] if numbers so far apart were given that the minimum cannot be found in
/// double precision.
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
    relax_beginning(problem, Some((near, scale)), control)
}

fn relax_beginning(
    problem: &RelaxProblem,
    near: Option<(&Relaxed, f64)>,
    control: &Control,
) -> Result<Relaxed> {
    problem.check()?;
    check_memory(problem.pattern.picks, problem.pattern.ends)?;
    let mut outcome = Err(Error::Stopped);
    // Inside the pool from the start, a small cell never waits for another thread.
    rayon::scope(|_| outcome = relax_layers(problem, near, control));
    outcome
}

fn check_memory(picks: usize, ends: usize) -> Result<()> {
    let work = format!("relaxing {picks} picks x {ends} ends");
    memory::claim(&work, picks.saturating_mul(ends).saturating_mul(BYTES_PER_CROSSING))
}

fn relax_layers(
    problem: &RelaxProblem,
    near: Option<(&Relaxed, f64)>,
    control: &Control,
) -> Result<Relaxed> {
    let layers = layers(&problem.pattern);
    let mut warp = None;
    let mut weft = None;
    let (mut iterations, mut linear_iterations) = (0, 0);
    let mut converged = true;
    let mut progress = Progress::new(&layers, control);
    for layer in layers.iter().filter(|layer| layer.interlaces()) {
        let relaxation = Relaxation::new(problem, layer);
        let start = near.map(|(near, scale)| near.crossing_heights(layer, scale));
        let watch = |part| progress.reach(layer, part);
        let minimum = relaxation.run(problem.collision_stiffness, start, control, watch)?;
        progress.complete(layer);
        iterations += minimum.iterations;
        linear_iterations += minimum.linear_iterations;
        converged &= minimum.found;
        let Field { warp: ends, weft: picks } = minimum.heights;
        let warp = warp.get_or_insert_with(|| flat_warp(problem));
        write(&relaxation.warp_strain, &ends, &layer.ends, &layer.picks, warp);
        drop(ends);
        let weft = weft.get_or_insert_with(|| flat_weft(problem));
        write(&relaxation.weft_strain, &picks, &layer.picks, &layer.ends, weft);
    }
    let mut warp = warp.unwrap_or_else(|| flat_warp(problem));
    let mut weft = weft.unwrap_or_else(|| flat_weft(problem));
    stack(problem, &layers, &mut warp, &mut weft, control)?;
    center(&mut warp, &mut weft);
    let Energy { value, gradient_norm } = Energy::of(problem, &warp, &weft);
    if !converged {
        return Err(Error::NotConverged { iterations, gradient_norm });
    }
    Ok(Relaxed { energy: value, gradient_norm, iterations, linear_iterations, warp, weft })
}

/// How much of all layers is done, counted by their crossings.
struct Progress<'a> {
    control: &'a Control,
    all: f64,
    before: f64,
    reported: u64,
}

impl<'a> Progress<'a> {
    fn new(layers: &[Layer], control: &'a Control) -> Self {
        let all = layers.iter().map(Layer::crossings).sum();
        Self { control, all, before: 0.0, reported: 0 }
    }

    /// Says that this part, from 0 to 1, of a layer is done, if that is more than before.
    fn reach(&mut self, layer: &Layer, part: f64) {
        let done = self.before + layer.crossings() * part.clamp(0.0, 1.0);
        let units = (UNITS as f64 * done / self.all) as u64;
        self.control.advance(units.saturating_sub(self.reported));
        self.reported = self.reported.max(units);
    }

    fn complete(&mut self, layer: &Layer) {
        self.reach(layer, 1.0);
        self.before += layer.crossings();
    }
}

impl Relaxed {
    /// The heights, times `scale`, at the crossings of a layer.
    fn crossing_heights(&self, layer: &Layer, scale: f64) -> Field {
        let heights = |curves: &HeightCurves, yarns: &[usize], crossed: &[usize]| {
            let mut heights = Vec::with_capacity(yarns.len() * crossed.len());
            for &yarn in yarns {
                let curve = curves.yarn(yarn);
                heights.extend(crossed.iter().map(|slot| scale * curve.height[2 * slot + 1]));
            }
            heights
        };
        Field {
            warp: heights(&self.warp, &layer.ends, &layer.picks),
            weft: heights(&self.weft, &layer.picks, &layer.ends),
        }
    }
}

fn flat_warp(problem: &RelaxProblem) -> HeightCurves {
    HeightCurves::flat(problem.pattern.ends, &problem.weft.spacing)
}

fn flat_weft(problem: &RelaxProblem) -> HeightCurves {
    HeightCurves::flat(problem.pattern.picks, &problem.warp.spacing)
}

/// Writes the curves of a layer's yarns, of these heights at their crossings with `crossed`.
fn write(
    strain: &Strain,
    heights: &[f64],
    yarns: &[usize],
    crossed: &[usize],
    curves: &mut HeightCurves,
) {
    let knots = curves.knots.len();
    for (heights, yarn) in heights.chunks_exact(crossed.len()).zip(yarns) {
        let own = yarn * knots..(yarn + 1) * knots;
        let (height, slope) = (&mut curves.height[own.clone()], &mut curves.slope[own]);
        strain.write_curve(heights, crossed, height, slope);
    }
}

/// Moves all yarns so that the mean height of the crossings is zero.
fn center(warp: &mut HeightCurves, weft: &mut HeightCurves) {
    let crossings = warp.height.iter().chain(&weft.height).skip(1).step_by(2);
    let mean = crossings.sum::<f64>() / (warp.height.len() / 2 + weft.height.len() / 2) as f64;
    warp.height.iter_mut().chain(&mut weft.height).for_each(|height| *height -= mean);
}

#[cfg(test)]
mod tests;
