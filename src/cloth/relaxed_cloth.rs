//! A cloth whose yarns have found their heights: the part of a scene's start that takes long, and that
//! scenes with other optics, lights, cameras or sizes share.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError, Weak};

use super::layout::Layout;
use super::spec::ClothSpec;
use super::swatch::Swatch;
use super::tile::Tile;
use crate::control::Control;
use crate::error::{Error, Result};
use crate::memory;
use crate::weave::curve::HeightCurves;
use crate::weave::relax::{Relaxed, relax};

/// A cloth and its heights.
#[derive(Debug)]
pub struct RelaxedCloth {
    /// The cloth, with its picks counted from the bottom.
    pub spec: ClothSpec,
    /// The heights, in the same order and in units of [`ClothSpec::unit`].
    pub relaxed: Arc<Relaxed>,
    /// Its tiles that swatches hold, by ends and picks.
    tiles: Mutex<HashMap<[usize; 2], Weak<Tile>>>,
}

/// Heights and slopes at the knots of all yarns of a direction, yarn by yarn.
pub type Curves = [Vec<f64>; 2];

impl RelaxedCloth {
    /// Relaxes a cloth whose picks are counted from the top.
    pub fn new(spec: &ClothSpec, control: &Control) -> Result<Self> {
        let spec = spec.bottom_up();
        let relaxed = relax(&spec.relax_problem(), control)?;
        Ok(Self::of(spec, relaxed))
    }

    /// Such a cloth with heights that are known, in its own order and in units of [`ClothSpec::unit`].
    pub fn with_heights(spec: &ClothSpec, [warp, weft]: [Curves; 2]) -> Result<Self> {
        let spec = spec.bottom_up();
        let problem = spec.relax_problem();
        let (slots, picks) = ([&problem.warp.spacing, &problem.weft.spacing], spec.pattern.picks);
        let warp = curves("warp", warp, slots[0].len(), slots[1])?;
        let weft = curves("weft", weft, slots[1].len(), slots[0])?;
        let warp = HeightCurves {
            height: turned_round(&warp.height, 2 * picks, 1.0)?,
            slope: turned_round(&warp.slope, 2 * picks, -1.0)?,
            ..warp
        };
        let weft = HeightCurves {
            height: rows_reversed(&weft.height, picks)?,
            slope: rows_reversed(&weft.slope, picks)?,
            ..weft
        };
        let relaxed = Relaxed::known(warp, weft);
        Ok(Self::of(spec, relaxed))
    }

    /// The heights of warp and weft with picks counted from the top, as a pattern has them.
    pub fn heights(&self) -> Result<[Curves; 2]> {
        let (Relaxed { warp, weft, .. }, picks) = (&*self.relaxed, self.spec.pattern.picks);
        Ok([
            [
                turned_round(&warp.height, 2 * picks, 1.0)?,
                turned_round(&warp.slope, 2 * picks, -1.0)?,
            ],
            [rows_reversed(&weft.height, picks)?, rows_reversed(&weft.slope, picks)?],
        ])
    }

    fn of(spec: ClothSpec, relaxed: Relaxed) -> Self {
        Self { spec, relaxed: Arc::new(relaxed), tiles: Mutex::default() }
    }

    /// A piece of it, `size` millimetres wide and high.
    pub fn swatch(&self, size: [f64; 2]) -> Result<Swatch> {
        Ok(Swatch::new(self.tile(size)?, size))
    }

    /// A tile for a swatch of `size`: one that others hold, if it is the same.
    fn tile(&self, size: [f64; 2]) -> Result<Arc<Tile>> {
        let layout = Layout::new(&self.spec, self.relaxed.clone(), size);
        let mut tiles = self.tiles.lock().unwrap_or_else(PoisonError::into_inner);
        tiles.retain(|_, tile| tile.strong_count() > 0);
        let counts = layout.counts();
        if let Some(tile) = tiles.get(&counts).and_then(Weak::upgrade) {
            return Ok(tile);
        }
        let tile = Arc::new(Tile::new(&self.spec, layout)?);
        tiles.insert(counts, Arc::downgrade(&tile));
        Ok(tile)
    }
}

/// Curves with these heights and slopes, of so many yarns that cross others in `slots`.
fn curves(
    name: &str,
    [height, slope]: Curves,
    yarns: usize,
    slots: &[f64],
) -> Result<HeightCurves> {
    let expected = 2 * yarns * slots.len();
    if let Some(given) = [&height, &slope].into_iter().find(|values| values.len() != expected) {
        let problem =
            format!("has {} heights, but the cloth has {yarns} x {}", given.len(), 2 * slots.len());
        return Err(Error::invalid(format!("heights.{name}"), problem));
    }
    Ok(HeightCurves { height, slope, ..HeightCurves::flat(0, slots) })
}

/// Values at `knots` places of each of some yarns that are seen from their other end.
fn turned_round(values: &[f64], knots: usize, sign: f64) -> Result<Vec<f64>> {
    let turned = |yarn: usize, k: usize| sign * values[yarn * knots + (knots - k) % knots];
    reordered(values.len(), |i| turned(i / knots, i % knots))
}

/// The values of yarns that are counted from the other side.
fn rows_reversed(values: &[f64], rows: usize) -> Result<Vec<f64>> {
    let row = values.len() / rows;
    reordered(values.len(), |i| values[(rows - 1 - i / row) * row + i % row])
}

fn reordered(count: usize, value: impl Fn(usize) -> f64) -> Result<Vec<f64>> {
    let mut indices = 0..count;
    let next = || value(indices.next().expect("as many as there are"));
    memory::table("copying the heights of a cloth", count, next)
}
