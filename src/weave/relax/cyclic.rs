//! Cyclic symmetric tridiagonal systems, as chains that close on themselves give them.

use super::lanes::{Lanes, lanes};

/// The LDL^T factors of M cyclic tridiagonal matrices side by side: the chain of all unknowns but the
/// last, and the last one as a border that the chain's two ends couple to.
pub(super) struct CyclicTridiagonal<const M: usize> {
    rows: Vec<Row<M>>,
    inverse_last: Lanes<M>,
}

/// One eliminated unknown.
struct Row<const M: usize> {
    inverse_pivot: Lanes<M>,
    /// Entry of L below the pivot, in the row of the next unknown of the chain.
    next: Lanes<M>,
    /// Entry of L in the border's row.
    border: Lanes<M>,
}

impl<const M: usize> CyclicTridiagonal<M> {
    /// Room for matrices of `count` unknowns.
    pub fn with_room(count: usize) -> Self {
        Self { rows: Vec::with_capacity(count - 1), inverse_last: [0.0; M] }
    }

    /// Factors the positive definite matrix with this diagonal, and with `coupling(j)` between
    /// unknowns j and j + 1, the last coupling back to the first.
    ///
    /// One unknown couples to itself (twice on the diagonal), two couple twice to each other.
    pub fn factor(&mut self, diagonal: &[Lanes<M>], coupling: impl Fn(usize) -> Lanes<M>) {
        self.rows.clear();
        let chain = diagonal.len() - 1;
        let mut last = diagonal[chain];
        let mut border = coupling(chain);
        if chain == 0 {
            self.inverse_last = lanes(|lane| 1.0 / (last[lane] + 2.0 * border[lane]));
            return;
        }
        let mut pivot = diagonal[0];
        for index in 0..chain {
            let at_the_end = index + 1 == chain;
            let coupled = coupling(index);
            if at_the_end {
                border = lanes(|lane| border[lane] + coupled[lane]);
            }
            let below = if at_the_end { [0.0; M] } else { coupled };
            let inverse_pivot: Lanes<M> = lanes(|lane| 1.0 / pivot[lane]);
            let row = Row {
                inverse_pivot,
                next: lanes(|lane| below[lane] * inverse_pivot[lane]),
                border: lanes(|lane| border[lane] * inverse_pivot[lane]),
            };
            last = lanes(|lane| last[lane] - row.border[lane] * border[lane]);
            pivot = lanes(|lane| diagonal[index + 1][lane] - row.next[lane] * below[lane]);
            border = lanes(|lane| -border[lane] * row.next[lane]);
            self.rows.push(row);
        }
        self.inverse_last = lanes(|lane| 1.0 / last[lane]);
    }

    /// Turns N right-hand sides into their solutions, each by the matrix of its lane, or all by the
    /// only one.
    pub fn solve<const N: usize>(&self, values: &mut [Lanes<N>]) {
        const { assert!(M == 1 || M == N) };
        let chain = self.rows.len();
        let mut border = values[chain];
        let mut carried = [0.0; N];
        for (row, value) in self.rows.iter().zip(values.iter_mut()) {
            *value = lanes(|lane| value[lane] - carried[lane]);
            carried = lanes(|lane| row.next[lane % M] * value[lane]);
            border = lanes(|lane| border[lane] - row.border[lane % M] * value[lane]);
        }
        let last: Lanes<N> = lanes(|lane| border[lane] * self.inverse_last[lane % M]);
        values[chain] = last;
        let mut next = [0.0; N];
        for (row, value) in self.rows.iter().zip(values.iter_mut()).rev() {
            next = lanes(|lane| {
                let m = lane % M;
                value[lane] * row.inverse_pivot[m]
                    - row.next[m] * next[lane]
                    - row.border[m] * last[lane]
            });
            *value = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(count: usize, phase: f64) -> Vec<Lanes<3>> {
        let value = |index: usize, lane: usize| (1.7 * index as f64 + phase + lane as f64).sin();
        (0..count).map(|index| lanes(|lane| value(index, lane))).collect()
    }

    /// What the matrices of this diagonal and coupling make of `vectors`.
    fn product(
        diagonal: &[Lanes<3>],
        coupling: &[Lanes<3>],
        vectors: &[Lanes<3>],
        matrix: impl Fn(usize) -> usize,
    ) -> Vec<Lanes<3>> {
        let count = vectors.len();
        let mut values = vec![[0.0; 3]; count];
        for lane in 0..3 {
            let m = matrix(lane);
            for index in 0..count {
                let next = (index + 1) % count;
                values[index][lane] += diagonal[index][m] * vectors[index][lane];
                values[index][lane] += coupling[index][m] * vectors[next][lane];
                values[next][lane] += coupling[index][m] * vectors[index][lane];
            }
        }
        values
    }

    fn check(found: &[Lanes<3>], expected: &[Lanes<3>]) {
        for (value, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((value - expected).abs() < 1e-12, "{}: {value} {expected}", found.len());
        }
    }

    #[test]
    fn solves_what_the_matrices_make() {
        for count in [1_usize, 2, 3, 4, 7, 50] {
            let (coupling, expected) = (wave(count, 0.3), wave(count, 2.0));
            let diagonal: Vec<_> =
                wave(count, 1.0).iter().map(|row| row.map(|v| v + 3.5)).collect();

            let mut values = product(&diagonal, &coupling, &expected, |lane| lane);
            let mut each = CyclicTridiagonal::with_room(count);
            each.factor(&diagonal, |index| coupling[index]);
            each.solve(&mut values);
            check(&values, &expected);

            let mut values = product(&diagonal, &coupling, &expected, |_| 1);
            let only: Vec<_> = diagonal.iter().map(|row| [row[1]]).collect();
            let mut one = CyclicTridiagonal::with_room(count);
            one.factor(&only, |index| [coupling[index][1]]);
            one.solve(&mut values);
            check(&values, &expected);
        }
    }
}
