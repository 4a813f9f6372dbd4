//! Recorded paths: a picture's cell averages as a smooth function of the optical parameters.
//!
//! Paths are drawn once, from the parameters that the tape was recorded with, together with all that
//! their vertices need. For other parameters every factor is f(new) / p(recorded): the averages are
//! then an exact, smooth function of the parameters, whose derivatives come from the same paths
//! without tracing a ray. One thing is out of their reach: light that a larger eta bends further than
//! the recorded one can.
//!
//! Memory grows with the number of path vertices: 500 to 600 bytes a path of a
//! satin on the photo rig.

use std::ops::Range;

use glam::DVec3;
use num_dual::DualNum;
use rayon::prelude::*;

use super::path::{PathLimits, Recorder, Side, radiance};
use super::scene::{Material, Scene};
use crate::control::Control;
use crate::error::{Error, Result};
use crate::math::color::Rgb;
use crate::math::dual::{Dual6, gradient, variable};
use crate::math::rng::Sampler;
use crate::scatter::dielectric::RoughDielectric;
use crate::scatter::ggx::Ggx;
use crate::scatter::ply::{Passage, PassageTerms, PlyBsdf, PlyOptics, PlyParameters};

/// The parameters of a ply as one row of numbers: where each starts, and how many there are.
pub mod parameter {
    /// eta.
    pub const ETA: usize = 0;
    /// k_x^S, three channels.
    pub const SPECULAR_TINT: usize = 1;
    /// k_y^S, three channels.
    pub const TRANSMISSION_TINT: usize = 4;
    /// k_x^B, three channels.
    pub const BASE_COLOR: usize = 7;
    /// k_y, three channels.
    pub const TRANSMITTED_COLOR: usize = 10;
    /// r.
    pub const BODY_REFLECTION: usize = 13;
    /// sigma_t.
    pub const EXTINCTION: usize = 14;
    /// beta_x, along and across.
    pub const ROUGHNESS: usize = 15;
    /// beta_y, along and across.
    pub const EXIT_ROUGHNESS: usize = 17;
    /// How many.
    pub const COUNT: usize = 19;
}

/// Where the six variables of [`PlyOptics`] stand among the parameters.
const OPTICS: [usize; 6] = [
    parameter::ETA,
    parameter::EXTINCTION,
    parameter::ROUGHNESS,
    parameter::ROUGHNESS + 1,
    parameter::EXIT_ROUGHNESS,
    parameter::EXIT_ROUGHNESS + 1,
];

/// Paths of a cell that are recorded and replayed at a time.
const PATHS_PER_STRIP: u32 = 1024;

/// A direction that a vertex is connected with.
#[derive(Debug, Clone, Copy)]
struct Connection {
    side: Side,
    wi: DVec3,
    weight: Rgb,
}

#[derive(Debug, Clone)]
enum Event {
    /// A new path begins.
    Start,
    Vertex {
        material: u32,
        wo: DVec3,
        passage: Option<Passage>,
    },
    Light(Connection),
    Scatter(Connection),
    Emitted(Rgb),
}

/// Paths of one cell of the picture, at most [`PATHS_PER_STRIP`].
#[derive(Debug, Default)]
struct Strip {
    events: Vec<Event>,
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

/// The recorded paths of a picture, cell by cell.
#[derive(Debug)]
pub struct Tape {
    /// Columns and rows of cells.
    pub grid: [usize; 2],
    materials: usize,
    paths: u32,
    /// For each cell in turn, [`Tape::strips_per_cell`].
    strips: Vec<Strip>,
}

/// Cell averages and their derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct Averages {
    /// Cells (row by row) x 3.
    pub values: Vec<f64>,
    /// Cells x 3 x materials x [`parameter::COUNT`].
    pub jacobian: Vec<f64>,
}

impl Tape {
    /// Draws `paths` paths through each of the cells that `grid` divides the picture into, at most
    /// [`Sampler::MAX_LOW_DISCREPANCY`] and best a power of two; every material of the scene must be
    /// a ply.
    pub fn record(
        scene: &Scene,
        grid: [usize; 2],
        paths: u32,
        seed: u64,
        limits: PathLimits,
        control: &Control,
    ) -> Result<Self> {
        if scene.materials.list.iter().any(|m| !matches!(m, Material::Ply(_))) {
            return Err(Error::invalid("scene", "has a yarn whose BSDF is not a PlyBsdf"));
        }
        if paths == 0 || paths > Sampler::MAX_LOW_DISCREPANCY {
            let problem = format!("must be 1 to {}, not {paths}", Sampler::MAX_LOW_DISCREPANCY);
            return Err(Error::invalid("paths", problem));
        }
        let per_cell = paths.div_ceil(PATHS_PER_STRIP) as usize;
        let strips = (0..grid[0] * grid[1] * per_cell)
            .into_par_iter()
            .map(|strip| {
                control.check()?;
                let first = (strip % per_cell) as u32 * PATHS_PER_STRIP;
                let range = first..paths.min(first + PATHS_PER_STRIP);
                let strip = record_strip(scene, grid, strip / per_cell, range, seed, limits);
                control.advance(1);
                Ok(strip)
            })
            .collect::<Result<_>>()?;
        Ok(Self { grid, materials: scene.materials.list.len(), paths, strips })
    }

    /// The cell averages for the given parameters of each material, and their derivatives.
    pub fn evaluate(&self, parameters: &[PlyParameters], control: &Control) -> Result<Averages> {
        if parameters.len() != self.materials {
            let problem = format!("has {} rows, not {}", parameters.len(), self.materials);
            return Err(Error::invalid("parameters", problem));
        }
        let models =
            parameters.iter().map(|p| Differentiable::new(*p)).collect::<Result<Vec<_>>>()?;
        let columns = models.len() * parameter::COUNT;
        let strips = self
            .strips
            .par_iter()
            .map(|strip| {
                control.check()?;
                let sums = Sums::over(strip, &models, 1.0 / f64::from(self.paths));
                control.advance(1);
                Ok(sums)
            })
            .collect::<Result<Vec<_>>>()?;
        let mut averages = Averages {
            values: Vec::with_capacity(3 * self.grid[0] * self.grid[1]),
            jacobian: Vec::with_capacity(3 * columns * self.grid[0] * self.grid[1]),
        };
        for of_cell in strips.chunks_exact(self.strips_per_cell()) {
            averages.values.extend(of_cell.iter().map(|sums| sums.value).sum::<Rgb>().to_array());
            for channel in 0..3 {
                averages.jacobian.extend((0..columns).map(|column| {
                    of_cell.iter().map(|sums| sums.rows[channel][column]).sum::<f64>()
                }));
            }
        }
        Ok(averages)
    }

    fn strips_per_cell(&self) -> usize {
        self.paths.div_ceil(PATHS_PER_STRIP) as usize
    }

    /// How many bytes the recorded paths take.
    pub fn bytes(&self) -> usize {
        self.strips.iter().map(|strip| strip.events.capacity() * size_of::<Event>()).sum()
    }
}

fn record_strip(
    scene: &Scene,
    grid: [usize; 2],
    cell: usize,
    paths: Range<u32>,
    seed: u64,
    limits: PathLimits,
) -> Strip {
    let mut strip = Strip::default();
    let [width, height] = scene.camera.resolution;
    let size = [width as f64 / grid[0] as f64, height as f64 / grid[1] as f64];
    let corner = [cell % grid[0], cell / grid[0]];
    for path in paths {
        let mut sampler = Sampler::low_discrepancy(seed, cell as u64, path);
        let within = sampler.next_2d();
        let [x, y] = [0, 1].map(|axis| (corner[axis] as f64 + within[axis]) * size[axis]);
        strip.events.push(Event::Start);
        radiance(scene, scene.camera.ray(x, y), limits, sampler, &mut strip);
    }
    strip.events.shrink_to_fit();
    strip
}

/// A ply whose values carry derivatives with respect to [`OPTICS`].
struct Differentiable {
    bsdf: PlyBsdf,
    optics: PlyOptics<Dual6>,
}

impl Differentiable {
    fn new(parameters: PlyParameters) -> Result<Self> {
        let p = &parameters;
        let eta = variable(p.eta, 0);
        let ggx = |ggx: Ggx, first| Ggx {
            along: variable(ggx.along, first),
            across: variable(ggx.across, first + 1),
        };
        let optics = PlyOptics {
            entry: RoughDielectric { eta, ggx: ggx(p.roughness, 2) },
            exit: RoughDielectric { eta: eta.recip(), ggx: ggx(p.exit_roughness, 4) },
            extinction: variable(p.extinction, 1),
        };
        Ok(Self { bsdf: PlyBsdf::new(parameters)?, optics })
    }

    /// The value of a connection of a vertex, and its derivatives.
    fn connect(&self, vertex: &Vertex, connection: &Connection) -> Scattering {
        let mut scattering = Scattering::default();
        let wi = connection.wi;
        match (connection.side, &vertex.passage) {
            (Side::Entry, passage) => {
                let terms = passage.as_ref().map(|(_, terms)| terms);
                let [mirrored, body] = self.optics.at_entry(vertex.wo, wi, terms);
                self.entry(&mut scattering, mirrored, body, [vertex.wo.z, wi.z]);
            }
            (Side::Exit, Some((passage, terms))) => {
                let [refracted, body] = self.optics.at_exit(passage, terms, wi);
                self.exit(&mut scattering, refracted, body);
            }
            (Side::Exit, None) => {}
        }
        scattering
    }

    /// f = k_x^S mirrored + r body brdf(k_x^B, eta), channel by channel.
    fn entry(&self, out: &mut Scattering, mirrored: Dual6, body: Dual6, [mu_o, mu_i]: [f64; 2]) {
        let p = self.bsdf.parameters();
        for channel in 0..3 {
            let brdf = self.bsdf.body()[channel].eval_with_gradient(mu_o, mu_i);
            let tint = p.specular_tint[channel];
            let r = p.body_reflection;
            out.value[channel] = tint * mirrored.re + r * body.re * brdf.value;
            let row = &mut out.rows[channel];
            row[parameter::SPECULAR_TINT + channel] = mirrored.re;
            row[parameter::BODY_REFLECTION] = body.re * brdf.value;
            row[parameter::BASE_COLOR + channel] = r * body.re * brdf.by_base_color;
            row[parameter::ETA] = r * body.re * brdf.by_eta;
            add_optics(row, mirrored, tint);
            add_optics(row, body, r * brdf.value);
        }
    }

    /// f = k_x^S (k_y^S refracted + (1 - r) k_y body), channel by channel.
    fn exit(&self, out: &mut Scattering, refracted: Dual6, body: Dual6) {
        let p = self.bsdf.parameters();
        let left = 1.0 - p.body_reflection;
        for channel in 0..3 {
            let (tint, passed) = (p.specular_tint[channel], p.transmission_tint[channel]);
            let color = p.transmitted_color[channel];
            let untinted = passed * refracted.re + left * color * body.re;
            out.value[channel] = tint * untinted;
            let row = &mut out.rows[channel];
            row[parameter::SPECULAR_TINT + channel] = untinted;
            row[parameter::TRANSMISSION_TINT + channel] = tint * refracted.re;
            row[parameter::TRANSMITTED_COLOR + channel] = tint * left * body.re;
            row[parameter::BODY_REFLECTION] = -tint * color * body.re;
            add_optics(row, refracted, tint * passed);
            add_optics(row, body, tint * left * color);
        }
    }
}

fn add_optics(row: &mut Row, number: Dual6, factor: f64) {
    for (place, derivative) in OPTICS.into_iter().zip(gradient(number)) {
        row[place] += factor * derivative;
    }
}

type Row = [f64; parameter::COUNT];

/// The value of a connection and its derivatives, channel by channel.
#[derive(Default, Clone, Copy)]
struct Scattering {
    value: Rgb,
    rows: [Row; 3],
}

/// A vertex with what it passes on.
struct Vertex {
    material: usize,
    wo: DVec3,
    passage: Option<(Passage, PassageTerms<Dual6>)>,
    /// The throughput of the path before it.
    throughput: Rgb,
    /// Light added here per unit of throughput.
    lit: Rgb,
    scattered: Option<(Scattering, Rgb)>,
}

/// Sums over the paths of a cell.
struct Sums {
    value: Rgb,
    /// Per channel: materials x parameters.
    rows: [Vec<f64>; 3],
}

impl Sums {
    fn over(strip: &Strip, models: &[Differentiable], scale: f64) -> Self {
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
                    let scattering = models[vertex.material].connect(vertex, connection);
                    vertex.lit += scattering.value * connection.weight;
                    let (material, seed) = (vertex.material, throughput * connection.weight);
                    self.add(material, &scattering, seed);
                }
                Event::Scatter(connection) => {
                    let vertex = path.last_mut().expect("scattering is recorded at a vertex");
                    let scattering = models[vertex.material].connect(vertex, connection);
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
