//! Everything that a picture depends on.

use glam::DVec3;

use super::camera::Camera;
use super::light::Lights;
use crate::accel::ray::Ray;
use crate::cloth::spec::YarnShape;
use crate::cloth::swatch::{Hit, Swatch};
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

/// A swatch with its materials, a camera and lights.
#[derive(Debug)]
pub struct Scene {
    /// The cloth.
    pub swatch: Swatch,
    /// The shape of ends and picks.
    pub shapes: [YarnShape; 2],
    /// How its yarns scatter.
    pub materials: Materials,
    /// Who looks.
    pub camera: Camera,
    /// What shines.
    pub lights: Lights,
}

/// A surface seen at less than this cosine is turned a little towards the eye: shading normals are
/// smoother than the surface and may face away.
const LEAST_COSINE: f64 = 1e-3;

/// A point where a ray meets a yarn, from outside.
#[derive(Debug, Clone, Copy)]
pub struct Interaction {
    /// Where.
    pub point: DVec3,
    /// Normal towards the side that the ray came from, tangent along the fiber.
    pub frame: Frame,
    /// The direction back along the ray, in the frame.
    pub wo: DVec3,
    /// The number of the yarn's material.
    pub material: u32,
    hit: Hit,
}

/// Where a refracted ray comes out of the yarn.
#[derive(Debug, Clone, Copy)]
pub struct Exit {
    /// Where.
    pub point: DVec3,
    /// Normal *into* the yarn, tangent along the fiber.
    pub frame: Frame,
    /// The direction back along the ray, in the frame.
    pub incident: DVec3,
    /// The length of the way inside.
    pub length: f64,
}

impl Scene {
    /// What `hit` by `ray` means for shading.
    #[inline]
    pub fn interaction(&self, ray: &Ray, hit: Hit) -> Interaction {
        let back = -ray.direction;
        let normal = match self.shapes[hit.set as usize] {
            YarnShape::Round { .. } => hit.surface.normal,
            YarnShape::Flat { .. } => hit.surface.normal * back.dot(hit.surface.normal).signum(),
        };
        let frame = frame_facing(back, normal, hit.surface.tangent);
        let material = self.materials.of_yarn[hit.set as usize][hit.yarn];
        let wo = frame.to_local(back);
        Interaction { point: ray.at(hit.t), frame, wo, material, hit }
    }

    /// Where the ray refracted at `interaction` into `refracted` (in its frame) comes out: across
    /// a ply, or on the other face of a ribbon (Eq. 15).
    #[inline]
    pub fn exit(&self, interaction: &Interaction, refracted: DVec3) -> Exit {
        let direction = interaction.frame.to_world(refracted);
        let Interaction { point, frame, hit, .. } = *interaction;
        match self.shapes[hit.set as usize] {
            YarnShape::Flat { thickness, .. } => {
                let length = thickness / -refracted.z;
                Exit { point, frame, incident: -refracted, length }
            }
            YarnShape::Round { .. } => {
                let ray = Ray { origin: point, direction };
                let (length, surface) = self.swatch.leave(&hit, &ray);
                let frame = frame_facing(-direction, -surface.normal, surface.tangent);
                let incident = frame.to_local(-direction);
                Exit { point: ray.at(length), frame, incident, length }
            }
        }
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
#[inline]
fn frame_facing(direction: DVec3, normal: DVec3, tangent: DVec3) -> Frame {
    let cosine = direction.dot(normal);
    if cosine >= LEAST_COSINE {
        return Frame::orthonormal(normal, tangent);
    }
    let turned = normal + (2.0 * LEAST_COSINE - cosine) * direction;
    Frame::new(turned.normalize(), tangent)
}
