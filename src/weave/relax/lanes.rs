//! Yarns side by side: recurrences along a yarn wait for each other, those of several yarns do not.

use std::array::from_fn;

/// Yarns that are worked on together: enough to hide the latency of a division.
pub(super) const LANES: usize = 8;

/// One number of each of some yarns.
pub(super) type Lanes<const N: usize = LANES> = [f64; N];

/// What `value(lane)` is for each lane.
pub(super) fn lanes<const N: usize>(value: impl FnMut(usize) -> f64) -> Lanes<N> {
    from_fn(value)
}

/// Lays up to [`LANES`] rows of `count` numbers side by side; lanes without a row are nil.
pub(super) fn interleave(rows: &[f64], count: usize, target: &mut [Lanes]) {
    if rows.len() < LANES * count {
        target.fill([0.0; LANES]);
    }
    for (lane, row) in rows.chunks_exact(count).enumerate() {
        target.iter_mut().zip(row).for_each(|(target, &value)| target[lane] = value);
    }
}

/// The inverse of [`interleave`].
pub(super) fn separate(source: &[Lanes], count: usize, rows: &mut [f64]) {
    for (lane, row) in rows.chunks_exact_mut(count).enumerate() {
        row.iter_mut().zip(source).for_each(|(value, source)| *value = source[lane]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_back_and_missing_ones_are_nil() {
        for yarns in [1, 5, LANES] {
            let rows: Vec<f64> = (0..yarns * 3).map(|value| value as f64 + 1.0).collect();
            let mut side_by_side = vec![[7.0; LANES]; 3];
            interleave(&rows, 3, &mut side_by_side);
            for (index, values) in side_by_side.iter().enumerate() {
                for (lane, &value) in values.iter().enumerate() {
                    assert_eq!(value, rows.get(lane * 3 + index).copied().unwrap_or(0.0));
                }
            }
            let mut back = vec![0.0; rows.len()];
            separate(&side_by_side, 3, &mut back);
            assert_eq!(back, rows);
        }
    }
}
