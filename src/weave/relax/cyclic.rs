//! Cyclic symmetric tridiagonal systems, as chains that close on themselves give them.

/// The LDL^T factors of a cyclic tridiagonal matrix: the chain of all unknowns but the last, and the
/// last one as a border that the chain's two ends couple to.
#[derive(Default)]
pub(super) struct CyclicTridiagonal {
    rows: Vec<Row>,
    last: f64,
}

/// One eliminated unknown.
struct Row {
    inverse_pivot: f64,
    /// Entry of L below the pivot, in the row of the next unknown of the chain.
    next: f64,
    /// Entry of L in the border's row.
    border: f64,
}

impl CyclicTridiagonal {
    /// Factors the positive definite matrix with this diagonal, and with `coupling[j]` between
    /// unknowns j and j + 1, the last coupling back to the first.
    ///
    /// One unknown couples to itself (twice on the diagonal), two couple twice to each other.
    pub fn factor(diagonal: &[f64], coupling: &[f64]) -> Self {
        let mut factors = Self::default();
        factors.refactor(diagonal, coupling);
        factors
    }

    /// Factors another matrix in the room of this one.
    pub fn refactor(&mut self, diagonal: &[f64], coupling: &[f64]) {
        let chain = diagonal.len() - 1;
        let mut last = diagonal[chain];
        self.rows.clear();
        if chain == 0 {
            self.last = 1.0 / (last + 2.0 * coupling[0]);
            return;
        }
        let mut pivot = diagonal[0];
        let mut border = coupling[chain];
        for index in 0..chain {
            let inverse_pivot = 1.0 / pivot;
            let at_the_end = index + 1 == chain;
            let below = if at_the_end { 0.0 } else { coupling[index] };
            if at_the_end {
                border += coupling[index];
            }
            let row =
                Row { inverse_pivot, next: below * inverse_pivot, border: border * inverse_pivot };
            last -= row.border * border;
            pivot = diagonal[index + 1] - row.next * below;
            border *= -row.next;
            self.rows.push(row);
        }
        self.last = 1.0 / last;
    }

    /// Turns the right-hand side into the solution.
    pub fn solve(&self, values: &mut [f64]) {
        let chain = self.rows.len();
        let mut border = values[chain];
        let mut carried = 0.0;
        for (row, value) in self.rows.iter().zip(values.iter_mut()) {
            *value -= carried;
            carried = row.next * *value;
            border -= row.border * *value;
        }
        let last = border * self.last;
        values[chain] = last;
        let mut next = 0.0;
        for (row, value) in self.rows.iter().zip(values.iter_mut()).rev() {
            next = *value * row.inverse_pivot - row.next * next - row.border * last;
            *value = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_what_the_matrix_makes() {
        for count in [1_usize, 2, 3, 4, 7, 50] {
            let wave = |phase: f64| -> Vec<f64> {
                (0..count).map(|index| (1.7 * index as f64 + phase).sin()).collect()
            };
            let (coupling, expected) = (wave(0.3), wave(2.0));
            let diagonal: Vec<f64> = wave(1.0).iter().map(|value| value + 3.5).collect();
            let mut values = vec![0.0; count];
            for index in 0..count {
                let next = (index + 1) % count;
                values[index] += diagonal[index] * expected[index];
                values[index] += coupling[index] * expected[next];
                values[next] += coupling[index] * expected[index];
            }
            CyclicTridiagonal::factor(&diagonal, &coupling).solve(&mut values);
            for (value, expected) in values.iter().zip(&expected) {
                assert!((value - expected).abs() < 1e-12, "{count}: {value} {expected}");
            }
        }
    }
}
