//! Everything that a picture depends on.

use glam::DVec3;

use super::light::Lights;
use crate::accel::ray::Ray;
use crate::cloth::inside::{Sides, Way};
use crate::cloth::spec::YarnShape;
use crate::cloth::swatch::{Hit, Swatch};
use crate::cloth::tile::Place;
use crate::math::color::Rgb;
use crate::math::frame::Frame;
use crate::scatter::ply::PlyBsdf;

/// How a yarn scatters light.
#[derive(Debug)]
pub enum Material {
    /// The ply model.
    Ply(Box<PlyBsdf>),
    /// An opaque, perfectly diffuse surface.
    Diffuse {
        /// The part of the light that is reflected.
        reflectance: Rgb,
    },
}

/// The materials of a cloth's yarns.
#[derive(Debug)]
pub struct Materials {
    /// All different ones.
    pub list: Vec<Material>,
    /// The number of each end's and each pick's (counted from the bottom).
    pub of_yarn: [Vec<u32>; 2],
}

/// A swatch with its materials, and lights.
#[derive(Debug)]
pub struct Scene {
    /// The cloth.
    pub swatch: Swatch,
    /// How its yarns scatter.
    pub materials: Materials,
    /// What shines.
    pub lights: Lights,
    /// What the camera sees where nothing stands in its way, in place of the lights there.
    pub background: Option<Rgb>,
}

/// A surface seen at less than this cosine is turned a little towards the eye: shading normals are
/// smoother than the surface and may face away.
const LEAST_COSINE: f64 = 1e-3;

/// A point where light goes into a yarn.
#[derive(Debug, Clone)]
pub struct Interaction {
    /// Where.
    pub point: DVec3,
    /// Normal towards the side that the ray came from, tangent along the fiber.
    pub frame: Frame,
    /// The direction back along the ray, in the frame.
    pub wo: DVec3,
    /// The number of the yarn's material.
    pub material: u32,
    place: Place,
    /// The plies on both sides, if they are more than this one beyond.
    sides: Option<Box<Sides>>,
}

/// Where a refracted ray comes out of the yarn.
#[derive(Debug, Clone)]
pub struct Exit {
    /// Where.
    pub point: DVec3,
    /// Normal *into* the yarn, tangent along the fiber.
    pub frame: Frame,
    /// The plies on both sides; `None` if there is air beyond.
    sides: Option<Box<Sides>>,
}

/// The way of a refracted ray inside a yarn.
#[derive(Debug, Clone, Copy)]
pub struct Inside {
    /// The direction back along the ray, in the frame where it comes out.
    pub incident: DVec3,
    /// Its length.
    pub length: f64,
}

/// Where light passes between plies that touch, from fiber to fiber: there is no interface.
#[derive(Debug, Clone)]
pub struct Contact {
    /// Normal of the surface there, to either side, and the tangent along the fiber.
    frame: Frame,
    /// The plies there.
    sides: Box<Sides>,
}

impl Interaction {
    /// Whether the ray came through the air.
    #[inline(always)]
    pub fn is_in_air(&self) -> bool {
        self.sides.as_ref().is_none_or(|sides| sides.behind.is_empty())
    }

    /// What light that is scattered back meets, if that is no air.
    #[inline(always)]
    pub fn contact(&self) -> Option<Box<Contact>> {
        let sides = self.sides_behind()?;
        Some(Contact::boxed(self.frame, sides.reversed()))
    }

    /// The plies on both sides, if there is no air where the ray came from.
    #[inline(always)]
    fn sides_behind(&self) -> Option<&Sides> {
        self.sides.as_deref().filter(|sides| !sides.behind.is_empty())
    }
}

impl Exit {
    /// Whether there is air beyond.
    #[inline]
    pub fn is_in_air(&self) -> bool {
        self.sides.is_none()
    }

    /// What light that goes on meets, if that is no air.
    #[inline(always)]
    pub fn contact(&self) -> Option<Box<Contact>> {
        let sides = self.sides.as_ref()?;
        Some(Contact::boxed(self.frame, sides.clone()))
    }
}

impl Contact {
    #[cold]
    fn boxed(frame: Frame, sides: Box<Sides>) -> Box<Self> {
        Box::new(Self { frame, sides })
    }
}

impl Scene {
    /// What `hit` by `ray`, which came through the air, means for shading.
    #[inline(always)]
    pub fn interaction(&self, ray: &Ray, hit: &Hit) -> Interaction {
        let back = -ray.direction;
        let frame = frame_facing(back, hit.surface.normal, hit.surface.tangent);
        let Hit { t, place, .. } = *hit;
        Interaction {
            point: ray.at(t),
            frame,
            wo: frame.to_local(back),
            material: self.materials.of_yarn[place.set as usize][place.yarn],
            place,
            sides: self.swatch.entered(ray, hit),
        }
    }

    /// What it means for shading that `ray` goes on through a contact at its origin.
    #[cold]
    pub fn through(&self, ray: &Ray, contact: Contact) -> Interaction {
        let Contact { frame, sides } = contact;
        let back = -ray.direction;
        let normal = frame.normal() * back.dot(frame.normal()).signum();
        let frame = frame_facing(back, normal, frame.tangent());
        let place = sides.ahead[sides.ahead.len() - 1];
        Interaction {
            point: ray.origin,
            frame,
            wo: frame.to_local(back),
            material: self.materials.of_yarn[place.set as usize][place.yarn],
            place,
            sides: Some(sides),
        }
    }

    /// Where the ray refracted at `interaction` into `refracted` (in its frame) comes out: across
    /// a ply, or on the other face of a ribbon (Eq. 15).
    #[inline]
    pub fn exit(&self, interaction: &Interaction, refracted: DVec3) -> (Inside, Exit) {
        let Interaction { point, frame, place, sides, .. } = interaction;
        match *self.swatch.tile().shape(place) {
            YarnShape::Flat { thickness, .. } => {
                let inside = Inside { incident: -refracted, length: thickness / -refracted.z };
                // A ribbon lies inside the same plies with both of its faces.
                let sides = interaction.sides_behind().map(Sides::reversed);
                (inside, Exit { point: *point, frame: *frame, sides })
            }
            YarnShape::Round { .. } => {
                let direction = frame.to_world(refracted);
                let ray = Ray { origin: *point, direction };
                let ahead = sides.as_ref().map_or(&[][..], |sides| &sides.ahead);
                let others = &ahead[..ahead.len().saturating_sub(1)];
                let Way { length, surface, sides } = self.swatch.way(place, others, &ray);
                let frame = frame_facing(-direction, surface.normal, surface.tangent);
                let inside = Inside { incident: frame.to_local(-direction), length };
                (inside, Exit { point: ray.at(length), frame, sides })
            }
        }
    }

    /// Whether the yarn there is a ribbon, whose two faces are one.
    #[inline]
    pub fn is_ribbon(&self, interaction: &Interaction) -> bool {
        self.swatch.tile().shape(&interaction.place).is_ribbon()
    }

    /// Whether nothing stands between a point and something at `distance` in `direction`.
    #[inline]
    pub fn visible(&self, origin: DVec3, direction: DVec3, distance: f64) -> bool {
        let ray = Ray { origin, direction };
        !self.lights.occluded(&ray, distance) && !self.swatch.occluded(&ray, distance)
    }

    /// The material with this number.
    #[inline]
    pub fn material(&self, number: u32) -> &Material {
        &self.materials.list[number as usize]
    }
}

/// The frame with the given normal, turned just enough to face `direction`.
#[inline(always)]
fn frame_facing(direction: DVec3, normal: DVec3, tangent: DVec3) -> Frame {
    let cosine = direction.dot(normal);
    if cosine >= LEAST_COSINE {
        return Frame::orthonormal(normal, tangent);
    }
    let turned = normal + (2.0 * LEAST_COSINE - cosine) * direction;
    Frame::new(turned.normalize(), tangent)
}
