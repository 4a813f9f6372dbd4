//! A grid of blocks that repeats over the plane, and the walk of a ray through it.

use glam::DVec3;

use crate::accel::ray::Ray;
use crate::math::extremes::{greater, lesser};

/// The edges of the blocks along one axis, over one tile that repeats without end.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// From 0 to the tile's length, ascending.
    edges: Vec<f64>,
    /// Tiles and blocks to a millimetre.
    density: [f64; 2],
}

/// A block along one axis: its number inside the tile, and where the tile starts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    index: usize,
    tile: f64,
}

impl Axis {
    /// The axis of blocks with the given lengths.
    pub fn new(lengths: impl IntoIterator<Item = f64>) -> Self {
        let mut edge = 0.0;
        let mut edges = vec![edge];
        edges.extend(lengths.into_iter().map(|length| {
            edge += length;
            edge
        }));
        let density = [1.0, (edges.len() - 1) as f64].map(|count| count / edge);
        Self { edges, density }
    }

    /// The length of the tile.
    pub fn period(&self) -> f64 {
        self.edges[self.len()]
    }

    /// The number of blocks in the tile.
    pub fn len(&self) -> usize {
        self.edges.len() - 1
    }

    /// Whether the tile holds no blocks.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    #[inline]
    fn locate(&self, position: f64) -> Cell {
        let tile = (position * self.density[0]).floor();
        let within = position - tile * self.period();
        let guess = (within * self.density[1]) as u32 as usize;
        let hit = self.edges.get(guess..guess + 2).is_some_and(|e| e[0] <= within && within < e[1]);
        Cell { index: if hit { guess } else { self.search(within) }, tile }
    }

    /// The block at a place of the tile, where blocks differ in length.
    #[cold]
    fn search(&self, within: f64) -> usize {
        let last = self.len() - 1;
        (self.edges.partition_point(|&edge| edge <= within).max(1) - 1).min(last)
    }

    /// The block at a position.
    pub fn at(&self, position: f64) -> Located {
        self.located(self.locate(position))
    }

    #[inline]
    fn located(&self, cell: Cell) -> Located {
        Located { block: cell.index, tile: cell.tile, low: self.low(cell) }
    }

    #[inline]
    fn low(&self, cell: Cell) -> f64 {
        cell.tile * self.period() + self.edges[cell.index]
    }

    #[inline]
    fn high(&self, cell: Cell) -> f64 {
        cell.tile * self.period() + self.edges[cell.index + 1]
    }

    #[inline]
    fn step(&self, cell: Cell, forward: bool) -> Cell {
        match (forward, cell.index) {
            (true, i) if i + 1 < self.len() => Cell { index: i + 1, ..cell },
            (true, _) => Cell { index: 0, tile: cell.tile + 1.0 },
            (false, 0) => Cell { index: self.len() - 1, tile: cell.tile - 1.0 },
            (false, i) => Cell { index: i - 1, ..cell },
        }
    }
}

/// Where a block stands along one axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Located {
    /// Its number inside the tile.
    pub block: usize,
    /// The number of the tile, whole.
    pub tile: f64,
    /// Where it starts.
    pub low: f64,
}

/// A block met on a walk.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visit {
    /// Its column and row.
    pub at: [Located; 2],
    /// Where the ray enters the block's footprint.
    pub t_enter: f64,
    /// Where the ray leaves it.
    pub t_leave: f64,
}

/// Calls `visit` for the blocks whose footprints the ray crosses from its origin to `t_max`, in order,
/// until it answers something; `inverse` is that of its direction. The cost grows with the number of
/// blocks crossed.
#[inline]
pub fn walk<R>(
    axes: &[Axis; 2],
    ray: &Ray,
    inverse: DVec3,
    t_max: f64,
    mut visit: impl FnMut(Visit) -> Option<R>,
) -> Option<R> {
    let mut cells = [axes[0].locate(ray.origin.x), axes[1].locate(ray.origin.y)];
    let mut t = 0.0;
    loop {
        let leave = |axis: usize| {
            let forward = inverse[axis] > 0.0;
            let cell = cells[axis];
            let edge = if forward { axes[axis].high(cell) } else { axes[axis].low(cell) };
            (edge - ray.origin[axis]) * inverse[axis]
        };
        let crossings = [leave(0), leave(1)];
        let axis = usize::from(crossings[1] < crossings[0]);
        let t_leave = lesser(greater(crossings[axis], t), t_max);
        let found = visit(Visit {
            at: [axes[0].located(cells[0]), axes[1].located(cells[1])],
            t_enter: t,
            t_leave,
        });
        if found.is_some() || t_leave >= t_max {
            return found;
        }
        cells[axis] = axes[axis].step(cells[axis], inverse[axis] > 0.0);
        t = t_leave;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn visits(axes: &[Axis; 2], ray: &Ray, t_max: f64) -> Vec<Visit> {
        let mut all = Vec::new();
        let nothing: Option<()> = walk(axes, ray, ray.inverse(), t_max, |visit| {
            all.push(visit);
            None
        });
        assert!(nothing.is_none());
        all
    }

    /// Points along the ray lie in the footprint of the block that the walk says.
    #[test]
    fn every_point_of_a_ray_is_in_the_block_visited_there() {
        let axes = [Axis::new([1.0, 0.5, 2.0]), Axis::new([0.7])];
        for (x, y) in [(1.0, 0.3), (-0.8, 0.5), (0.2, -1.0), (1.0, 0.0), (0.0, -1.0), (-0.1, -0.9)]
        {
            let direction = DVec3::new(x, y, -0.1).normalize();
            let ray = Ray { origin: DVec3::new(-3.3, 7.9, 0.2), direction };
            let all = visits(&axes, &ray, 25.0);
            assert_eq!((all[0].t_enter, all.last().unwrap().t_leave), (0.0, 25.0));
            for (visit, next) in all.iter().zip(all.iter().skip(1)) {
                assert_eq!(visit.t_leave, next.t_enter);
            }
            for visit in all {
                let middle = ray.at(0.5 * (visit.t_enter + visit.t_leave));
                for axis in 0..2 {
                    let edges = &axes[axis].edges;
                    let size = edges[visit.at[axis].block + 1] - edges[visit.at[axis].block];
                    let within = middle[axis] - visit.at[axis].low;
                    assert!((-1e-9..=size + 1e-9).contains(&within), "{visit:?} {middle}");
                }
            }
        }
    }
}
