//! Recorded paths evaluated for other parameters: forwards for values, backwards for derivatives.

use glam::DVec3;

use super::differentiable::{Differentiable, DifferentiablePassage, Scattering};
use super::parameter;
use super::record::{Connection, Event, Strip};
use crate::math::color::Rgb;

/// A vertex with what it passes on.
struct Vertex {
    material: usize,
    wo: DVec3,
    passage: Option<DifferentiablePassage>,
    /// The throughput of the path before it.
    throughput: Rgb,
    /// Light added here per unit of throughput.
    lit: Rgb,
    scattered: Option<(Scattering, Rgb)>,
}

impl Vertex {
    fn connect(&self, models: &[Differentiable], connection: &Connection) -> Scattering {
        models[self.material].connect(self.wo, self.passage.as_ref(), connection)
    }
}

/// Sums over the paths of a cell.
pub struct Sums {
    /// Of their values.
    pub value: Rgb,
    /// Of the derivatives, per channel: materials x parameters.
    pub rows: [Vec<f64>; 3],
}

impl Sums {
    /// Evaluates the paths of `strip`, each times `scale`.
    pub fn over(strip: &Strip, models: &[Differentiable], scale: f64) -> Self {
        let columns = models.len() * parameter::COUNT;
        let mut sums = Self { value: Rgb::ZERO, rows: [const { Vec::new() }; 3] };
        sums.rows.iter_mut().for_each(|row| row.resize(columns, 0.0));
        let mut path = Vec::new();
        for events in strip.events.split_inclusive(|event| matches!(event, Event::Start)) {
            let emitted = sums.replay(&mut path, events, models, scale);
            sums.finish(&mut path, emitted, scale);
        }
        sums
    }

    /// Follows one path forwards: values, and the derivatives of its light connections.
    fn replay(
        &mut self,
        path: &mut Vec<Vertex>,
        events: &[Event],
        models: &[Differentiable],
        scale: f64,
    ) -> Rgb {
        let mut throughput = Rgb::splat(scale);
        let mut emitted = Rgb::ZERO;
        for event in events {
            match event {
                Event::Start => {}
                Event::Vertex { material, wo, passage } => {
                    let material = *material as usize;
                    let optics = &models[material].optics;
                    let passage = passage.map(|passage| (passage, optics.passage(*wo, &passage)));
                    let (lit, scattered) = (Rgb::ZERO, None);
                    path.push(Vertex { material, wo: *wo, passage, throughput, lit, scattered });
                }
                Event::Light(connection) => {
                    let vertex = path.last_mut().expect("light is recorded at a vertex");
                    let scattering = vertex.connect(models, connection);
                    vertex.lit += scattering.value * connection.weight;
                    let (material, seed) = (vertex.material, throughput * connection.weight);
                    self.add(material, &scattering, seed);
                }
                Event::Scatter(connection) => {
                    let vertex = path.last_mut().expect("scattering is recorded at a vertex");
                    let scattering = vertex.connect(models, connection);
                    throughput *= scattering.value * connection.weight;
                    vertex.scattered = Some((scattering, connection.weight));
                }
                Event::Emitted(weight) => emitted += *weight,
            }
        }
        emitted
    }

    /// Follows the path backwards: what arrives at each vertex is the seed of the derivatives of
    /// the scattering before it.
    fn finish(&mut self, path: &mut Vec<Vertex>, emitted: Rgb, scale: f64) {
        let mut arriving = emitted;
        while let Some(vertex) = path.pop() {
            let mut leaving = vertex.lit;
            if let Some((scattering, weight)) = &vertex.scattered {
                self.add(vertex.material, scattering, vertex.throughput * *weight * arriving);
                leaving += scattering.value * *weight * arriving;
            }
            arriving = leaving;
        }
        self.value += scale * arriving;
    }

    fn add(&mut self, material: usize, scattering: &Scattering, seed: Rgb) {
        let first = material * parameter::COUNT;
        for (channel, row) in self.rows.iter_mut().enumerate() {
            let row = &mut row[first..first + parameter::COUNT];
            for (sum, derivative) in row.iter_mut().zip(&scattering.rows[channel]) {
                *sum += seed[channel] * derivative;
            }
        }
    }
}
