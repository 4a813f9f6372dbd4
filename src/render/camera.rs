//! Cameras: from a place in the picture to a ray.

use glam::DVec3;

use crate::accel::ray::Ray;
use crate::error::{Error, Result};

/// How rays leave the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// All through one point; `tan_half_fov` is that of half the horizontal field of view.
    Perspective {
        /// tan(fov / 2).
        tan_half_fov: f64,
    },
    /// All parallel; `width` is that of the picture in the scene.
    Orthographic {
        /// In millimetres.
        width: f64,
    },
}

/// A camera with its picture's resolution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    origin: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    projection: Projection,
    /// Width and height of the picture in pixels.
    pub resolution: [usize; 2],
}

impl Camera {
    /// A camera at `origin` that looks at `target`.
    pub fn new(
        origin: DVec3,
        target: DVec3,
        up: DVec3,
        projection: Projection,
        resolution: [usize; 2],
    ) -> Result<Self> {
        let forward = (target - origin)
            .try_normalize()
            .ok_or_else(|| Error::invalid("camera.target", "is where the camera stands"))?;
        let right = forward
            .cross(up)
            .try_normalize()
            .ok_or_else(|| Error::invalid("camera.up", "is along the viewing direction"))?;
        let up = right.cross(forward);
        Ok(Self { origin, right, up, forward, projection, resolution })
    }

    /// The ray through (`x`, `y`) in pixels, from the picture's top left corner.
    #[inline]
    pub fn ray(&self, x: f64, y: f64) -> Ray {
        let [width, height] = self.resolution.map(|n| n as f64);
        let (u, v) = (2.0 * x / width - 1.0, (height - 2.0 * y) / width);
        match self.projection {
            Projection::Perspective { tan_half_fov } => {
                let direction = self.forward + tan_half_fov * (u * self.right + v * self.up);
                Ray { origin: self.origin, direction: direction.normalize() }
            }
            Projection::Orthographic { width } => {
                let offset = 0.5 * width * (u * self.right + v * self.up);
                Ray { origin: self.origin + offset, direction: self.forward }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn look_down(projection: Projection) -> Camera {
        let origin = DVec3::new(0.0, 0.0, 8.0);
        Camera::new(origin, DVec3::ZERO, DVec3::Y, projection, [200, 100]).unwrap()
    }

    #[test]
    fn corners_of_the_picture_see_the_corners_of_the_plane() {
        for projection in
            [Projection::Perspective { tan_half_fov: 0.5 }, Projection::Orthographic { width: 8.0 }]
        {
            let camera = look_down(projection);
            let at_plane = |x, y| {
                let ray = camera.ray(x, y);
                ray.at(-ray.origin.z / ray.direction.z)
            };
            assert!((at_plane(0.0, 0.0) - DVec3::new(-4.0, 2.0, 0.0)).length() < 1e-12);
            assert!((at_plane(200.0, 100.0) - DVec3::new(4.0, -2.0, 0.0)).length() < 1e-12);
            assert!(at_plane(100.0, 50.0).length() < 1e-12);
        }
    }

    #[test]
    fn degenerate_cameras_are_refused() {
        let projection = Projection::Perspective { tan_half_fov: 1.0 };
        let camera = |target, up| Camera::new(DVec3::Z, target, up, projection, [1, 1]);
        assert!(camera(DVec3::Z, DVec3::Y).is_err());
        assert!(camera(DVec3::ZERO, DVec3::Z).is_err());
    }
}
