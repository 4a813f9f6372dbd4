//! The ply BSDF with its derivatives by all parameters.

use glam::DVec3;
use num_dual::DualNum;

use super::parameter;
use super::record::Connection;
use crate::error::Result;
use crate::math::color::Rgb;
use crate::math::dual::{Dual6, gradient, variable};
use crate::render::recorder::Side;
use crate::scatter::dielectric::RoughDielectric;
use crate::scatter::ggx::Ggx;
use crate::scatter::passage::{Passage, PassageTerms, PlyOptics};
use crate::scatter::ply::{PlyBsdf, PlyParameters};

/// Where the six variables of [`PlyOptics`] stand among the parameters.
const OPTICS: [usize; 6] = [
    parameter::ETA,
    parameter::EXTINCTION,
    parameter::ROUGHNESS,
    parameter::ROUGHNESS + 1,
    parameter::EXIT_ROUGHNESS,
    parameter::EXIT_ROUGHNESS + 1,
];

/// A passage with what it lets through.
pub type DifferentiablePassage = (Passage, PassageTerms<Dual6>);

/// A ply whose values carry derivatives with respect to [`OPTICS`].
pub struct Differentiable {
    bsdf: PlyBsdf,
    /// What does not depend on colours.
    pub optics: PlyOptics<Dual6>,
}

impl Differentiable {
    /// The ply with the given parameters.
    pub fn new(parameters: PlyParameters) -> Result<Self> {
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

    /// The value of a connection, and its derivatives; `wo` and `passage` are those of its vertex.
    pub fn connect(
        &self,
        wo: DVec3,
        passage: Option<&DifferentiablePassage>,
        connection: &Connection,
    ) -> Scattering {
        let mut scattering = Scattering::default();
        let wi = connection.wi;
        match (connection.side, passage) {
            (Side::Entry, passage) => {
                let [mirrored, body] = self.optics.at_entry(wo, wi, passage);
                self.entry(&mut scattering, mirrored, body, [wo.z, wi.z]);
            }
            (Side::Exit, Some((passage, terms))) => {
                let [refracted, body] = self.optics.at_exit(passage, terms, wi);
                self.exit(&mut scattering, refracted, body);
            }
            (Side::Straight, Some((_, terms))) => {
                self.exit(&mut scattering, terms.entered * terms.transmittance, Dual6::from(0.0));
            }
            (Side::Exit | Side::Straight, None) => {}
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
pub struct Scattering {
    /// The value.
    pub value: Rgb,
    /// The derivatives of each channel by the parameters.
    pub rows: [Row; 3],
}
