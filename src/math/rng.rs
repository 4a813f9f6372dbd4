//! Counter-based random numbers: each is a function of (seed, pixel, sample, dimension) alone, so a
//! picture does not depend on threads, tiles or passes.

/// The increment of the Weyl sequence of SplitMix64 (Steele, Lea, Flood 2014).
const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

/// The finaliser of SplitMix64 (variant 13 of Stafford): a bijection that scatters every bit.
#[inline]
pub fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The random numbers of one sample of one pixel; each call moves on by one dimension.
#[derive(Debug, Clone)]
pub struct Sampler(Stream);

#[derive(Debug, Clone)]
enum Stream {
    Independent { state: u64 },
    Sobol { seed: u32, index: u32, dimension: u32, four: [f32; 4] },
}

/// Sets of four dimensions of the Sobol sequence; beyond them it starts again, scrambled in another
/// way.
const SOBOL_SETS: u32 = sobol_burley::NUM_DIMENSION_SETS_4D;

impl Sampler {
    /// The longest low-discrepancy sequence.
    pub const MAX_LOW_DISCREPANCY: u32 = 1 << 16;

    /// The stream of (`seed`, `pixel`, `sample`), at dimension 0, independent of all others.
    #[inline]
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        let state = mix(pixel_key(seed, pixel).wrapping_add(GOLDEN) ^ sample);
        Self(Stream::Independent { state })
    }

    /// The same, but the samples of one pixel fill space evenly: element `sample`, below
    /// [`Sampler::MAX_LOW_DISCREPANCY`], of an Owen-scrambled Sobol sequence. Its mean over samples is
    /// as unbiased and less noisy; the samples are not independent, so they do not tell how noisy.
    #[inline]
    pub fn low_discrepancy(seed: u64, pixel: u64, sample: u32) -> Self {
        let seed = (pixel_key(seed, pixel) >> 32) as u32;
        Self(Stream::Sobol { seed, index: sample, dimension: 0, four: [0.0; 4] })
    }

    /// The next dimension: uniform in [0, 1).
    #[inline(always)]
    pub fn next_1d(&mut self) -> f64 {
        match &mut self.0 {
            Stream::Independent { state } => {
                *state = state.wrapping_add(GOLDEN);
                (mix(*state) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
            }
            Stream::Sobol { seed, index, dimension, four } => {
                let (set, within) = (*dimension / 4, *dimension % 4);
                // Four at once cost no more than one.
                if within == 0 {
                    let seed = seed.wrapping_add(set / SOBOL_SETS);
                    *four = sobol_burley::sample_4d(*index, set % SOBOL_SETS, seed);
                }
                *dimension += 1;
                f64::from(four[within as usize])
            }
        }
    }

    /// The next two dimensions.
    #[inline(always)]
    pub fn next_2d(&mut self) -> [f64; 2] {
        [self.next_1d(), self.next_1d()]
    }
}

#[inline]
fn pixel_key(seed: u64, pixel: u64) -> u64 {
    mix(mix(seed.wrapping_add(GOLDEN)) ^ pixel)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each pair of dimensions of a short sequence has one point in each cell of a grid: what makes
    /// it even; and streams of other pixels are other sequences.
    #[test]
    fn low_discrepancy_streams_fill_every_cell_once() {
        let draw = |pixel, sample| Sampler::low_discrepancy(3, pixel, sample).next_2d();
        for pixel in 0..20 {
            let mut cells = [false; 64];
            for sample in 0..64 {
                let [x, y] = draw(pixel, sample).map(|u| (8.0 * u) as usize);
                cells[8 * y + x] = true;
            }
            assert!(cells.iter().all(|&filled| filled), "pixel {pixel}");
        }
        assert_ne!(draw(0, 0), draw(1, 0));
        assert_eq!(draw(5, 9), draw(5, 9));
    }

    #[test]
    fn low_discrepancy_streams_go_on_beyond_their_dimensions() {
        let mut sampler = Sampler::low_discrepancy(1, 2, 3);
        let draws: Vec<_> = (0..8 * SOBOL_SETS).map(|_| sampler.next_1d()).collect();
        assert!(draws.iter().all(|u| (0.0..1.0).contains(u)));
        assert_ne!(draws[0], draws[4 * SOBOL_SETS as usize]);
    }

    #[test]
    fn equal_keys_give_equal_streams_and_others_do_not() {
        let draw = |seed, pixel, sample| Sampler::new(seed, pixel, sample).next_2d();
        assert_eq!(draw(1, 2, 3), draw(1, 2, 3));
        for other in [draw(2, 2, 3), draw(1, 3, 3), draw(1, 2, 4), draw(3, 2, 1)] {
            assert_ne!(draw(1, 2, 3), other);
        }
    }

    /// Mean and variance of the first two dimensions over many pixels, and the correlation of
    /// neighbours, within five standard errors of those of independent uniforms.
    #[test]
    fn streams_of_neighbouring_pixels_are_uniform_and_uncorrelated() {
        let n = 100_000;
        let draws: Vec<_> = (0..n).map(|pixel| Sampler::new(7, pixel, 0).next_2d()).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..n as usize - 1).map(f).sum::<f64>() / n as f64;
        let tolerance = 5.0 / (n as f64).sqrt();
        assert!((mean(&|i| draws[i][0]) - 0.5).abs() < tolerance * (1.0f64 / 12.0).sqrt());
        assert!((mean(&|i| draws[i][1].powi(2)) - 1.0 / 3.0).abs() < tolerance * 0.3);
        let centred = |i: usize, d: usize| draws[i][d] - 0.5;
        assert!(mean(&|i| centred(i, 0) * centred(i, 1)).abs() < tolerance / 12.0);
        assert!(mean(&|i| centred(i, 0) * centred(i + 1, 0)).abs() < tolerance / 12.0);
    }
}
