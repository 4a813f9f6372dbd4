//! Matrix transposition in cache-sized blocks.

use rayon::prelude::*;

const BLOCK: usize = 16;

/// The transpose of a row-major matrix.
pub(super) fn transpose<T: Copy + Default + Send + Sync>(
    source: &[T],
    rows: usize,
    columns: usize,
) -> Vec<T> {
    let mut target = vec![T::default(); source.len()];
    zip_transposed(&mut target, source, rows, columns, |_, source| source);
    target
}

/// Gives each element of `target`, columns x rows, the value of itself and its counterpart in
/// `source`, rows x columns.
pub(super) fn zip_transposed<T: Copy + Send, S: Copy + Sync>(
    target: &mut [T],
    source: &[S],
    rows: usize,
    columns: usize,
    value: impl Fn(T, S) -> T + Sync,
) {
    target.par_chunks_mut(BLOCK * rows).enumerate().for_each(|(block, target)| {
        for first_row in (0..rows).step_by(BLOCK) {
            let block_rows = first_row..rows.min(first_row + BLOCK);
            for (offset, target) in target.chunks_mut(rows).enumerate() {
                let column = block * BLOCK + offset;
                for row in block_rows.clone() {
                    target[row] = value(target[row], source[row * columns + column]);
                }
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_become_columns() {
        for (rows, columns) in [(1, 1), (1, 40), (40, 1), (17, 33), (32, 16)] {
            let source: Vec<usize> = (0..rows * columns).collect();
            let target = transpose(&source, rows, columns);
            for (index, value) in source.iter().enumerate() {
                assert_eq!(target[(index % columns) * rows + index / columns], *value);
            }
        }
    }
}
