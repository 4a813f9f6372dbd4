//! Orthonormal frames: the one place where world directions become local ones.

use glam::{DMat3, DVec3};

/// A right-handed orthonormal frame whose third axis is the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame(DMat3);

impl Frame {
    /// The frame with the given unit normal whose x axis is `tangent` made perpendicular to it.
    ///
    /// A tangent (almost) along the normal is replaced by any perpendicular direction.
    #[inline]
    pub fn new(normal: DVec3, tangent: DVec3) -> Self {
        let across = normal.cross(tangent);
        let length = across.length();
        let y = if length > 1e-9 { across / length } else { normal.any_orthonormal_vector() };
        Self(DMat3::from_cols(y.cross(normal), y, normal))
    }

    /// The frame with the given unit normal and the unit tangent perpendicular to it.
    #[inline]
    pub fn orthonormal(normal: DVec3, tangent: DVec3) -> Self {
        Self(DMat3::from_cols(tangent, normal.cross(tangent), normal))
    }

    /// This frame, given in the world, in the coordinates of another.
    #[inline]
    pub fn seen_from(&self, other: &Self) -> Self {
        Self::orthonormal(other.to_local(self.normal()), other.to_local(self.tangent()))
    }

    /// The unit normal.
    #[inline]
    pub fn normal(&self) -> DVec3 {
        self.0.z_axis
    }

    /// The unit tangent.
    #[inline]
    pub fn tangent(&self) -> DVec3 {
        self.0.x_axis
    }

    /// A world direction in this frame.
    #[inline]
    pub fn to_local(&self, world: DVec3) -> DVec3 {
        DVec3::new(self.0.x_axis.dot(world), self.0.y_axis.dot(world), self.0.z_axis.dot(world))
    }

    /// A direction of this frame in the world.
    #[inline]
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.0 * local
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn local_and_back_is_the_identity() {
        let frame = Frame::new(DVec3::new(1.0, 2.0, -0.5).normalize(), DVec3::Y);
        let direction = DVec3::new(0.3, -0.7, 0.2);
        assert!((frame.to_world(frame.to_local(direction)) - direction).length() < 1e-15);
        assert!(
            (frame.tangent().cross(frame.to_world(DVec3::Y)) - frame.normal()).length() < 1e-15
        );
    }

    #[test]
    fn a_perpendicular_tangent_needs_no_more() {
        let (normal, tangent) = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.8, 0.0, -0.6));
        let (made, given) = (Frame::new(normal, tangent), Frame::orthonormal(normal, tangent));
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            assert!((made.to_world(axis) - given.to_world(axis)).length() < 1e-15);
        }
    }

    #[test]
    fn a_tangent_along_the_normal_still_gives_a_frame() {
        let frame = Frame::new(DVec3::Z, DVec3::Z);
        assert!((frame.tangent().length() - 1.0).abs() < 1e-15);
        assert!(frame.tangent().dot(DVec3::Z).abs() < 1e-15);
    }
}
