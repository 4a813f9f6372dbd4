//! What a pixel has gathered, in 20 bytes: the mean of its samples and how far that may be off.
//!
//! Both are brought up to date sample by sample (Welford 1962), in double precision, and then stored
//! in few bits: means with the 24 of single precision, variances with 14. What is rounded is rounded
//! up or down at random, in proportion to how near either is, so that errors do not add up: after n
//! samples they are about sqrt(n / 3) roundings. At n = 4096 that is 1e-6 of a mean, and 0.13% of
//! a variance, which n samples themselves tell to no better than sqrt(2 / n), 2.2%.

use crate::math::color::Rgb;

/// Bits of the mantissa that are stored, without the leading one.
const MEAN_BITS: u32 = 23;
const VARIANCE_BITS: u32 = 13;

/// A variance is a single-precision number without its sign and its lowest bits.
const VARIANCE_SHIFT: u32 = 23 - VARIANCE_BITS;
const VARIANCE_WIDTH: u32 = 8 + VARIANCE_BITS;

/// Random bits with which both neighbours are equally far: rounds to the nearest.
const NEAREST: u64 = 1 << 63;

/// Words that a pixel is saved as.
pub const WORDS: usize = 5;

/// The mean of samples, and the variance of that mean as the samples have it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pixel {
    mean: [f32; 3],
    /// Three of [`VARIANCE_WIDTH`] bits.
    variances: [u32; 2],
}

impl Pixel {
    /// The mean of the samples; zero before the first.
    pub fn mean(&self) -> [f32; 3] {
        self.mean
    }

    /// The variance of the mean; zero before the second sample.
    pub fn variance(&self) -> [f32; 3] {
        let [low, high] = self.variances.map(u64::from);
        let packed = high << 32 | low;
        [0, 1, 2].map(|channel| {
            let bits = packed >> (channel * VARIANCE_WIDTH) & ((1 << VARIANCE_WIDTH) - 1);
            f32::from_bits((bits as u32) << VARIANCE_SHIFT)
        })
    }

    /// Adds a sample, with which there are `count`; `random` decides what is rounded up.
    pub fn add(&mut self, sample: [f32; 3], count: u64, random: u64) {
        let n = count as f64;
        let mean = Rgb::from(self.mean.map(f64::from));
        let difference = Rgb::from(sample.map(f64::from)) - mean;
        let variance = Rgb::from(self.variance().map(f64::from));
        let step = difference / n;
        // The variance of the mean of one sample is not known; it is left at zero.
        let spread = if count > 1 { step * step } else { Rgb::ZERO };
        self.store(mean + step, variance * ((n - 2.0).max(0.0) / n) + spread, random);
    }

    /// Joins other samples to the `own` ones: `others` of them are in `other`.
    pub fn merge(&mut self, own: u64, other: &Self, others: u64) {
        if own == 0 || others == 0 {
            *self = if own == 0 { *other } else { *self };
            return;
        }
        let (a, b) = (own as f64, others as f64);
        let n = a + b;
        let [mean_a, mean_b] = [self, other].map(|pixel| Rgb::from(pixel.mean.map(f64::from)));
        let [var_a, var_b] =
            [&*self, other].map(|pixel| Rgb::from(pixel.variance().map(f64::from)));
        let difference = mean_b - mean_a;
        let squares = var_a * (a * (a - 1.0))
            + var_b * (b * (b - 1.0))
            + difference * difference * (a * b / n);
        let mean = (mean_a * a + mean_b * b) / n;
        self.store(mean, squares / (n * (n - 1.0)), NEAREST);
    }

    /// The pixel as words, from which [`Pixel::from_words`] makes it anew.
    pub fn to_words(self) -> [u32; WORDS] {
        let [r, g, b] = self.mean.map(f32::to_bits);
        let [low, high] = self.variances;
        [r, g, b, low, high]
    }

    /// The pixel that was saved as these words.
    pub fn from_words([r, g, b, low, high]: [u32; WORDS]) -> Self {
        Self { mean: [r, g, b].map(f32::from_bits), variances: [low, high] }
    }

    fn store(&mut self, mean: Rgb, variance: Rgb, random: u64) {
        self.mean = mean.to_array().map(|value| rounded(value, MEAN_BITS, random));
        let bits = variance
            .to_array()
            .map(|value| u64::from(rounded(value, VARIANCE_BITS, random).to_bits()));
        let packed = (0..3).fold(0, |packed, channel| {
            packed | bits[channel] >> VARIANCE_SHIFT << (channel as u32 * VARIANCE_WIDTH)
        });
        self.variances = [packed as u32, (packed >> 32) as u32];
    }
}

/// `value` with so many bits of its mantissa kept, the rest rounded up if `random` is large enough.
fn rounded(value: f64, bits: u32, random: u64) -> f32 {
    let dropped = f64::MANTISSA_DIGITS - 1 - bits;
    let carried = value.to_bits() + (random >> (u64::BITS - dropped));
    f64::from_bits(carried >> dropped << dropped) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rng::mix;

    /// Samples of the shape that cloth has: mostly small, now and then bright.
    fn samples(count: u64) -> impl Iterator<Item = [f32; 3]> {
        (0..count).map(|i| {
            let u = (mix(i) >> 40) as f32 / (1 << 24) as f32;
            let bright = if u < 0.01 { 30.0 } else { u };
            [0.3 + 1e-3 * bright, bright, 1e-3 * bright]
        })
    }

    fn gathered(count: u64) -> Pixel {
        let mut pixel = Pixel::default();
        for (i, sample) in (0..count).zip(samples(count)) {
            pixel.add(sample, i + 1, mix(mix(i)));
        }
        pixel
    }

    /// Mean and variance of the mean, in double precision.
    fn exact(count: u64) -> [Rgb; 2] {
        let n = count as f64;
        let wide = || samples(count).map(|sample| Rgb::from(sample.map(f64::from)));
        let mean = wide().sum::<Rgb>() / n;
        let squares = wide().map(|sample| (sample - mean) * (sample - mean)).sum::<Rgb>();
        [mean, squares / (n * (n - 1.0))]
    }

    /// Within five standard deviations of sqrt(n / 3) roundings, each at most 0.5 of the last bit on
    /// average.
    #[test]
    fn rounding_does_not_add_up() {
        for count in [2, 16, 1024, 4096, 1 << 20] {
            let [mean, variance] = exact(count);
            let pixel = gathered(count);
            let roundings = 5.0 * 0.5 * (count as f64 / 3.0).sqrt().max(1.0);
            for channel in 0..3 {
                let off = f64::from(pixel.mean()[channel]) / mean[channel] - 1.0;
                assert!(off.abs() < roundings / f64::from(1 << MEAN_BITS), "{count}: mean {off}");
                let off = f64::from(pixel.variance()[channel]) / variance[channel] - 1.0;
                let bound = roundings / f64::from(1 << VARIANCE_BITS);
                assert!(off.abs() < bound, "{count}: variance {off}");
            }
        }
    }

    #[test]
    fn a_pixel_takes_twenty_bytes() {
        assert_eq!(size_of::<Pixel>(), 20);
    }

    #[test]
    fn equal_samples_have_themselves_as_mean_and_no_variance() {
        let mut pixel = Pixel::default();
        for i in 0..10_000 {
            pixel.add([0.3, 1e-7, 5e8], i + 1, mix(i));
        }
        assert_eq!(pixel.mean(), [0.3, 1e-7, 5e8]);
        assert_eq!(pixel.variance(), [0.0; 3]);
    }

    #[test]
    fn merged_pixels_have_the_mean_and_variance_of_all_samples() {
        let [mean, variance] = exact(3000);
        let (mut one, mut other) = (Pixel::default(), Pixel::default());
        for (i, sample) in (0..).zip(samples(3000)) {
            let (pixel, count) = if i < 1000 { (&mut one, i + 1) } else { (&mut other, i - 999) };
            pixel.add(sample, count, mix(i));
        }
        let mut turned = other;
        turned.merge(2000, &one, 1000);
        one.merge(1000, &other, 2000);
        assert_eq!(one, turned);
        for channel in 0..3 {
            let [m, v] = [one.mean()[channel], one.variance()[channel]].map(f64::from);
            assert!((m / mean[channel] - 1.0).abs() < 1e-5);
            assert!((v / variance[channel] - 1.0).abs() < 0.01);
        }
        let mut empty = Pixel::default();
        empty.merge(0, &one, 3000);
        assert_eq!(empty, one);
        empty.merge(3000, &Pixel::default(), 0);
        assert_eq!(empty, one);
    }

    #[test]
    fn words_bring_a_pixel_back() {
        let pixel = gathered(100);
        assert_eq!(Pixel::from_words(pixel.to_words()), pixel);
    }
}
