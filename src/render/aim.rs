//! What light inside plies is aimed at, so that it comes out towards a lamp.
//!
//! The place where light comes out, and with it the best direction, depends on the direction. One
//! guess is followed to the place that it leads to, and the interface there is aimed at. Nothing of
//! this is random, so any answer leaves means as they are; good ones make them quiet.

use glam::DVec3;

use super::light::LightSample;
use super::scene::{Contact, Interaction, Material, Scene};
use crate::accel::ray::Ray;
use crate::math::frame::Frame;
use crate::scatter::aim::Aim;
use crate::scatter::halo::Halo;
use crate::scatter::ply::PlyBsdf;

/// The most plies, one touching the other, that are looked through.
const MOST_PLIES: u32 = 4;

/// Where light is sent that goes on from a point, in coordinates of that point's frame.
#[derive(Debug, Clone)]
pub enum Target {
    /// Through plies that touch, to come out towards a lamp.
    Through(Aim),
    /// Through the air, to a lamp behind a ribbon.
    Behind(Halo),
}

impl Target {
    /// A direction.
    #[inline]
    pub fn sample(&self, u: [f64; 2]) -> Option<DVec3> {
        match self {
            Self::Through(aim) => aim.sample(u),
            Self::Behind(halo) => halo.sample(u),
        }
    }

    /// The density of [`Target::sample`].
    #[inline]
    pub fn pdf(&self, direction: DVec3) -> f64 {
        match self {
            Self::Through(aim) => aim.pdf(direction),
            Self::Behind(halo) => halo.pdf(direction),
        }
    }
}

impl Scene {
    /// What to aim at from `point` in `frame`, if a ribbon hides the lamp from it.
    pub fn aim_behind(&self, point: DVec3, frame: &Frame, lamp: LightSample) -> Option<Target> {
        let ray = Ray { origin: point, direction: lamp.direction };
        let hit = self.swatch.nearest(&ray).filter(|hit| hit.t < lamp.distance)?;
        let hider = self.interaction(&ray, &hit);
        let ribbon = self.ply(&hider).filter(|_| self.is_ribbon(&hider))?;
        let halo = Halo::new(ribbon, hider.frame.seen_from(frame), frame.to_local(lamp.direction));
        Some(Target::Behind(halo))
    }

    /// What to aim at, from a point of `contact` into the plies there, for a lamp in world direction
    /// `lamp` on their side; in `frame`, whose normal points to either side.
    pub fn aim_through(
        &self,
        contact: &Contact,
        point: DVec3,
        frame: &Frame,
        lamp: DVec3,
    ) -> Option<Target> {
        let entered = |direction| self.through(&Ray { origin: point, direction }, contact.clone());
        let into = entered(lamp);
        let guess = Aim::new(self.ply(&into)?.exit_from_outside(), into.frame, lamp)?.middle();
        let (way_out, bsdf) = self.way_out(entered(guess), guess)?;
        let aim = Aim::new(bsdf.exit_from_outside(), way_out, lamp)?;
        Some(Target::Through(aim.seen_from(frame)))
    }

    /// Where light comes out that goes straight on from `interaction`: the frame there, normal into
    /// the ply, and how that ply scatters.
    fn way_out(&self, mut interaction: Interaction, towards: DVec3) -> Option<(Frame, &PlyBsdf)> {
        for _ in 0..MOST_PLIES {
            let bsdf = self.ply(&interaction)?;
            let exit = self.exit(&interaction, -interaction.wo).1;
            let Some(contact) = exit.contact() else { return Some((exit.frame, bsdf)) };
            interaction = self.through(&Ray { origin: exit.point, direction: towards }, *contact);
        }
        None
    }

    /// How the yarn at `interaction` scatters, if it is made of plies.
    fn ply(&self, interaction: &Interaction) -> Option<&PlyBsdf> {
        match self.material(interaction.material) {
            Material::Ply(bsdf) => Some(bsdf),
            Material::Diffuse { .. } => None,
        }
    }
}
