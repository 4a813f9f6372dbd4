//! What can be noted of a path while it is traced.

use glam::DVec3;

use crate::math::color::Rgb;
use crate::scatter::passage::Passage;

/// The side of a yarn on which light is scattered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// At x, where it entered.
    Entry,
    /// At y, where it leaves.
    Exit,
    /// At y, where it goes straight on into a ply that touches.
    Straight,
}

impl Side {
    /// The sign of the normal's component of directions on this side.
    #[inline]
    pub(super) fn sign(self) -> f64 {
        if self == Self::Entry { 1.0 } else { -1.0 }
    }
}

/// Takes note of a path as it is traced.
pub trait Recorder {
    /// The path meets a yarn.
    fn vertex(&mut self, material: u32, wo: DVec3, passage: Option<&Passage>);
    /// Light of the given weight reaches the last vertex from local direction `wi`.
    fn light(&mut self, side: Side, wi: DVec3, weight: Rgb);
    /// The path goes on in local direction `wi` with the given weight.
    fn scatter(&mut self, side: Side, wi: DVec3, weight: f64);
    /// The path ends in a light of the given weight.
    fn emitted(&mut self, weight: Rgb);
}

/// Takes no note.
pub struct NoRecorder;

impl Recorder for NoRecorder {
    #[inline]
    fn vertex(&mut self, _: u32, _: DVec3, _: Option<&Passage>) {}
    #[inline]
    fn light(&mut self, _: Side, _: DVec3, _: Rgb) {}
    #[inline]
    fn scatter(&mut self, _: Side, _: DVec3, _: f64) {}
    #[inline]
    fn emitted(&mut self, _: Rgb) {}
}
