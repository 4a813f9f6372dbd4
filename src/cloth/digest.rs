//! Numbers that stand for what is too large to be compared each time.

use std::hash::{DefaultHasher, Hash, Hasher};

use super::relaxed_cloth::Curves;
use super::spec::{ClothSpec, YarnShape, YarnSpec};

/// 128 bits that stand for a value: no two of the values that fit in memory are likely to share them.
pub(super) fn digest(value: &(impl Hash + ?Sized)) -> u128 {
    let [high, low] = [0, 1].map(|half: u64| {
        let mut hasher = DefaultHasher::new();
        (half, value).hash(&mut hasher);
        u128::from(hasher.finish())
    });
    high << 64 | low
}

/// The digest of a cloth, and of its heights if those are known: equal for two whose geometry is.
pub fn cloth_digest(spec: &ClothSpec, heights: Option<&[Curves; 2]>) -> u128 {
    let ClothSpec { pattern, warp, weft, collision_stiffness } = spec;
    let known: Option<Vec<_>> =
        heights.map(|curves| curves.iter().flatten().map(|values| Bits(values)).collect());
    let own = (pattern.ends, &pattern.warp_up, collision_stiffness.to_bits());
    digest(&(own, YarnBits(warp), YarnBits(weft), known))
}

/// Numbers that are alike if all their bits are.
struct Bits<'a>(&'a [f64]);

impl Hash for Bits<'_> {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        self.0.len().hash(hasher);
        self.0.iter().for_each(|value| value.to_bits().hash(hasher));
    }
}

struct YarnBits<'a>(&'a YarnSpec);

impl Hash for YarnBits<'_> {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        let YarnSpec { kinds, kind_of, spacing } = self.0;
        kind_of.hash(hasher);
        Bits(spacing).hash(hasher);
        for kind in kinds {
            kind.stiffness.to_bits().hash(hasher);
            match kind.shape {
                YarnShape::Round { radius, thickness, collision, plies, ply_radius, pitch } => {
                    plies.hash(hasher);
                    Bits(&[radius, thickness, collision, ply_radius, pitch]).hash(hasher);
                }
                YarnShape::Flat { width, thickness } => Bits(&[width, thickness]).hash(hasher),
            }
        }
    }
}
