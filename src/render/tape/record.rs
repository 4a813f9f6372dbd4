//! Paths with all that their vertices need to be evaluated again.

use std::ops::Range;

use glam::DVec3;

use crate::math::color::Rgb;
use crate::render::cells::Cells;
use crate::render::recorder::{Recorder, Side};
use crate::render::scene::Scene;
use crate::scatter::passage::Passage;

/// Paths of a cell that are recorded and replayed at a time.
pub const PATHS_PER_STRIP: u32 = 1024;

/// A direction that a vertex is connected with.
#[derive(Debug, Clone, Copy)]
pub struct Connection {
    /// The side of the yarn.
    pub side: Side,
    /// The direction, in the frame of that side.
    pub wi: DVec3,
    /// What the scattering is multiplied with.
    pub weight: Rgb,
}

/// What happens along a path.
#[derive(Debug, Clone)]
pub enum Event {
    /// A new path begins.
    Start,
    /// The path meets a yarn.
    Vertex {
        /// The number of its material.
        material: u32,
        /// The direction back along the path.
        wo: DVec3,
        /// The way through the ply, if there is one.
        passage: Option<Passage>,
    },
    /// Light reaches the vertex.
    Light(Connection),
    /// The path goes on from the vertex.
    Scatter(Connection),
    /// The path ends in a light of this weight.
    Emitted(Rgb),
}

/// Paths of one cell of the picture, at most [`PATHS_PER_STRIP`].
#[derive(Debug, Default)]
pub struct Strip {
    /// One path after the other.
    pub events: Vec<Event>,
}

impl Recorder for Strip {
    fn vertex(&mut self, material: u32, wo: DVec3, passage: Option<&Passage>) {
        self.events.push(Event::Vertex { material, wo, passage: passage.copied() });
    }

    fn light(&mut self, side: Side, wi: DVec3, weight: Rgb) {
        self.events.push(Event::Light(Connection { side, wi, weight }));
    }

    fn scatter(&mut self, side: Side, wi: DVec3, weight: f64) {
        let weight = Rgb::splat(weight);
        self.events.push(Event::Scatter(Connection { side, wi, weight }));
    }

    fn emitted(&mut self, weight: Rgb) {
        self.events.push(Event::Emitted(weight));
    }
}

impl Strip {
    /// Traces some of the paths through a cell.
    pub fn record(scene: &Scene, cells: &Cells, cell: usize, paths: Range<u32>) -> Self {
        let mut strip = Self::default();
        for path in paths {
            let before = strip.events.len();
            strip.events.push(Event::Start);
            cells.trace(scene, cell, path, &mut strip);
            strip.forget_dark_end(before);
        }
        strip.events.shrink_to_fit();
        strip
    }

    /// Drops what follows the last light since event number `start`: it adds nothing, whatever the
    /// parameters.
    fn forget_dark_end(&mut self, start: usize) {
        let lit = |event: &Event| matches!(event, Event::Light(_) | Event::Emitted(_));
        let kept = self.events[start..].iter().rposition(lit).map_or(0, |last| last + 1);
        self.events.truncate(start + kept);
    }

    /// How many bytes the paths take.
    pub fn bytes(&self) -> usize {
        self.events.capacity() * size_of::<Event>()
    }
}
